//! Compares lanes with the interpreter, bit for bit, on all formulas, regions and operators that have lanes.

use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::compile::Compiled;
use crate::eval::Interpreter;
use crate::field::layer::Layer;
use crate::field::region::Region;
use crate::field::scalar::Scalar;
use crate::field::{
    Anchor, Axis, Field, FieldSet, Frame, Frames, Motion, Operator, Span, Tree, Turbulence,
};
use crate::math::{Pose, Real, RigidBodyHandle, Vector, from_dvec3};
use crate::number::{lanes_of, real};
use crate::sample::{Moment, Samples};

/// Bodies that move and turn.
pub(in crate::eval) struct Moving;

impl Frames for Moving {
    fn frame(&self, anchor: &Anchor) -> Option<Frame> {
        let carried = matches!(anchor, Anchor::Body { .. });
        let still = Frame::at_rest(*anchor.local_pose());
        Some(if carried {
            Frame {
                velocity: Vector::new(0.5, -0.25, 0.125),
                angvel: Vector::new(0.25, 0.5, -0.75),
                body: Some(RigidBodyHandle::from_raw_parts(0, 0)),
                ..still
            }
        } else {
            still
        })
    }
}

pub(in crate::eval) fn regions() -> Vec<Region> {
    let turned = Pose::new(Vector::new(0.5, 0.25, -0.5), Vector::new(0.3, -0.2, 0.9));
    let solids = [
        Region::ball(2.0),
        Region::cuboid(Vector::new(2.0, 1.5, 1.0)),
        Region::cylinder(1.5, 1.25),
        Region::cone(1.5, 2.0),
        Region::capsule(1.0, 1.25),
        Region::half_space(Vector::new(0.48, 0.6, -0.64), 0.5),
        Region::interval(Axis::X, -0.5, Real::INFINITY),
    ];
    let shifted = solids.clone().map(|solid| solid.at(turned));
    let sets = [
        Region::everywhere(),
        Region::ball(2.5).difference(Region::ball(1.0)),
        Region::ball(2.0).intersection(Region::cuboid(Vector::splat(1.25)).complement()),
        Region::cuboid(Vector::splat(1.0)).union(Region::capsule(2.0, 0.5)),
        Region::interval(Axis::Speed, 0.5, 1.5),
        Region::interval(Axis::VelocityY, -0.25, 0.75),
        Region::interval(Axis::Distance, 1.0, 2.5),
        Region::interval(Axis::Mass, 1.0, 2.0),
        Region::interval(Axis::Charge, -1.0, 0.5),
        Region::interval(Axis::Time, 0.25, 0.75),
    ];
    solids.into_iter().chain(shifted).chain(sets).collect()
}

fn formulas() -> Vec<Field> {
    let push = Vector::new(0.5, -1.0, 0.25);
    vec![
        Field::uniform(push),
        Field::radial(2.0, -2.0),
        Field::radial(-1.5, -1.0).softened(0.25),
        Field::radial(3.0, -2.0).limited_to(0.75),
        Field::radial(1.0, -2.0).no_nearer_than(1.5),
        Field::lennard_jones(0.5, 1.0).shifted_to_zero_at(2.5),
        Field::spring(1.5),
        Field::spring_damper(2.0, 0.5, 0.0),
        Field::spring_damper(2.0, 0.5, 1.0),
        Field::spring(1.5).limited_to(0.5),
        Field::drag(0.5, 0.0),
        Field::drag(0.25, 0.5),
        Field::wind(push, 0.5, 0.25),
        Field::wind(push, 0.5, 0.25).speed_cap(0.75),
        Field::magnetic(push),
        Field::vortex(2.0, -1.0).smoothed(0.5),
        Field::spin(1.5),
        Field::updraft(0.5, 1.5),
        Field::updraft(0.5, 1.5).smoothed(0.25),
        Field::vortex(2.0, 0.5),
        Field::vortex(1.0, -1.0).as_wind(0.5, 0.0),
        Field::turbulence(Turbulence::new(3, 1.5, 2.0).turnover(0.5)),
        Field::turbulence(Turbulence::new(4, 1.5, 2.0)).as_wind(0.25, 0.5),
        Field::uniform(push).force_mode(crate::ForceMode::Acceleration),
        Field::uniform(push).force_mode(crate::ForceMode::VelocityChange),
        Field::uniform(push).coupled_to_axis(Axis::Charge),
        Field::uniform(push).coupled_to(crate::Coupling::Each),
        Field::uniform(push).scaled_by(Scalar::distance().smooth(3.0, 0.5)),
        Field::uniform(push).scaled_by(Scalar::depth(Region::ball(2.0)).ramp(0.0, 0.5)),
        Field::uniform(push).scaled_by(Scalar::axis(Axis::Speed).gaussian(0.5).plus(0.25.into())),
        Field::spring(1.0).scaled_by(Scalar::distance().power(-1.0).min(2.0.into())),
        Field::spring(1.0).scaled_by(
            Scalar::axis(Axis::Z)
                .times(Scalar::distance())
                .max(0.5.into()),
        ),
        Field::spring(1.0).scaled_by(Scalar::axis(Axis::X).table([(-1.0, 0.0), (1.0, 2.0)])),
    ]
}

