//! Forces that jump or bend where bodies pass again and again: steps change the energy there, and warn of it.

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::numbers::Numbers;
use crate::support::weightless;

const STEPS: usize = 600;

/// A well of a force that is not smooth.
#[derive(Clone, Copy, Debug)]
enum Well {
    /// A spring with a rest length: its force turns round at the anchor.
    Rest { stiffness: f64, length: f64 },
    /// A constant force to the plane y = 0 from either side.
    Valley { force: f64 },
    /// A plain spring.
    Spring { stiffness: f64 },
}

impl Well {
    fn tree(self) -> Tree {
        match self {
            Well::Rest { stiffness, length } => {
                Field::spring_damper(from_f64(stiffness), 0.0, from_f64(length)).into()
            }
            Well::Valley { force } => {
                let side = |up: Vector| {
                    Field::uniform(up * from_f64(-force)).within(Region::half_space(-up, 0.0))
                };
                side(Vector::Y).sum_union(side(-Vector::Y))
            }
            Well::Spring { stiffness } => Field::spring(from_f64(stiffness)).into(),
        }
    }

    fn potential(self, point: Vector) -> f64 {
        match self {
            Well::Rest { stiffness, length } => {
                0.5 * stiffness * (to_f64(point.length()) - length).powi(2)
            }
            Well::Valley { force } => force * to_f64(point.y).abs(),
            Well::Spring { stiffness } => 0.5 * stiffness * to_f64(point.length_squared()),
        }
    }
}

/// A small ball of a mass of one in a well.
#[derive(Clone, Debug)]
struct Swing {
    well: Well,
    from: Vector,
    linvel: Vector,
    /// The lengths of the steps, which repeat.
    lengths: Vec<Real>,
}

/// The largest change of the energy, as a share of the first, and the number of steps that warned.
#[derive(Debug, PartialEq)]
struct Outcome {
    off: f64,
    warned: usize,
}

impl Swing {
    fn in_valley(numbers: &mut Numbers) -> Self {
        let [height, speed] = [(0.1, 3.0), (0.01, 3.0)].map(|(from, to)| numbers.within(from, to));
        Swing {
            well: Well::Valley {
                force: numbers.within(0.3, 30.0),
            },
            from: Vector::Y * from_f64(height),
            linvel: Vector::new(1.0, from_f64(speed), 0.0),
            lengths: vec![from_f64(numbers.within(0.005, 0.5))],
        }
    }

    fn past_an_anchor(numbers: &mut Numbers) -> Self {
        let (stiffness, length) = (numbers.within(4.0, 400.0), numbers.within(0.3, 2.0));
        let [aside, far] = [(1e-3, 0.3), (1.2, 3.0)].map(|(from, to)| numbers.within(from, to));
        Swing {
            well: Well::Rest { stiffness, length },
            from: Vector::new(from_f64(far * length), from_f64(aside), 0.0),
            linvel: Vector::ZERO,
            lengths: vec![1.0 / 60.0],
        }
    }

    fn in_steps_of_all_lengths(numbers: &mut Numbers) -> Self {
        let omega = std::f64::consts::TAU * numbers.within(0.5, 3.0);
        let length = |_| from_f64(numbers.within(1e-4, 0.05));
        Swing {
            well: Well::Spring {
                stiffness: omega * omega,
            },
            from: Vector::X,
            linvel: Vector::Y,
            lengths: (0..STEPS).map(length).collect(),
        }
    }

    fn made(&self, scheme: Scheme, audit: bool) -> Outcome {
        self.made_beside(scheme, audit, |_| Tree::empty())
    }

    /// With another field beside the well.
    fn made_beside(
        &self,
        scheme: Scheme,
        audit: bool,
        beside: impl FnOnce(&mut PhysicsWorld) -> Tree,
    ) -> Outcome {
        let mut world = weightless(self.lengths[0]);
        let body = RigidBodyBuilder::dynamic()
            .translation(self.from)
            .linvel(self.linvel)
            .can_sleep(false);
        let (ball, _) = world.insert(body, ColliderBuilder::ball(0.01).mass(1.0));
        let beside = beside(&mut world);
        let fields = Fields::builder(self.well.tree().sum_union(beside))
            .scheme(scheme)
            .audit(audit);
        let mut fields = fields.build().expect("fields");
        let energy = |world: &PhysicsWorld| {
            let body = &world.bodies[ball];
            0.5 * to_f64(body.linvel().length_squared()) + self.well.potential(body.translation())
        };
        let before = energy(&world);
        let mut outcome = Outcome {
            off: 0.0,
            warned: 0,
        };
        for length in self.lengths.iter().cycle().take(STEPS) {
            world.integration_parameters.dt = *length;
            let step = fields.step(&mut world).expect("a step");
            outcome.warned += usize::from(step.warnings > 0);
            outcome.off = outcome.off.max((energy(&world) / before - 1.0).abs());
        }
        outcome
    }
}

