//! `Auto` where bodies enter stiff fields in every way: it keeps the energy or warns in the same step, is no less
//! accurate than the default scheme, and keeps the momentum where fields react.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rapier3d_fields::math::{DVec3, Real, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::*;

const TOLERANCE: f64 = 1e-3;
const DT: f64 = 1.0 / 60.0;
const TURNS: [f64; 11] = [
    0.01, 0.1, 0.3, 0.5, 1.0, 1.9, 3.0, 10.0, 30.0, 100.0, 1000.0,
];

fn auto() -> Scheme {
    Scheme::auto(from_f64(TOLERANCE))
}

fn world() -> PhysicsWorld {
    let mut world = weightless(from_f64(DT));
    world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
    world
}

/// A ball without collisions that never sleeps.
fn ball(world: &mut PhysicsWorld, mass: Real, place: Vector, linvel: Vector) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(place)
        .linvel(linvel)
        .can_sleep(false);
    let shape = ColliderBuilder::ball(0.01).mass(mass);
    let shape = shape.collision_groups(InteractionGroups::none());
    world.insert(body, shape).0
}

/// The result of a run.
#[derive(Debug, Default)]
struct Run {
    /// The largest ratio of the energy to its exact value, in steps up to the first warning.
    energy: f64,
    /// The largest value of [`Case::off`].
    off: f64,
    warned: usize,
    refused: bool,
}

/// A scene, a change to it before each step, the ratio of its energy to the exact value, and another error.
struct Case<'a> {
    world: PhysicsWorld,
    tree: Tree,
    before: &'a dyn Fn(usize, &mut PhysicsWorld),
    energy: &'a dyn Fn(usize, &PhysicsWorld) -> f64,
    off: &'a dyn Fn(usize, &PhysicsWorld) -> f64,
}

fn run(mut case: Case<'_>, scheme: Scheme, steps: usize) -> Run {
    let mut fields = build(case.tree, scheme);
    fields.settings.on_fault = FaultPolicy::Refuse;
    let mut run = Run::default();
    for step in 0..steps {
        (case.before)(step, &mut case.world);
        if fields.step(&mut case.world).is_err() {
            run.refused = true;
            break;
        }
        run.warned += usize::from(!fields.warnings().is_empty());
        if run.warned == 0 {
            run.energy = run.energy.max((case.energy)(step, &case.world));
        }
        run.off = run.off.max((case.off)(step, &case.world));
    }
    run
}

fn nothing(_: usize, _: &mut PhysicsWorld) {}

fn nowhere(_: usize, _: &PhysicsWorld) -> f64 {
    0.0
}

fn kinetic(world: &PhysicsWorld, body: RigidBodyHandle) -> f64 {
    let body = &world.bodies[body];
    0.5 * to_f64(body.mass()) * to_f64(body.linvel().length_squared())
}

fn place(world: &PhysicsWorld, body: RigidBodyHandle) -> Vector {
    world.bodies[body].translation()
}

/// Energy within the tolerance of 1e-3, and its rounding.
fn assert_kept(run: &Run, name: &str) {
    assert!(run.energy <= 1.003 && !run.refused, "{name}: {run:?}");
}

