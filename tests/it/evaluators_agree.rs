//! The compiled form of any tree agrees with `Reference`.
//!
//! The expected wrench is computed independently: terms of the outermost sum of union are sampled with the reference at
//! each collider, or at the centre of mass where all their fields are uniform, shared out by mass, and the same for all
//! colliders. Integers must agree exactly, also on boundaries; otherwise the bound is the rounding of the sum of the
//! magnitudes. See `support/trees` for how points are then kept off boundaries and singularities.

use proptest::prelude::*;
use rapier3d_fields::math::{DVec3, Real, to_dvec3, to_f64};
use rapier3d_fields::plan::IndexKind;
use rapier3d_fields::prelude::*;

use crate::support::cases;
use crate::support::trees::{
    self, FormulaPlan, LeafPlan, Numbers, RegionPlan, ScalarPlan, TermPlan,
};
use crate::support::trees::{reference, rounding};
use crate::support::worlds::{self, BodyPlan, World, bodies};

/// Integers up to here add up without rounding in `f32`.
const EXACT: f64 = (1 << 20) as f64;

/// A generous number of roundings in one term: a power law of r² or Lennard-Jones has a few dozen, a sum one for each
/// further term.
const ROUNDINGS: usize = 64;

/// The wrench on a body by the reference, and the sums of the magnitudes of its terms.
struct Expected {
    force: DVec3,
    torque: DVec3,
    scale: f64,
    lever: f64,
}

fn expected(world: &World, terms: &[TermPlan], body: RigidBodyHandle) -> Expected {
    let mut sum = Expected {
        force: DVec3::ZERO,
        torque: DVec3::ZERO,
        scale: 0.0,
        lever: 0.0,
    };
    for term in terms {
        let samples = if term.acts_at_centre() {
            vec![(world.centre(body), DVec3::ZERO)]
        } else {
            world.samples(body)
        };
        let tree = term.term(world);
        for (query, arm) in samples {
            let force = reference(&tree, world, &query).unwrap_or(DVec3::ZERO);
            sum.force += force;
            sum.torque += arm.cross(force);
            let magnitude = term.magnitude(world, &query).max(force.length());
            sum.scale += magnitude;
            sum.lever += magnitude * arm.length();
        }
    }
    sum
}

/// Asserts that fields and reference agree on all bodies.
fn agree(world: &World, terms: &[TermPlan], numbers: Numbers) -> Result<(), TestCaseError> {
    let tree = Tree::fold(
        Operator::SumUnion,
        terms.iter().map(|term| term.term(world)),
    );
    let fields = world.fields(&tree);
    for body in &world.bodies {
        let want = expected(world, terms, *body);
        let found = fields.sample(*body, &world.physics);
        let plan = fields.plan();
        let found = found.map_err(|error| TestCaseError::fail(format!("{error}\n{plan}")))?;
        let found = found.expect("a dynamic body is sampled");
        let exact = numbers == Numbers::Integer && want.scale < EXACT;
        // Below the smallest normal number, nothing has a relative error.
        let (relative, least) = if exact {
            (0.0, 0.0)
        } else {
            let tiny = to_f64(Real::MIN_POSITIVE) * terms.len() as f64;
            (rounding(ROUNDINGS + terms.len()), tiny)
        };
        for (what, found, want, scale) in [
            ("force", found.force, want.force, want.scale),
            ("torque", found.torque, want.torque, want.lever),
        ] {
            let error = (to_dvec3(found) - want).length();
            let bound = relative * scale + least;
            prop_assert!(
                error <= bound,
                "{what} on {body:?}: {found}, reference {want}; error {error:e}, bound {bound:e}\n{plan}"
            );
        }
    }
    Ok(())
}

/// The same for fractions. Rounding of turned frames may put a sample on a border to either side; then all must agree
/// on both sides.
fn agree_off_borders(world: &mut World, terms: &[TermPlan]) -> Result<(), TestCaseError> {
    if agree(world, terms, Numbers::Fractional).is_ok() {
        return Ok(());
    }
    let aside = Vector::new(1.0, 0.75, -0.375) / 1024.0;
    for way in [aside, aside * -2.0] {
        world.move_by(way);
        agree(world, terms, Numbers::Fractional)?;
    }
    Ok(())
}