fn field() -> impl Strategy<Value = Field> {
    let place = prop::array::uniform3(-1.0..1.0_f64);
    let turn = prop::array::uniform3(-1.0..1.0_f64);
    let parts = (
        prop::sample::select(formulas()),
        prop::sample::select(regions()),
        (place, turn, any::<bool>()),
        prop::sample::select(vec![1.0, -0.5, 2.5]),
        0..4_u8,
    );
    parts.prop_map(|(field, region, (place, turn, still), strength, kind)| {
        // Fields that are not turned are on the grid of the samples of `borders_are_left_to_the_interpreter`.
        let on_grid = place.map(|x: f64| (2.0 * x).round() / 2.0);
        let [place, turn] = if still {
            [on_grid, [0.0; 3]]
        } else {
            [place, turn]
        };
        let [place, turn] = [place, turn].map(|v| Vector::from_array(v.map(crate::math::from_f64)));
        let local_pose = Pose::new(place, turn);
        let handle = RigidBodyHandle::from_raw_parts(0, 0);
        let anchor = match kind {
            0 => Anchor::Body { handle, local_pose },
            _ => Anchor::World { local_pose },
        };
        let cut_off =
            matches!(field.formula, crate::field::Formula::Radial(law) if law.shifted_at.is_some());
        let field = if cut_off { field } else { field.within(region) };
        field.strength(strength).at(anchor)
    })
}

fn tree() -> impl Strategy<Value = Tree> {
    let operator = prop::sample::select(Operator::ALL.to_vec());
    let leaf = field().prop_map(Tree::from).boxed();
    leaf.prop_recursive(3, 6, 2, move |inner| {
        let pair = (inner.clone(), inner.clone());
        prop_oneof![
            4 => (operator.clone(), pair.clone()).prop_map(|(operator, (a, b))| Tree::combine(a, operator, b)),
            1 => inner.clone().prop_map(|tree| tree.limited_to(1.0)),
            1 => inner.clone().prop_map(|tree| tree.scaled_by(Scalar::axis(Axis::Charge).plus(2.0.into()))),
            1 => pair.prop_map(|(a, b)| Tree::layers([
                Layer::new(a).priority(2), Layer::new(b).priority(1).replacing(),
            ])),
            1 => (inner.clone(), inner).prop_map(|(a, b)| Tree::layers([
                Layer::new(a).priority(2).stopping(), Layer::new(b).priority(1),
            ])),
        ]
    })
}