/// Also beside a negligible drag, with which `Auto` finds the bodies to examine in another way.
#[test]
fn motion_in_wells_is_no_less_accurate_than_by_the_default() {
    for (turn, faint) in TURNS
        .into_iter()
        .flat_map(|turn| [(turn, 0.0), (turn, 1e-7)])
    {
        let (stiffness, omega) = ((turn / DT).powi(2), turn / DT);
        let run = |scheme| {
            let mut world = world();
            let swinging = ball(&mut world, 1.0, Vector::X, Vector::ZERO);
            let case = Case {
                world,
                tree: match faint == 0.0 {
                    true => Field::spring(from_f64(stiffness)).into(),
                    false => Field::spring(from_f64(stiffness)) + Field::drag(from_f64(faint), 0.0),
                },
                before: &nothing,
                energy: &|_, world| {
                    let x = to_f64(place(world, swinging).length());
                    x * x + 2.0 * kinetic(world, swinging) / stiffness
                },
                off: &|step, world| {
                    let x = (omega * DT * (step as f64 + 1.0)).cos();
                    (to_f64(place(world, swinging).x) - x).abs()
                },
            };
            run(case, scheme, 100)
        };
        let (own, other) = (run(auto()), run(Scheme::KickDriftKick));
        println!("{turn}, {faint}: {own:?} {other:?}");
        assert_kept(&own, &format!("dt·ω = {turn}, {faint}"));
        // The finest substeps are not fine enough where rounding shows as a change of the stiffness.
        assert!(own.warned == 0 || turn > 100.0, "dt·ω = {turn}: {own:?}");
        let rounding = 1e4 * to_f64(Real::EPSILON);
        let beaten = own.off <= 1.2 * other.off + rounding || other.refused;
        assert!(beaten, "dt·ω = {turn}: {own:?} beside {other:?}");
    }
}

/// A hit on a body at rest in a well, whose stiffness does not show before, and a hit across the soft axis of a well.
#[test]
fn hits_in_stiff_wells_gain_no_energy() {
    for turn in TURNS {
        let stiffness = (turn / DT).powi(2);
        let mut world = self::world();
        let hit = ball(&mut world, 1.0, Vector::ZERO, Vector::ZERO);
        let case = Case {
            world,
            tree: Field::spring(from_f64(stiffness)).into(),
            before: &|step, world| {
                if step == 5 {
                    world.bodies[hit].set_linvel(Vector::X, true);
                }
            },
            energy: &|_, world| {
                let x = to_f64(place(world, hit).length());
                stiffness * x * x + 2.0 * kinetic(world, hit)
            },
            off: &nowhere,
        };
        assert_kept(&run(case, auto(), 60), &format!("hit, dt·ω = {turn}"));

        let mut world = self::world();
        let hit = ball(&mut world, 1.0, Vector::X, Vector::ZERO);
        let well = Field::closure([], move |sample: &Sample| {
            let p = sample.local_point;
            Vector::new(-p.x, -from_f64(stiffness) * p.y, 0.0)
        });
        let case = Case {
            world,
            tree: well.into(),
            before: &|step, world| {
                if step == 50 {
                    let linvel = world.bodies[hit].linvel();
                    world.bodies[hit].set_linvel(linvel + Vector::Y, true);
                }
            },
            energy: &|step, world| {
                let [x, y, _] = place(world, hit).to_array().map(to_f64);
                let energy = x * x + stiffness * y * y + 2.0 * kinetic(world, hit);
                if step < 50 { energy } else { energy / 2.0 }
            },
            off: &nowhere,
        };
        assert_kept(&run(case, auto(), 200), &format!("across, dt·ω = {turn}"));
    }
}

/// A body at rest beside a narrow well, which the user throws so that it ends its step within the well. (One that ends it
/// exactly at the centre, where no force is, passes unnoticed: 18 m/s here.)
#[test]
fn a_body_that_is_thrown_into_a_well_between_steps_keeps_its_energy() {
    let (deep, width) = (50.0, 0.05);
    for speed in [12.0, 15.0, 17.0, 18.5, 19.0, 22.0] {
        for spin in [Vector::ZERO, Vector::Y] {
            let mut world = self::world();
            let thrown = ball(&mut world, 1.0, Vector::X * 0.3, Vector::ZERO);
            let energy = |world: &PhysicsWorld| {
                let x = to_f64(place(world, thrown).length()) / width;
                let kinetic = kinetic(world, thrown);
                (kinetic - deep * (-0.5 * x * x).exp()) / (0.5 * speed * speed)
            };
            let well = Field::gaussian(from_f64(-deep), from_f64(width));
            let mut fields = build(well, auto());
            for _ in 0..3 {
                fields.step(&mut world).expect("a step");
            }
            world.bodies[thrown].set_linvel(-Vector::X * from_f64(speed), true);
            world.bodies[thrown].set_angvel(spin, true);
            fields.step(&mut world).expect("a step");
            let off = (energy(&world) - 1.0).abs();
            println!("{speed} {spin}: {off:e} {:?}", fields.warnings());
            let told = !fields.warnings().is_empty();
            assert!(off <= TOLERANCE || told, "{speed}, {spin}: {off}");
        }
    }
}