fn terms(numbers: Numbers, most: usize) -> impl Strategy<Value = Vec<TermPlan>> {
    proptest::collection::vec(trees::term(numbers), 1..=most)
}

proptest! {
    #![proptest_config(cases(4000))]

    /// All operators, regions, anchors, couplings and force modes: bit for bit, boundaries included.
    #[test]
    fn integers_agree_exactly(plans in bodies(4, 1..=1), terms in terms(Numbers::Integer, 4)) {
        agree(&World::new(&plans), &terms, Numbers::Integer)?;
    }

    /// Also all laws and quarter turns, on bodies of several colliders.
    #[test]
    fn fractions_agree_within_rounding(
        plans in bodies(4, 1..=3), terms in terms(Numbers::Fractional, 4),
    ) {
        agree_off_borders(&mut World::new(&plans), &terms)?;
    }
}

proptest! {
    #![proptest_config(cases(1000))]

    /// Regions below height fields, folds and rims included.
    #[test]
    fn regions_below_height_fields_agree(
        plans in bodies(4, 1..=1),
        leaves in proptest::collection::vec(
            (trees::leaf(Numbers::Integer), proptest::array::uniform9(-2..=2)), 2..4,
        ),
        operator in proptest::sample::select(Operator::ALL.to_vec()),
    ) {
        let term = |(mut leaf, heights): (LeafPlan, [i32; 9])| {
            leaf.region = RegionPlan::Ground(heights);
            TermPlan::Leaf(leaf)
        };
        let both = |a: TermPlan, b: TermPlan| TermPlan::Apply(operator, Box::new(a), Box::new(b));
        let term = leaves.into_iter().map(term).reduce(both).expect("leaves");
        agree(&World::new(&plans), &[term], Numbers::Integer)?;
    }
}

/// Radial fields of one law at many places: a batch.
fn batch(formula: &FormulaPlan, region: &RegionPlan, places: &[(u8, [i32; 3])]) -> Vec<TermPlan> {
    let source = |(kind, place): &(u8, [i32; 3])| {
        TermPlan::Leaf(LeafPlan {
            formula: formula.clone(),
            region: region.clone(),
            anchor: (*kind, (place[0] + 40) as usize, *place, 0),
            reading: ForceMode::Force,
            coupling: Coupling::Each,
            scale: None,
            limit: None,
            group: None,
            numbers: Numbers::Fractional,
        })
    };
    places.iter().map(source).collect()
}

fn places(
    kinds: u8,
    size: i32,
    count: std::ops::RangeInclusive<usize>,
) -> impl Strategy<Value = Vec<(u8, [i32; 3])>> {
    let place = (0..=kinds, proptest::array::uniform3(-size..=size));
    proptest::collection::vec(place, count)
}

proptest! {
    #![proptest_config(cases(2000))]

    /// Full and partly filled SIMD lanes, sources on the sampled body among them, with and without a range.
    #[test]
    fn batches_of_any_length_agree(
        plans in bodies(4, 1..=2),
        law in trees::formulas::radial_law(),
        ranged in any::<bool>(),
        places in places(2, 4, 1..=20),
    ) {
        let region = if ranged { RegionPlan::Ball(3) } else { RegionPlan::Everywhere };
        let terms = batch(&law, &region, &places);
        agree(&World::new(&plans), &terms, Numbers::Fractional)?;
    }

    /// Enough sources for a grid, dense and sparse, some very far away.
    #[test]
    fn grids_agree(
        plans in bodies(3, 1..=2),
        law in trees::formulas::radial_law(),
        range in 1..=4,
        near in places(2, 6, 64..=90),
        far in proptest::collection::vec(proptest::array::uniform3(-1_000_000..=1_000_000), 0..3),
    ) {
        let mut places = near;
        places.extend(far.into_iter().map(|place| (0, place)));
        let terms = batch(&law, &RegionPlan::Ball(range), &places);
        agree(&World::new(&plans), &terms, Numbers::Fractional)?;
    }

    /// Enough bounded instances for a bounding volume hierarchy.
    #[test]
    fn hierarchies_agree(
        plans in bodies(3, 1..=2),
        inner in trees::leaf(Numbers::Fractional),
        outer in trees::leaf(Numbers::Fractional),
        radius in 1..=3,
        operator in proptest::sample::select(Operator::ALL.to_vec()),
        anchors in places(2, 4, 16..=24),
    ) {
        let bounded = |mut leaf: LeafPlan| {
            leaf.region = RegionPlan::Combined(1, Box::new(leaf.region), Box::new(RegionPlan::Ball(radius)));
            leaf.anchor.0 = 0;
            Box::new(TermPlan::Leaf(leaf))
        };
        let prototype = TermPlan::Apply(operator, bounded(outer), bounded(inner));
        let anchors = anchors.into_iter().map(|(kind, place)| (kind, (place[0] + 40) as usize, place, 0));
        let terms = [TermPlan::Instances(Box::new(prototype), anchors.collect())];
        agree(&World::new(&plans), &terms, Numbers::Fractional)?;
    }
}

