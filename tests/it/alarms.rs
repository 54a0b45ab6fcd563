//! False alarms: in random game-like worlds, a scheme warns only where the error of its step is large.

use rapier3d_fields::math::{Real, from_dvec3, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::numbers::Numbers;
use crate::support::{build, cases};

const STEPS: usize = 200;
/// Number of parts into which the reference divides a step.
const PARTS: usize = 64;

/// Bodies of mixed shapes that fall on a floor or float, some of them in a chain, and some fields.
fn world(seed: u64) -> (PhysicsWorld, Tree) {
    let mut numbers = Numbers::new(seed);
    let mut world = PhysicsWorld::new();
    let dt = numbers.one_of(&[1.0 / 50.0, 1.0 / 60.0, 1.0 / 60.0, 1.0 / 120.0]);
    world.integration_parameters.dt = from_f64(dt);
    if numbers.one_of(&[false, true, true, true]) {
        let floor = RigidBodyBuilder::fixed().translation(-Vector::Y * 0.5);
        world.insert(floor, ColliderBuilder::cuboid(50.0, 0.5, 50.0));
    } else {
        world.gravity = Vector::ZERO;
    }
    let chained = numbers.one_of(&[0, 0, 5]);
    let mut last = None;
    for number in 0..2 + numbers.below(14) {
        let aside = if number < chained { 0.0 } else { 4.0 };
        let height = 1.0 + 1.2 * number as f64;
        let place = Vector::new(
            from_f64(aside * numbers.next()),
            from_f64(height),
            from_f64(aside * numbers.next()),
        );
        let body = RigidBodyBuilder::dynamic()
            .translation(place)
            .linvel(from_dvec3(numbers.vector() * 3.0))
            .angvel(from_dvec3(numbers.vector() * 2.0))
            .linear_damping(numbers.one_of(&[0.0, 0.0, 0.0, 0.3]));
        let (body, _) = world.insert(body, part(&mut numbers));
        if let Some(last) = last.filter(|_| number < chained) {
            let above = Vector::Y * 0.6;
            let joint = SphericalJointBuilder::new().local_anchor1(above);
            let joint = joint.local_anchor2(-above).contacts_enabled(false);
            world.insert_impulse_joint(last, body, joint);
        }
        last = Some(body);
    }
    let fields: Vec<Tree> = (0..1 + numbers.below(4))
        .map(|_| field(&mut numbers, dt))
        .collect();
    let operator = numbers.one_of(&[
        Operator::SumUnion,
        Operator::SumUnion,
        Operator::ReplaceUnion,
        Operator::Strongest,
    ]);
    (world, Tree::fold(operator, fields))
}

fn part(numbers: &mut Numbers) -> ColliderBuilder {
    let size = from_f64(numbers.within(0.2, 0.5));
    let part = match numbers.below(5) {
        0 => ColliderBuilder::ball(size),
        1 => ColliderBuilder::cuboid(size, size * 0.6, size * 0.8),
        2 => ColliderBuilder::capsule_y(size * 0.6, size * 0.5),
        3 => ColliderBuilder::cylinder(size * 0.7, size * 0.5),
        _ => ColliderBuilder::cone(size * 0.7, size * 0.5),
    };
    part.density(from_f64(numbers.within(0.5, 3.0)))
}

fn field(numbers: &mut Numbers, dt: f64) -> Tree {
    let size = from_f64(numbers.within(1.0, 4.0));
    let region = match numbers.below(3) {
        0 => Region::ball(size),
        1 => Region::cuboid(Vector::splat(size)),
        _ => Region::everywhere(),
    };
    let near = Region::ball(4.0);
    let place = from_dvec3(numbers.vector() * 3.0) + Vector::Y * 2.0;
    let flow = from_dvec3(numbers.vector() * 10.0);
    let strength: Real = from_f64(8.0 * numbers.next());
    let slows = from_f64(numbers.within(0.02, 0.2));
    let per_mass = |field: Field| field.force_mode(ForceMode::Acceleration);
    let field = match numbers.below(12) {
        0 => Field::gravity_zone(flow, region),
        1 => Field::wind_zone(flow, slows, 0.1 * slows, region),
        2 => Field::drag(slows, 0.1 * slows).within(region),
        3 => per_mass(Field::vortex(0.5 * strength, 1.0)).within(region),
        4 => per_mass(Field::radial(strength, 0.0)).within(near),
        5 => per_mass(Field::gaussian(0.5 * strength, size)),
        // dt·ω of 0.05.
        6 => per_mass(Field::spring(from_f64((0.05 / dt).powi(2)))).within(region),
        7 => Field::magnetic(flow * 0.03),
        8 => {
            let pool = Region::cuboid(Vector::new(8.0, 1.5, 8.0));
            Field::buoyancy(from_f64(numbers.within(0.5, 2.0)), 9.81).within(pool)
        }
        9 => Field::conveyor(flow * 0.3, 10.0 * slows, region),
        10 => per_mass(Field::updraft(strength.abs(), 0.2 * strength.abs())).within(near),
        _ => Field::uniform(flow * 0.05).within(region),
    };
    field.at(place).into()
}

/// A step in which a scheme warns of a body.
#[derive(Clone, Copy, Debug)]
struct Alarm {
    seed: u64,
    scheme: Scheme,
    step: usize,
    body: RigidBodyHandle,
}

impl Alarm {
    /// The first alarm in a world.
    fn first(seed: u64, scheme: Scheme) -> Option<Alarm> {
        let (mut world, tree) = world(seed);
        let mut fields = build(tree, scheme);
        (0..STEPS).find_map(|step| {
            fields.step(&mut world).expect("a step");
            let told = fields.warnings().iter().find_map(|warning| match warning {
                StepWarning::Stiff { body, .. } | StepWarning::ToleranceMissed { body, .. } => {
                    Some(*body)
                }
                _ => None,
            });
            told.map(|body| Alarm {
                seed,
                scheme,
                step,
                body,
            })
        })
    }

    /// The relative error of the body's kinetic energy after that step, against the same step in [`PARTS`] parts.
    fn error(&self) -> f64 {
        let [[before, whole], [_, divided]] = [1, PARTS].map(|parts| self.energies(parts));
        (whole - divided).abs() / before.max(divided)
    }

    /// The kinetic energy of the body before the step, and after it if made in `parts` parts.
    fn energies(&self, parts: usize) -> [f64; 2] {
        let (mut world, tree) = world(self.seed);
        let mut fields = build(tree, self.scheme);
        for _ in 0..self.step {
            fields.step(&mut world).expect("a step");
        }
        let before = world.bodies[self.body].kinetic_energy();
        if parts > 1 {
            fields.settings.scheme = Scheme::KickDriftKick;
        }
        world.integration_parameters.dt /= parts as Real;
        for _ in 0..parts {
            fields.step(&mut world).expect("a step");
        }
        [before, world.bodies[self.body].kinetic_energy()].map(to_f64)
    }
}

/// A scheme warns by an upper bound of its error, so the true error may be below the tolerance, at most by this factor.
const BOUND: f64 = 5.0;

/// The tolerance of schemes that have none: their alarms are right from an error of one percent on.
const NO_TOLERANCE: f64 = 0.01 * BOUND;

#[test]
fn schemes_warn_only_where_the_error_of_a_step_is_large() {
    let worlds = u64::from(cases(100).cases);
    let mut rightly = 0;
    for (scheme, tolerance) in [
        (Scheme::KickDriftKick, NO_TOLERANCE),
        (Scheme::Kick, NO_TOLERANCE),
        (Scheme::auto(0.01), 0.01),
    ] {
        let alarms = (0..worlds).filter_map(|seed| Alarm::first(seed, scheme));
        let errors = alarms.map(|alarm| (alarm.error(), alarm));
        let (right, wrong): (Vec<_>, Vec<_>) =
            errors.partition(|(error, _)| *error > tolerance / BOUND);
        rightly += right.len();
        assert!(100 * wrong.len() as u64 <= worlds, "{wrong:?}");
    }
    assert!(
        rightly > 3,
        "only {rightly} alarms: these worlds show nothing"
    );
}