/// A body is free at the start of a step and inside of a stiff wall at its end.
#[test]
fn stiff_walls_give_back_the_energy() {
    for turn in TURNS {
        for speed in [0.5, 3.0, 40.0] {
            let stiffness = (turn / DT).powi(2);
            let mut world = world();
            let start = Vector::X * from_f64(0.303 * speed);
            let thrown = ball(&mut world, 1.0, start, Vector::X * -from_f64(speed));
            let wall = Field::closure([], move |sample: &Sample| {
                Vector::X * (-from_f64(stiffness) * sample.local_point.x.min(0.0))
            });
            let energy = |world: &PhysicsWorld| {
                let depth = to_f64(place(world, thrown).x).min(0.0);
                (0.5 * stiffness * depth * depth + kinetic(world, thrown)) / (0.5 * speed * speed)
            };
            let case = Case {
                world,
                tree: wall.into(),
                before: &nothing,
                energy: &|_, world| energy(world),
                // By the last step the body has left the wall.
                off: &|step, world| {
                    if step < 399 {
                        0.0
                    } else {
                        (energy(world) - 1.0).abs()
                    }
                },
            };
            let run = run(case, auto(), 400);
            let name = format!("dt·ω = {turn}, at {speed}: {run:?}");
            assert_kept(&run, &name);
            let bound = if turn > 100.0 { 30.0 } else { 10.0 };
            assert!(run.off < bound * TOLERANCE, "{name}");
            assert!(run.warned == 0 || turn > 100.0, "{name}");
        }
    }
}

/// Ten balls in a row, linked by springs that react, one of them off the line.
#[test]
fn chains_keep_energy_and_momentum() {
    for ratio in [1.0, 10.0, 1000.0] {
        for turn in [0.1, 0.5, 1.0, 1.7, 2.0, 10.0] {
            let stiffness = (turn / DT).powi(2);
            let mut world = world();
            let beads: Vec<_> = (0..10)
                .map(|number| {
                    let mass = if number % 2 == 0 { 1.0 } else { ratio };
                    let aside = if number == 4 { 0.1 } else { 0.0 };
                    let start = Vector::new(number as Real, aside, 0.0);
                    ball(&mut world, from_f64(mass), start, Vector::ZERO)
                })
                .collect();
            world.step();
            let link = |bead: &RigidBodyHandle| {
                let spring = Field::spring_damper(from_f64(stiffness), 0.0, 1.0);
                spring.within(Region::ball(1.5)).reacting().at(*bead)
            };
            let tree = Tree::fold(Operator::SumUnion, beads.iter().step_by(2).map(link));
            let energy = |world: &PhysicsWorld| {
                let stretch = |pair: &[RigidBodyHandle]| {
                    let way = place(world, pair[0]) - place(world, pair[1]);
                    0.5 * stiffness * (to_f64(way.length()) - 1.0).powi(2)
                };
                let moving = beads.iter().map(|bead| kinetic(world, *bead));
                beads.windows(2).map(stretch).sum::<f64>() + moving.sum::<f64>()
            };
            let first = energy(&world);
            let case = Case {
                tree,
                before: &nothing,
                energy: &|_, world| energy(world) / first,
                off: &|_, world| {
                    let momenta = beads.iter().map(|bead| {
                        let body = &world.bodies[*bead];
                        body.linvel() * body.mass()
                    });
                    let sizes: f64 = momenta.clone().map(|p| to_f64(p.length())).sum();
                    to_f64(momenta.sum::<Vector>().length()) / sizes.max(f64::MIN_POSITIVE)
                },
                world,
            };
            let run = run(case, auto(), 100);
            let name = format!("ratio {ratio}, dt·ω = {turn}: {run:?}");
            let rounding = 1e3 * to_f64(Real::EPSILON);
            // The energy oscillates; at the start all of it is in the springs.
            assert!(run.energy <= 1.01 + rounding && !run.refused, "{name}");
            assert_at_most(run.off, 1e2 * to_f64(Real::EPSILON), name);
        }
    }
}