/// A leaf that acts everywhere, so that several overlap.
fn wide() -> impl Strategy<Value = TermPlan> {
    trees::leaf(Numbers::Integer).prop_map(|mut leaf| {
        leaf.region = RegionPlan::Everywhere;
        (leaf.anchor.0, leaf.group, leaf.limit) = (0, None, None);
        TermPlan::Leaf(leaf)
    })
}

proptest! {
    #![proptest_config(cases(1000))]

    /// Layers that overlap, in all orders and modes.
    #[test]
    fn overlapping_layers_agree(
        plans in bodies(2, 1..=1),
        layers in proptest::collection::vec((wide(), -1..=1, any::<bool>(), any::<bool>()), 2..5),
    ) {
        agree(&World::new(&plans), &[TermPlan::Layers(layers)], Numbers::Integer)?;
    }

    /// Scales in the frames of instances within instances, beside others.
    #[test]
    fn scales_of_nested_instances_agree(
        plans in bodies(2, 1..=1),
        leaf in wide(),
        beside in trees::term(Numbers::Integer),
        axes in proptest::array::uniform2(0..3_usize),
        anchors in proptest::collection::vec(trees::anchor_plan(Numbers::Integer), 4),
        operator in proptest::sample::select(Operator::ALL.to_vec()),
    ) {
        let scaled = |term: TermPlan, k: usize| {
            TermPlan::Scaled(Box::new(term), ScalarPlan::Axis(axes[k]), anchors[k])
        };
        let inner = TermPlan::Instances(Box::new(scaled(leaf, 0)), anchors[2..].to_vec());
        let both = TermPlan::Apply(operator, Box::new(beside), Box::new(scaled(inner, 1)));
        let outer = TermPlan::Instances(Box::new(both), anchors[..2].to_vec());
        agree(&World::new(&plans), &[outer], Numbers::Integer)?;
    }
}

fn one_body_at(position: [i32; 3]) -> BodyPlan {
    BodyPlan {
        position,
        linvel: [0; 3],
        angvel: [0; 3],
        parts: vec![([0; 3], 0, 1, None)],
    }
}