/// Samples of several bodies, of which the first carries fields.
pub(in crate::eval) fn samples(numbers: &[[f64; 8]]) -> Samples {
    let mut samples = Samples::default();
    samples.clear();
    samples.user.push(Arc::new([]));
    for (number, numbers) in numbers.iter().enumerate() {
        let body = RigidBodyHandle::from_raw_parts(number as u32, 0);
        let [x, y, z, u, v, w, mass, charge] = numbers.map(crate::math::from_f64);
        samples.bodies.push(body);
        samples.sites.push(SamplePoint {
            world_point: Vector::new(x, y, z),
            velocity: Vector::new(u, v, w),
            mass: mass.abs() + 0.5,
            share: 0.5,
            charge,
            fraction: 0.75,
            ..SamplePoint::at_rest(number as u32, crate::sample::owner(Some(body)))
        });
    }
    samples
}

/// Compares all instances of a tree. Returns the number of lanes that were run, and of those in doubt.
fn compare(tree: Tree, samples: &Samples) -> Result<[u32; 2], TestCaseError> {
    let mut set = FieldSet::new();
    set.insert(tree);
    prop_assume!(set.validate_changes().is_ok());
    let compiled = Compiled::new(&set);
    let anchors = 0..compiled.anchors.len();
    let frames: Vec<_> = anchors
        .map(|number| Moving.frame(&compiled.anchors[number]))
        .collect();
    let moment = Moment {
        time: 0.5,
        dt: 0.25,
        span: Span::at(0.5),
    };
    let several: Vec<_> = samples.sites.iter().collect();
    let mut counts = [0, 0];
    let mut interpreter = Interpreter::default();
    for (_, program) in compiled.programs.iter().filter(|(_, p)| p.in_lanes) {
        for instance in 0..program.instances.len() {
            let asked = LaneInput {
                program,
                instance,
                frames: &frames,
                samples,
                moment,
            };
            let found = asked.on_samples(&several);
            prop_assert_eq!(found.defined & found.doubtful, 0);
            counts[0] += several.len() as u32;
            counts[1] += found.doubtful.count_ones();
            for lane in lanes_of(!found.doubtful & ((1 << several.len()) - 1)) {
                let query = samples.query(several[lane], moment);
                let motion = Motion::of(&query);
                let want = interpreter.run(program, instance, &frames, &query, &motion);
                prop_assert_eq!(
                    want.is_some(),
                    found.defined >> lane & 1 == 1,
                    "lane {}",
                    lane
                );
                let Some(want) = want else { continue };
                let (want, found) = (
                    from_dvec3(real(want.force)),
                    from_dvec3(found.exact_force(lane)),
                );
                prop_assert_eq!(want, found, "lane {}", lane);
            }
        }
    }
    Ok(counts)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn lanes_give_the_bits_of_the_interpreter(
        tree in tree(),
        numbers in prop::collection::vec(prop::array::uniform8(-2.0..2.0_f64), 1..=WIDTH),
    ) {
        compare(tree, &samples(&numbers))?;
    }

    /// At points of a coarse grid, many of which are on borders.
    #[test]
    fn borders_are_left_to_the_interpreter(
        tree in tree(),
        numbers in prop::collection::vec(prop::array::uniform8(-4..=4_i32), 1..=WIDTH),
    ) {
        let numbers: Vec<_> = numbers.iter().map(|n| n.map(|n| f64::from(n) * 0.5)).collect();
        compare(tree, &samples(&numbers))?;
    }
}

/// Samples far from borders, with numbers of ordinary size, are evaluated in lanes.
#[test]
fn few_samples_are_in_doubt() {
    let mut counts = [0, 0];
    for field in formulas() {
        for region in regions() {
            let numbers =
                [0.3, 0.7, 1.1, 1.7, 2.3].map(|x| [x, 0.37 * x, -0.21, 0.4, 0.1, x, x, x]);
            let place = Vector::new(0.11, -0.07, 0.05);
            let field = field.clone().within(region).at(place);
            let mask = Field::uniform(Vector::X).within(Region::ball(9.0));
            let found = compare(mask.replace_intersection(field), &samples(&numbers));
            let found = found.expect("lanes are as the interpreter");
            counts = [counts[0] + found[0], counts[1] + found[1]];
        }
    }
    let [lanes, doubts] = counts;
    assert!(lanes > 2000, "{lanes} lanes");
    assert!(doubts * 50 < lanes, "{doubts} doubts in {lanes} lanes");
}