/// Close passes of an attracting centre: stiffness for a moment neither takes nor gives energy.
#[test]
fn close_passes_keep_the_energy() {
    let passes = [
        (0.5, 0.05),
        (1.0, 0.3),
        (1.0, 0.03),
        (1.0, 0.003),
        (2.0, 0.01),
        (5.0, 0.03),
        (5.0, 0.003),
    ];
    // The error depends on where within a step the body is closest.
    let phases = (0..4).map(|phase| f64::from(phase) * 0.0031);
    for ((speed, aside), phase) in passes
        .into_iter()
        .flat_map(|it| phases.clone().map(move |phase| (it, phase)))
    {
        let pass = |scheme| {
            let mut world = world();
            let start = Vector::new(from_f64(-2.0 - phase), from_f64(aside), 0.0);
            let comet = ball(&mut world, 1.0, start, Vector::X * from_f64(speed));
            let energy = |world: &PhysicsWorld| {
                kinetic(world, comet) - 1.0 / to_f64(place(world, comet).length())
            };
            let first = energy(&world);
            let case = Case {
                world,
                tree: Field::radial(-1.0, -2.0).into(),
                before: &nothing,
                energy: &|_, _| 0.0,
                // At the end only; the bound below is relative to the kinetic energy at the closest point.
                off: &|step, world| {
                    if step < 299 {
                        0.0
                    } else {
                        (energy(world) - first).abs()
                    }
                },
            };
            run(case, scheme, 300)
        };
        // From the angular momentum: r v = aside·speed, and v² ≈ 2/r.
        let closest =
            (aside * speed).powi(2) / (1.0 + (1.0 + (aside * speed.powi(2)).powi(2)).sqrt());
        let (own, other) = (pass(auto()), pass(Scheme::KickDriftKick));
        let name = format!("at {speed}, {aside} aside, {phase} farther: {own:?} beside {other:?}");
        println!("{name}, closest {closest:e}");
        assert!(own.off <= 1.2 * other.off + 1e-3 && !own.refused, "{name}");
        assert!(own.off <= TOLERANCE / closest, "{name}");
    }
}

/// An orbit that is stiff near its pericentre.
#[test]
fn eccentric_orbits_close_without_a_warning() {
    for (e, steps) in [(0.5, 400.0), (0.9, 2000.0), (0.99, 20_000.0)] {
        let orbit = |scheme| {
            let mut world = world();
            let dt = 2.0 * std::f64::consts::PI / steps;
            world.integration_parameters.dt = from_f64(dt);
            let speed = ((1.0 - e) / (1.0 + e) as f64).sqrt();
            let start = Vector::X * from_f64(1.0 + e);
            let planet = ball(&mut world, 1.0, start, Vector::Y * from_f64(speed));
            let case = Case {
                world,
                tree: Field::radial(-1.0, -2.0).into(),
                before: &nothing,
                // After a whole period only: near the pericentre the tolerance is a share of a larger energy.
                energy: &|step, world| {
                    let r = to_f64(place(world, planet).length());
                    let energy = kinetic(world, planet) - 1.0 / r;
                    if step as f64 + 1.0 < steps {
                        0.0
                    } else {
                        2.0 * (energy + 0.5).abs()
                    }
                },
                off: &|step, world| {
                    let off = place(world, planet) - start;
                    if step as f64 + 1.0 < steps {
                        0.0
                    } else {
                        to_f64(off.length())
                    }
                },
            };
            run(case, scheme, steps as usize)
        };
        let (own, other) = (orbit(auto()), orbit(Scheme::KickDriftKick));
        println!("e = {e}: {own:?} beside {other:?}");
        let rounding = steps * 50.0 * to_f64(Real::EPSILON);
        assert!(
            own.off <= 1.2 * other.off + rounding,
            "e = {e}: {own:?} {other:?}"
        );
        assert_eq!(own.warned, 0, "e = {e}");
    }
}