/// The tests above rely on these choices.
#[test]
fn plans_use_the_index_they_should() {
    let world = World::new(&[one_body_at([0; 3])]);
    let source = |i: i32| {
        Field::radial(1.0, -1.0)
            .within(Region::ball(1.0))
            .at(Vector::X * i as Real)
    };
    let index = |tree: Tree| {
        let fields = world.fields(&tree);
        fields
            .plan()
            .entries
            .iter()
            .map(|entry| entry.index)
            .collect::<Vec<_>>()
    };
    let fold = |n| Tree::fold(Operator::SumUnion, (0..n).map(source));
    assert_eq!(index(fold(64)), [IndexKind::Grid]);
    assert_eq!(index(fold(20)), [IndexKind::None]);
    let shell = Region::ball(2.0).difference(Region::ball(1.0));
    let shells = (0..16).map(|i| Vector::X * i as Real);
    let shells = Tree::instances(Field::uniform(Vector::X).within(shell), shells);
    assert_eq!(index(shells), [IndexKind::Bvh]);
    // Like composites that are written out one by one, each at its place, become instances of one.
    let pull = Field::radial(-1.0, 0.0).within(Region::ball(2.0));
    let push = Field::radial(2.0, 0.0).within(Region::ball(1.0));
    let pair = |place: Vector, push: Field| {
        let push = push.at(place + Vector::new(0.1, 0.7, -0.3));
        let both = pull.clone().at(place).replace_union(push);
        both.scaled_by(0.5).limited_to(3.0)
    };
    let places = (0..300).map(|i| Vector::X * (i as Real * 0.317));
    let pairs = places.clone().map(|place| pair(place, push.clone()));
    let pairs = Tree::fold(Operator::SumUnion, pairs);
    assert_eq!(index(pairs.clone()), [IndexKind::Bvh]);
    let count = |tree: Tree| -> Vec<usize> {
        let plan = world.fields(&tree).plan();
        plan.entries.iter().map(|entry| entry.count).collect()
    };
    assert_eq!(count(pairs.clone()), [300]);
    let other = pair(Vector::ZERO, push.clone().strength(0.5));
    assert_eq!(count(pairs.sum_union(other)), [300, 1]);
    // So do those that are anchored to bodies.
    let body = world.bodies[0];
    let on_body = |_| pull.clone().at(body).difference(push.clone().at(body));
    let all = Tree::fold(Operator::SumUnion, (0..20).map(on_body));
    assert_eq!(index(all.clone()), [IndexKind::Bvh]);
    assert_eq!(count(all), [20]);
}

/// Lanes that must not act are not finite: a body's own source right at its sample (1/0), and the padding at the
/// origin, where a sample is.
#[test]
fn lanes_that_do_not_act_leave_the_others_finite() {
    for power in -3..=2 {
        for shifted in [false, true] {
            for others in 1..=20 {
                let world = World::new(&[one_body_at([0; 3]), one_body_at([3, 0, 0])]);
                let law = |strength: Real| {
                    let field = Field::radial(strength, power as Real).coupled_to(Coupling::Each);
                    if shifted {
                        field.shifted_to_zero_at(9.5)
                    } else {
                        field
                    }
                };
                let own = law(1.0).at(world.bodies[0]);
                let sources =
                    (0..others).map(|i| law(1.0).at(Vector::new(i as Real - 8.5, 1.5, 0.0)));
                let without = Tree::fold(Operator::SumUnion, sources);
                // Behind and in front, so that it falls into different lanes.
                for tree in [
                    without.clone().sum_union(own.clone()),
                    own.sum_union(without.clone()),
                ] {
                    let wrench = |tree: &Tree| {
                        let fields = world.fields(tree);
                        let found = fields.sample(world.bodies[0], &world.physics);
                        found.map(|wrench| wrench.expect("sampled").force)
                    };
                    // The source acts on the other body only, where it is regular, at a distance of 3.
                    let (with, without) = (wrench(&tree), wrench(&without));
                    let (with, without) = (with.expect("finite"), without.expect("finite"));
                    let error = to_dvec3(with - without).length();
                    let scale = 2e3 * f64::from(others);
                    assert!(
                        error <= rounding(4) * scale,
                        "power {power}, shifted {shifted}, {others} others: {with} against {without}"
                    );
                }
            }
        }
    }
}

