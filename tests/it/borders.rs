//! Samples on many borders at once: every border counts, and the cost stays bounded.
//!
//! Regressions: eight user axes whose intervals end at one sample cost a second per step, with factorial growth; of
//! more than 128 pieces the rest were dropped, so that a pyramid of twelve sides held its apex or not by chance.

use rapier3d_fields::field::Query;
use rapier3d_fields::math::{DVec3, to_dvec3};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

/// The force of a tree at the origin by `Reference`, with all axes zero. Asserts that `Fields` gives the same, or zero
/// where the tree is not defined.
fn at_origin(tree: &Tree, axes: &[String]) -> Option<DVec3> {
    let mut world = PhysicsWorld::new();
    let (body, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
    let reference = Reference::new(tree).expect("a valid tree");
    let query = Query {
        user: axes
            .iter()
            .map(|axis| (axis.as_str().into(), 0.0))
            .collect(),
        ..Query::default()
    };
    let force = reference.force(&WorldRef::from(&world), &query);
    let builder = Fields::builder(tree.clone());
    let builder = axes
        .iter()
        .fold(builder, |builder, axis| builder.axis(axis, 0.0));
    let fields = builder.build().expect("a valid tree");
    let sampled = fields.sample(body, &world);
    let sampled = sampled.expect("finite").expect("a dynamic body");
    assert_eq!(to_dvec3(sampled.force), force.unwrap_or(DVec3::ZERO));
    force
}

fn push() -> Field {
    Field::uniform(Vector::X).coupled_to(Coupling::Each)
}

#[test]
fn intervals_of_many_axes_may_end_at_one_sample() {
    for count in [8, 12, 16, 24] {
        let axes: Vec<String> = (0..count).map(|k| format!("a{k}")).collect();
        let range = |k: usize| match k % 2 {
            0 => Region::interval(axes[k].as_str(), 0.0, 1.0),
            _ => Region::interval(axes[k].as_str(), -1.0, 0.0),
        };
        let ranges: Vec<Region> = (0..count).map(range).collect();
        let all = ranges.iter().cloned();
        let in_all = push().within(all.reduce(Region::intersection).expect("axes"));
        let one_each = || ranges.iter().map(|range| push().within(range.clone()));
        let every = Tree::fold(Operator::SumIntersection, one_each());
        let any = Tree::fold(Operator::SumUnion, one_each());
        let sum = Some(DVec3::X * count as f64);
        assert_eq!(at_origin(&any, &axes), sum);
        assert_eq!(at_origin(&every, &axes), sum);
        assert_eq!(at_origin(&in_all.clone().into(), &axes), Some(DVec3::X));
        // The border belongs to the rest of a difference.
        let around = push().difference(in_all.clone());
        assert_eq!(at_origin(&around, &axes), Some(DVec3::X));
        // Within all ranges but outside one of them: nowhere.
        let cut = Tree::from(in_all).difference(push().within(ranges[count / 2].clone()));
        assert_eq!(at_origin(&cut, &axes), None);
        // Within exactly one of each pair.
        let pairs = ranges.chunks(2).map(|pair| {
            let [a, b] = [pair[0].clone(), pair[1].clone()];
            let only_a = a.clone().difference(b.clone());
            only_a.union(b.difference(a))
        });
        let odd = pairs.reduce(Region::intersection).expect("pairs");
        assert_eq!(at_origin(&push().within(odd).into(), &axes), Some(DVec3::X));
    }
}

/// Half-spaces whose intersection is a pyramid below its apex, the origin.
fn pyramid(sides: usize) -> Vec<Region> {
    let side = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / sides as f64;
        let outward = Vector::new(angle.cos() as Real, 0.5, angle.sin() as Real);
        Region::half_space(outward.normalize(), 0.0)
    };
    (0..sides).map(side).collect()
}

/// The apex also belongs to the complement of the pyramid.
#[test]
fn a_pyramid_of_many_sides_holds_its_apex() {
    for count in [12, 64] {
        let sides = pyramid(count);
        let inside = sides.iter().cloned().reduce(Region::intersection);
        let inside = inside.expect("sides");
        let within = |region: Region| at_origin(&push().within(region).into(), &[]);
        assert_eq!(within(inside.clone()), Some(DVec3::X), "{count} sides");
        assert_eq!(within(inside.clone().complement()), Some(DVec3::X));
        for side in [&sides[0], &sides[count / 3]] {
            let cut = inside.clone().difference(side.clone());
            assert_eq!(within(cut), None, "the pyramid is behind each side");
            assert_eq!(
                within(side.clone().difference(inside.clone())),
                Some(DVec3::X)
            );
        }
        // The same with fields: all of them are defined in the pyramid.
        let fields = || sides.iter().map(|side| push().within(side.clone()));
        let all = Tree::fold(Operator::SumIntersection, fields());
        assert_eq!(at_origin(&all, &[]), Some(DVec3::X * count as f64));
        let cut = all.difference(push().within(sides[1].clone()));
        assert_eq!(at_origin(&cut, &[]), None);
    }
}