/// A jump causes no endless division of the step. The energy that the ball gains by it, as under kick-drift-kick, is told.
#[test]
fn a_jump_of_the_force_is_not_taken_for_stiffness() {
    let hover = |scheme| {
        let mut world = world();
        world.gravity = Vector::Y * -10.0;
        let hovering = ball(&mut world, 1.0, Vector::Y * 0.1, Vector::ZERO);
        let fan = Field::uniform(Vector::Y * 30.0).within(Region::half_space(Vector::Y, 0.0));
        let case = Case {
            world,
            tree: fan.into(),
            before: &nothing,
            energy: &nowhere,
            off: &|_, world| to_f64(place(world, hovering).length()),
        };
        run(case, scheme, 1000)
    };
    let (own, other) = (hover(auto()), hover(Scheme::KickDriftKick));
    assert!(
        own.off <= 1.2 * other.off && own.off > 0.2 && own.warned > other.warned,
        "{own:?} beside {other:?}"
    );
}

#[test]
fn overlapping_atoms_fly_apart_with_their_energy() {
    for start in [0.5, 0.7, 0.9] {
        let mut world = world();
        let half = Vector::X * from_f64(0.5 * start);
        let pair = [half, -half].map(|place| ball(&mut world, 1.0, place, Vector::ZERO));
        world.step();
        let tree = Field::lennard_jones(1.0, 1.0).reacting().at(pair[0]);
        let energy = |world: &PhysicsWorld| {
            let r = to_f64((place(world, pair[0]) - place(world, pair[1])).length());
            let potential = 4.0 * (r.powi(-12) - r.powi(-6));
            potential + kinetic(world, pair[0]) + kinetic(world, pair[1])
        };
        let first = energy(&world);
        let case = Case {
            tree: tree.into(),
            before: &nothing,
            energy: &|_, world| energy(world) / first,
            off: &|_, world| {
                let [a, b] = pair.map(|body| world.bodies[body].linvel());
                to_f64((a + b).length()) / to_f64(a.length()).max(1e-30)
            },
            world,
        };
        let run = run(case, auto(), 60);
        println!("{start}: {run:?}");
        assert!(run.energy <= 1.01 && run.warned == 0, "{start}: {run:?}");
        assert_at_most(run.off, 1e2 * to_f64(Real::EPSILON), "momentum");
    }
}

/// By any angle per step; the body gets no farther than under the default scheme.
#[test]
fn a_magnetic_field_only_turns_velocities() {
    for turn in [0.01, 0.1, 1.0, 10.0, 100.0] {
        let gyrate = |scheme| {
            let mut world = world();
            let ion = ball(&mut world, 1.0, Vector::ZERO, Vector::X);
            let field = Field::magnetic(Vector::Y * from_f64(turn / DT));
            let case = Case {
                world,
                tree: field.coupled_to(Coupling::Each).into(),
                before: &nothing,
                energy: &|_, world| to_f64(place(world, ion).length()),
                off: &|_, world| (2.0 * kinetic(world, ion) - 1.0).abs(),
            };
            run(case, scheme, 100)
        };
        let (own, other) = (gyrate(auto()), gyrate(Scheme::KickDriftKick));
        let name = format!("ω dt = {turn}: {own:?} beside {other:?}");
        assert_at_most(own.off, (1e2 * to_f64(Real::EPSILON)).max(1e-12), &name);
        assert!(
            own.energy <= 1.01 * other.energy && own.warned == 0,
            "{name}"
        );
    }
}

