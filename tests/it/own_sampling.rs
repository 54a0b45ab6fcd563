//! A body's own sampling in steps.

use rapier3d_fields::math::{Rotation, to_f64};
use rapier3d_fields::prelude::*;

use crate::lab::stability::SCHEMES;
use crate::sampling::{one, wrench};
use crate::support::{assert_at_most, assert_close, either};

/// A uniform force did not follow the body's own sampling where the field has no region.
///
/// By its mass, a uniform force turns no body. Shared out over the surface it turns a cone, whose centre of area is not
/// its centre of mass; as much by the body's own sampling as by the field's.
#[test]
fn a_bodys_own_sampling_turns_it_in_a_step() {
    for scheme in SCHEMES {
        let end = |by_field: bool, own: Option<Sampling>| {
            let cone = ColliderBuilder::cone(0.8, 0.5).density(1.0);
            let (mut world, body) = one(Vector::ZERO, Rotation::IDENTITY, cone);
            let mut push = Field::uniform(Vector::X);
            if by_field {
                push = push.sampled(Sampling::Surface);
            }
            let mut fields = Fields::builder(push).scheme(scheme).build().expect("valid");
            let set = fields.set_sampling(body, own, &world.bodies);
            set.expect("it is there");
            for _ in 0..3 {
                fields.step(&mut world).expect("a step");
            }
            let body = &world.bodies[body];
            (body.linvel(), body.angvel())
        };
        let [of_field, of_body] = [end(true, None), end(false, Some(Sampling::Surface))];
        // The field is evaluated at four points, because it is linear.
        let (moves, turns) = (of_body.0 - of_field.0, of_body.1 - of_field.1);
        let rounding = either(1e-8, 1e-15);
        assert_at_most(
            to_f64((moves + turns).length()),
            rounding,
            format!("{scheme:?}"),
        );
        assert!(of_body.1.z.abs() > 1e-3, "{scheme:?}: {of_body:?}");
        let (_, turn) = end(false, None);
        assert_eq!(turn, Vector::ZERO, "{scheme:?}");
    }
}

/// Beside such a body, others fall and are pushed as before, under scene gravity and onto a floor.
#[test]
fn a_bodys_own_sampling_leaves_others_alone() {
    let end = |own: Option<Sampling>| {
        let mut world = PhysicsWorld::new();
        let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
        world.insert(floor, ColliderBuilder::cuboid(20.0, 0.5, 20.0));
        let [one, other] = [-5.0, 5.0].map(|x| {
            let body = RigidBodyBuilder::dynamic().translation(Vector::new(x, 0.9, 0.0));
            world.insert(body, ColliderBuilder::cone(0.8, 0.5)).0
        });
        let mut fields = Fields::new(Field::uniform(Vector::X)).expect("valid");
        let set = fields.set_sampling(one, own, &world.bodies);
        set.expect("it is there");
        for _ in 0..60 {
            fields.step(&mut world).expect("a step");
        }
        [one, other].map(|body| {
            let body = &world.bodies[body];
            [body.translation(), body.linvel(), body.angvel()]
        })
    };
    let [own, without] = [end(Some(Sampling::Surface)), end(None)];
    assert_ne!(own[0], without[0], "the body itself is turned");
    for (found, wanted) in own[1].iter().zip(without[1]) {
        let off = to_f64((*found - wanted).length());
        assert_at_most(off, either(1e-4, 1e-12), "the other body");
    }
}

/// A body of which only a corner is in a region is cut there, also beside so many regions that they are searched by a
/// tree of boxes.
#[test]
fn corners_are_cut_by_one_of_many_regions() {
    let at = |x: Real| {
        let zone = |force: Vector, half: Real| {
            let region = Region::cuboid(Vector::splat(half));
            Field::uniform(force).within(region).at(Vector::X * x)
        };
        zone(Vector::Y, 1.0).replace_union(zone(Vector::Z, 0.1))
    };
    let force = |tree: Tree| {
        let place = Vector::new(1.3, 1.2, 1.1);
        let cuboid = ColliderBuilder::cuboid(0.5, 0.5, 0.5);
        let (world, body) = one(place, Rotation::IDENTITY, cuboid);
        let mut fields = Fields::new(tree).expect("a valid tree");
        wrench(&mut fields, &world, body).0
    };
    let alone = force(at(0.0));
    // The share of the volume within the region.
    assert_close(alone.y, 0.2 * 0.3 * 0.4, 1e-8, "a corner");
    let far = (1..200).map(|place| at(10.0 * place as Real));
    let many = force(Tree::fold(
        Operator::SumUnion,
        std::iter::once(at(0.0)).chain(far),
    ));
    assert_eq!(many, alone);
}