/// In a world a million times wider than the range, wherever the edges of the cells fall.
#[test]
fn far_sources_do_not_hide_near_ones_from_the_grid() {
    let world = World::new(&[one_body_at([0; 3])]);
    for far in (0..400).map(|i| 1e6 * (1.0 + i as Real * 0.013)) {
        let near = (0..64).map(|i| Vector::new(0.0, 0.999 * (i as Real / 32.0 - 1.0), 0.0));
        let near = near
            .filter(|place| place.y.abs() > 0.05)
            .collect::<Vec<_>>();
        let places = near.iter().copied().chain([
            Vector::Y * far,
            -Vector::Y * far * 0.7,
            Vector::Z * far,
            Vector::X * far,
        ]);
        // Extra ones right beside the sample, so that there are enough for a grid.
        let places = places.chain(near.iter().map(|place| *place + Vector::X * 0.1));
        let field = |place| {
            Field::radial(1.0, 0.0)
                .within(Region::ball(1.0))
                .coupled_to(Coupling::Each)
                .at(place)
        };
        let terms: Vec<Field> = places.map(field).collect();
        let tree = Tree::fold(Operator::SumUnion, terms);
        let fields = world.fields(&tree);
        let found = fields.sample(world.bodies[0], &world.physics);
        let found = found.expect("finite").expect("sampled").force;
        let (query, _) = world.samples(world.bodies[0]).remove(0);
        let want = reference(&tree, &world, &query).expect("defined");
        let error = (to_dvec3(found) - want).length();
        assert!(
            error <= rounding(ROUNDINGS) * 128.0,
            "far source at {far}: {found}, reference {want}"
        );
    }
}

/// Also once the anchor of the instance is removed.
#[test]
fn fields_with_their_own_anchor_outlive_their_instance() {
    for operator in [Operator::ReplaceUnion, Operator::SumUnion] {
        let mut world = World::new(&[[0, 0, 0], [3, 0, 0], [0, 3, 0]].map(one_body_at));
        let [sample, instance, elsewhere] = [0, 1, 2].map(|i| world.bodies[i]);
        let near = Field::uniform(Vector::X).within(Region::ball(8.0));
        let prototype = Tree::fold(operator, [near, Field::uniform(Vector::Y).at(elsewhere)]);
        let tree = Tree::instances(prototype, [instance]);
        let mut fields = world.fields(&tree);
        for removed in [false, true] {
            if removed {
                // Anchors that a step has found may be removed later.
                world.physics.integration_parameters.dt = 0.0;
                fields.step(&mut world.physics).expect("all are there");
                world.physics.remove_body(instance);
            }
            let found = fields.sample(sample, &world.physics).expect("finite");
            let (query, _) = world.samples(sample).remove(0);
            let want = reference(&tree, &world, &query).expect("defined by the other body");
            let found = to_dvec3(found.expect("sampled").force);
            assert_eq!(found, want, "{operator}, instance removed: {removed}");
        }
    }
}

/// In every kind of batch, the 102 integer points at a distance of 9 from a sample all reach it with a range of 9, and
/// none with less.
#[test]
fn batches_include_the_boundary_of_their_range() {
    let square = |place: &[i32; 3]| place.iter().map(|x| x * x).sum::<i32>();
    let axis = || -9..=9;
    let lattice = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| [x, y, z])));
    let shell: Vec<[i32; 3]> = lattice.filter(|place| square(place) == 81).collect();
    assert_eq!(shell.len(), 102);
    for count in (1..=20).chain([63, 64, 65, 102]) {
        let places = &shell[..count];
        let plans = std::iter::once([0; 3]).chain(places.iter().copied());
        let world = World::new(&plans.map(one_body_at).collect::<Vec<_>>());
        for kind in ["world", "bodies", "colliders"] {
            for (range, holds) in [(9.0, true), (8.999, false)] {
                let source = |(i, place): (usize, &[i32; 3])| {
                    let field = Field::radial((i % 7 + 1) as Real, 1.0)
                        .within(Region::ball(range))
                        .coupled_to(Coupling::Each);
                    match kind {
                        "world" => field.at(worlds::vector(*place)),
                        "bodies" => field.at(world.bodies[i + 1]),
                        _ => field.at(world.colliders[i + 1]),
                    }
                };
                let sources = places.iter().enumerate().map(source);
                let fields = world.fields(&Tree::fold(Operator::SumUnion, sources));
                let found = fields.sample(world.bodies[0], &world.physics);
                let found = found.expect("finite").expect("sampled").force;
                let pushes = places.iter().enumerate();
                let want = pushes.map(|(i, place)| worlds::vector(*place) * -((i % 7 + 1) as Real));
                let want = if holds { want.sum() } else { Vector::ZERO };
                assert_eq!(found, want, "{count} sources on {kind}, range {range}");
            }
        }
    }
}