/// The most evaluations of a field in a step of a well of this frequency, and whether a step warned.
fn work(max_substeps: u32, omega: Real, scheme: Scheme) -> (u64, bool) {
    let count = Arc::new(AtomicU64::new(0));
    let counter = count.clone();
    let well = Field::closure([], move |sample: &Sample<'_>| {
        counter.fetch_add(1, Ordering::Relaxed);
        sample.local_point * -(omega * omega)
    });
    let mut world = world();
    ball(&mut world, 1.0, Vector::X, Vector::Y);
    let mut settings = FieldSettings::default();
    settings.scheme = scheme;
    settings.max_substeps = max_substeps;
    let builder = Fields::builder(well).settings(settings);
    let mut fields = builder.build().expect("a valid tree");
    let (mut most, mut warned) = (0, false);
    for _ in 0..20 {
        let before = count.load(Ordering::Relaxed);
        fields.step(&mut world).expect("a step");
        most = most.max(count.load(Ordering::Relaxed) - before);
        warned |= missed(&fields);
    }
    (most, warned)
}

fn missed(fields: &Fields) -> bool {
    let missed = |it: &StepWarning| matches!(it, StepWarning::ToleranceMissed { .. });
    fields.warnings().iter().any(missed)
}

#[test]
fn the_work_of_a_step_is_limited_by_a_setting() {
    for omega in [1e2, 1e3, 1e4, 1e6] {
        for max_substeps in [1, 4, 64, 4096] {
            let (calls, warned) = work(max_substeps, omega, auto());
            // Some are made for Jacobians, however few the substeps.
            let most = 10 * u64::from(max_substeps) + 64;
            assert!(calls <= most, "{omega} {max_substeps}: {calls}");
            // Steps of second order need 16 dt·ω substeps at this tolerance, and nothing follows an oscillation in fewer
            // than dt·ω/2.
            let turn = to_f64(omega) * DT;
            if f64::from(max_substeps) < 0.5 * turn {
                assert!(warned, "{omega} {max_substeps}");
            } else if f64::from(max_substeps) > 16.0 * turn {
                assert!(!warned, "{omega} {max_substeps}");
            }
        }
    }
}

#[test]
fn limits_of_work_are_checked() {
    let limits = [(0, 1), (1, 1), (4096, 1), (4097, 1), (64, 0)];
    for (number, valid) in limits.into_iter().zip([false, true, true, false, false]) {
        let mut settings = FieldSettings::default();
        (settings.max_substeps, settings.swept_work) = number;
        let built = Fields::builder(Field::uniform(Vector::X))
            .settings(settings)
            .build();
        assert_eq!(built.is_ok(), valid, "{number:?}: {:?}", built.err());
    }
}

/// A charge circles in a magnetic field. Kicks follow the velocity at any rate; the circle is too wide by (h·γ)²/24 in
/// substeps of length h, which `Auto` makes so short that this is within the tolerance.
#[test]
fn circles_in_a_magnetic_field_are_as_wide_as_they_should_be() {
    for turn in [0.2, 0.5, 1.0, 2.0] {
        let gyration = turn / DT;
        let mut world = world();
        let body = ball(&mut world, 2.0, Vector::ZERO, Vector::X);
        let field = Field::magnetic(Vector::Z * from_f64(2.0 * gyration));
        let mut fields = build(field.coupled_to(Coupling::Each), auto());
        let mut worst: f64 = 0.0;
        for step in 1..=60 {
            fields.step(&mut world).expect("a step");
            assert!(!missed(&fields), "{turn}, step {step}");
            let (sin, cos) = (turn * f64::from(step)).sin_cos();
            let place = to_dvec3(world.bodies[body].translation()) * gyration;
            worst = worst.max((place - DVec3::new(sin, cos - 1.0, 0.0)).length());
        }
        // Two points of a circle are no farther apart than twice its radius.
        assert_at_most(worst, 2.0 * TOLERANCE, format!("{turn}"));
    }
}