/// Makes random swings, and tells in how many of them the energy changed by more than a fifth. In each of those a step
/// warns; and where one warns, the energy has changed by more than a share.
fn count(make: fn(&mut Numbers) -> Swing, scheme: Scheme, [bad, good]: [f64; 2]) -> usize {
    let (mut numbers, mut count) = (Numbers::new(41), 0);
    for number in 0..60 {
        let swing = make(&mut numbers);
        let outcome = swing.made(scheme, false);
        let what = format!("{number}, {scheme:?}: {swing:?}: {outcome:?}");
        println!("{what}");
        assert!(outcome.off < bad || outcome.warned > 0, "{what}");
        assert!(outcome.off > good || outcome.warned == 0, "{what}");
        count += usize::from(outcome.off > bad);
    }
    count
}

/// A change of the energy by a fifth is warned of, and none by less than a fortieth.
#[test]
fn energy_that_is_gained_at_bends_and_borders_is_warned_of() {
    let schemes = [Scheme::KickDriftKick, Scheme::Forward4, Scheme::substeps(4)];
    for scheme in schemes {
        let bad = count(Swing::in_valley, scheme, [0.2, 0.025]);
        assert!(bad > 10, "{scheme:?}: {bad} valleys");
        count(Swing::past_an_anchor, scheme, [0.2, 0.025]);
    }
}

/// Kick-drift-kick keeps another energy in steps of another length; the changes add up.
#[test]
fn energy_that_is_gained_in_steps_of_all_lengths_is_warned_of() {
    let bad = count(
        Swing::in_steps_of_all_lengths,
        Scheme::KickDriftKick,
        [0.2, 0.025],
    );
    assert!(bad > 1, "{bad}");
    for scheme in [Scheme::Forward4, Scheme::substeps(4), Scheme::auto(1e-2)] {
        assert_eq!(count(Swing::in_steps_of_all_lengths, scheme, [0.2, 0.0]), 0);
    }
}

/// `Auto` warns of errors beyond its tolerance, of a body that it need not move within steps.
#[test]
fn auto_warns_of_forces_that_jump_beyond_its_tolerance() {
    for tolerance in [1e-2, 1e-3] {
        let scheme = Scheme::auto(from_f64(tolerance));
        let bad = count(
            Swing::in_valley,
            scheme,
            [4.0 * tolerance, 0.25 * tolerance],
        );
        assert!(bad > 20, "{tolerance}: {bad}");
    }
}

/// Visits at centres of mass and steps with samples warn alike. (With an audit, steps have samples.)
#[test]
fn steps_at_centres_of_mass_warn_as_others_do() {
    let mut numbers = Numbers::new(43);
    let mut warned = 0;
    for number in 0..40 {
        let swing = Swing::in_valley(&mut numbers);
        for scheme in [Scheme::KickDriftKick, Scheme::Kick] {
            let [visited, sampled] = [false, true].map(|audit| swing.made(scheme, audit));
            let what = format!("{number}, {scheme:?}: {swing:?}");
            assert_eq!(visited, sampled, "{what}");
            warned += visited.warned;
        }
    }
    assert!(warned > 100, "{warned}");
}

/// Fields that move elsewhere do not keep steps at centres of mass from warning.
#[test]
fn fields_that_move_elsewhere_change_no_warning() {
    let mut numbers = Numbers::new(47);
    let mut warned = 0;
    for number in 0..20 {
        let swing = Swing::in_valley(&mut numbers);
        let alone = swing.made(Scheme::KickDriftKick, false);
        let beside = swing.made_beside(Scheme::KickDriftKick, false, |world| {
            let train = RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::X * 3.0);
            let train = world.insert_body(train.translation(Vector::Z * 1e3));
            Field::uniform(Vector::X)
                .within(Region::ball(1.0))
                .at(train)
                .into()
        });
        assert_eq!(alone, beside, "{number}: {swing:?}");
        warned += alone.warned;
    }
    assert!(warned > 50, "{warned}");
}

/// A body that passes a few borders is not warned of: its speed is off by about half a step's change each time.
#[test]
fn a_border_that_is_passed_once_is_no_cause_for_a_warning() {
    for scheme in [
        Scheme::KickDriftKick,
        Scheme::Kick,
        Scheme::Forward4,
        Scheme::substeps(4),
    ] {
        for speed in [0.1, 0.3, 1.0, 3.0] {
            let mut world = weightless(1.0 / 60.0);
            let body = RigidBodyBuilder::dynamic().linvel(Vector::X * speed);
            let body = body.can_sleep(false);
            world.insert(body, ColliderBuilder::ball(0.01).mass(1.0));
            let zone = Region::cuboid(Vector::splat(2.0));
            let wind = Field::uniform(Vector::X * 10.0).within(zone);
            let tree = wind.at(Pose::translation(3.1 + speed * 0.4, 0.0, 0.0));
            let mut fields = crate::support::build(tree, scheme);
            for _ in 0..2400 {
                let step = fields.step(&mut world).expect("a step");
                assert_eq!(
                    step.warnings,
                    0,
                    "{scheme:?}, {speed}: {:?}",
                    fields.warnings()
                );
            }
            assert!(
                world
                    .bodies
                    .iter()
                    .all(|(_, body)| body.translation().x > 6.0)
            );
        }
    }
}
