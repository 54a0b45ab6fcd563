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
    /// Its fields, each put in its place.
    fn tree(self, place: impl Fn(Field) -> Field) -> Tree {
        match self {
            Well::Rest { stiffness, length } => {
                let [stiffness, length] = [stiffness, length].map(from_f64);
                place(Field::spring_damper(stiffness, 0.0, length)).into()
            }
            Well::Valley { force } => {
                let side = |up: Vector| {
                    let pull = Field::uniform(up * from_f64(-force));
                    place(pull.within(Region::half_space(-up, 0.0)))
                };
                side(Vector::Y).sum_union(side(-Vector::Y))
            }
            Well::Spring { stiffness } => place(Field::spring(from_f64(stiffness))).into(),
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

    fn made(&self, scheme: Scheme) -> Outcome {
        self.made_as(Manner {
            scheme,
            audit: false,
            velocity: Vector::ZERO,
            train: false,
        })
    }

    fn made_as(&self, manner: Manner) -> Outcome {
        let mut world = weightless(self.lengths[0]);
        let body = RigidBodyBuilder::dynamic()
            .translation(self.from)
            .linvel(self.linvel + manner.velocity)
            .can_sleep(false);
        let (ball, _) = world.insert(body, ColliderBuilder::ball(0.01).mass(1.0));
        let mut led = |velocity: Vector, place: Vector| {
            let body = RigidBodyBuilder::kinematic_velocity_based().linvel(velocity);
            world.insert_body(body.translation(place))
        };
        let lift = (manner.velocity != Vector::ZERO).then(|| led(manner.velocity, Vector::ZERO));
        let mut tree = self.well.tree(|field| match lift {
            Some(lift) => field.at(lift),
            None => field,
        });
        if manner.train {
            let train = led(Vector::X * 3.0, Vector::Z * 1e3);
            let field = Field::uniform(Vector::X).within(Region::ball(1.0));
            tree = tree.sum_union(field.at(train));
        }
        let fields = Fields::builder(tree).scheme(manner.scheme);
        let mut fields = fields.audit(manner.audit).build().expect("fields");
        let energy = |world: &PhysicsWorld| {
            let body = &world.bodies[ball];
            let frame = lift.map_or(Vector::ZERO, |lift| world.bodies[lift].translation());
            let speed2 = (body.linvel() - manner.velocity).length_squared();
            0.5 * to_f64(speed2) + self.well.potential(body.translation() - frame)
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

/// The manner in which a swing is made.
#[derive(Clone, Copy, Debug)]
struct Manner {
    scheme: Scheme,
    /// With an audit, steps have samples; else bodies are visited at their centres of mass.
    audit: bool,
    /// The velocity of the body that carries the well, and of the ball with it; zero for a well in the world.
    velocity: Vector,
    /// True for a field that moves far away.
    train: bool,
}

/// Makes random swings, and tells in how many of them the energy changed by more than a fifth. In each of those a step
/// warns; and where one warns, the energy has changed by more than a share.
fn count(make: fn(&mut Numbers) -> Swing, scheme: Scheme, [bad, good]: [f64; 2]) -> usize {
    let (mut numbers, mut count) = (Numbers::new(41), 0);
    for number in 0..60 {
        let swing = make(&mut numbers);
        let outcome = swing.made(scheme);
        let what = format!("{number}, {scheme:?}: {swing:?}: {outcome:?}");
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

/// `Auto` warns of errors beyond its tolerance, of a body that it need not move within steps. The tolerance is a share of
/// the kinetic energy, which here is half to all of the first energy, and its own smooth steps may use it up, too.
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

/// Steps at centres of mass warn as those with samples do, also if a field moves elsewhere.
#[test]
fn steps_at_centres_of_mass_warn_as_others_do() {
    let mut numbers = Numbers::new(43);
    let mut warned = 0;
    for number in 0..40 {
        let swing = Swing::in_valley(&mut numbers);
        for scheme in [Scheme::KickDriftKick, Scheme::Kick] {
            let visited = swing.made(scheme);
            for (audit, train) in [(true, false), (false, true)] {
                let other = Manner {
                    scheme,
                    audit,
                    velocity: Vector::ZERO,
                    train,
                };
                let what = format!("{number}, {other:?}: {swing:?}");
                assert_eq!(visited, swing.made_as(other), "{what}");
            }
            warned += visited.warned;
        }
    }
    assert!(warned > 100, "{warned}");
}

/// A valley on a train or a lift. On a lift the border at which the force on the ball jumps moves within a step. Errors
/// are shares of the kinetic energy in the world, which contains that of the ride, so more of them stay below the limit.
#[test]
fn valleys_that_move_are_warned_of() {
    let mut numbers = Numbers::new(53);
    let (mut bad, mut warned) = (0, 0);
    for number in 0..40 {
        let swing = Swing::in_valley(&mut numbers);
        for velocity in [Vector::Z, Vector::Y] {
            for scheme in [Scheme::KickDriftKick, Scheme::Forward4] {
                let manner = Manner {
                    scheme,
                    audit: false,
                    velocity: velocity * 0.7,
                    train: false,
                };
                let moving = swing.made_as(manner);
                let what = format!("{number}, {manner:?}: {swing:?}: {moving:?}");
                assert!(moving.off < 0.25 || moving.warned > 0, "{what}");
                bad += usize::from(moving.off > 0.25);
                warned += moving.warned;
            }
        }
    }
    assert!(bad > 20 && warned > 100, "{bad}, {warned}");
}

/// A body that was fast long ago is warned of as if it had been slow all the time.
#[test]
fn energy_of_long_ago_does_not_hide_errors() {
    let valley = Well::Valley { force: 30.0 };
    let mut world = weightless(1.0 / 60.0);
    let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.1);
    let (ball, _) = world.insert(body.can_sleep(false), ColliderBuilder::ball(0.01).mass(1.0));
    let mut fields = crate::support::build(valley.tree(|field| field), Scheme::KickDriftKick);
    let mut warned = 0;
    // The first fast passes begin an account; then the ball rests beside the border for a while.
    for step in 0..1200 {
        let body = &mut world.bodies[ball];
        if step < 3 {
            body.set_linvel(Vector::Y * if step % 2 == 0 { -30.0 } else { 30.0 }, true);
        } else if step < 300 {
            body.set_translation(Vector::Y * 0.1, true);
            body.set_linvel(Vector::ZERO, true);
        }
        let step = fields.step(&mut world).expect("a step");
        warned += usize::from(step.warnings > 0);
    }
    assert!(warned > 5, "{warned}");
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

/// In an ordinary world bodies pass borders of zones, bounce, come to rest on each other and fall asleep.
#[test]
fn heaps_in_zones_give_no_warning() {
    let schemes = [
        Scheme::KickDriftKick,
        Scheme::Kick,
        Scheme::Forward4,
        Scheme::substeps(4),
    ];
    let mut numbers = Numbers::new(59);
    let mut told = Vec::new();
    for scheme in schemes {
        for number in 0..4 {
            let mut world = PhysicsWorld::default();
            let floor = ColliderBuilder::cuboid(30.0, 0.5, 30.0);
            world.insert_collider(floor.translation(Vector::Y * -0.5), None);
            for place in 0..40 {
                let [x, z] = [numbers.next(), numbers.next()].map(|it| from_f64(it * 3.0));
                let at = Vector::new(x, 1.0 + 0.8 * place as Real, z);
                let body = RigidBodyBuilder::dynamic().translation(at);
                let shape = match place % 3 {
                    0 => ColliderBuilder::ball(0.3),
                    1 => ColliderBuilder::cuboid(0.3, 0.2, 0.25),
                    _ => ColliderBuilder::capsule_y(0.2, 0.2),
                };
                world.insert(body, shape.restitution(0.3));
            }
            let mut zone = |push: Vector| {
                let [x, z] = [numbers.next(), numbers.next()].map(|it| from_f64(it * 2.0));
                let size = Vector::new(1.5, 3.0, 1.5);
                let field = Field::uniform(push).within(Region::cuboid(size));
                field.at(Pose::translation(x, 3.0, z))
            };
            let tree = zone(Vector::X * 4.0)
                .sum_union(zone(Vector::Y * 6.0))
                .sum_union(zone(Vector::Z * -5.0));
            let mut fields = crate::support::build(tree, scheme);
            for _ in 0..480 {
                fields.step(&mut world).expect("a step");
                let abrupt = |it: &&StepWarning| matches!(it, StepWarning::AbruptForce { .. });
                let warnings = fields.warnings().iter().filter(abrupt);
                told.extend(warnings.map(|it| format!("{scheme:?} {number}: {it}")));
            }
        }
    }
    assert!(told.is_empty(), "{}: {told:#?}", told.len());
}
