//! Warnings come before energy is gained: overlaps, close passes, resonances, pairs, springs of contacts.

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::lab::stability::SCHEMES;
use crate::support::*;

/// The step in which energy has grown by a tenth of `scale`, and the first one with a warning.
fn first_steps(
    (mut world, tree, scheme): (PhysicsWorld, Tree, Scheme),
    energy: impl Fn(&PhysicsWorld) -> f64,
    (scale, steps): (f64, usize),
) -> [Option<usize>; 2] {
    world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
    let mut fields = build(tree, scheme);
    let first = energy(&world);
    let [mut gained, mut told] = [None; 2];
    for step in 0..steps {
        if fields.step(&mut world).is_err() {
            break;
        }
        if !fields.warnings().is_empty() {
            told.get_or_insert(step);
        }
        if (energy(&world) - first) > 0.1 * scale {
            gained.get_or_insert(step);
            break;
        }
    }
    [gained, told]
}

fn assert_told_before([gained, told]: [Option<usize>; 2], what: &str) {
    assert!(gained.is_some(), "{what}: nothing is gained");
    let told = told.unwrap_or(usize::MAX);
    assert!(
        Some(told) <= gained,
        "{what}: gained {gained:?}, told {told}"
    );
}

fn kinetic(world: &PhysicsWorld) -> f64 {
    let bodies = world.bodies.iter();
    bodies.map(|(_, body)| to_f64(body.kinetic_energy())).sum()
}

/// Switches all collisions off.
fn pass_through(world: &mut PhysicsWorld) {
    for (_, collider) in world.colliders.iter_mut() {
        collider.set_collision_groups(InteractionGroups::none());
    }
}

/// Two atoms: one of this mass with a Lennard-Jones field, the other of mass 1.
fn overlapping(mass: Real, distance: Real) -> (PhysicsWorld, Tree, [RigidBodyHandle; 2]) {
    let mut world = weightless(0.005);
    let one = insert_ball(&mut world, mass, Vector::ZERO, Vector::ZERO);
    let other = insert_ball(&mut world, 1.0, Vector::X * distance, Vector::ZERO);
    pass_through(&mut world);
    let tree = Field::lennard_jones(1.0, 1.0).reacting().at(one).into();
    (world, tree, [one, other])
}

#[test]
fn an_overlap_is_warned_of_before_it_explodes() {
    for scheme in SCHEMES.into_iter().filter(|it| !chooses(*it)) {
        for mass in [0.01, 1.0, 100.0] {
            let (world, tree, [one, other]) = overlapping(mass, 0.5);
            let energy = move |world: &PhysicsWorld| {
                let way = world.bodies[one].translation() - world.bodies[other].translation();
                let s = to_f64(way.length()).powi(-6);
                4.0 * (s * s - s) + kinetic(world)
            };
            let scale = energy(&world);
            let steps = first_steps((world, tree, scheme), energy, (scale, 50));
            if steps[0].is_some() {
                assert_told_before(steps, &format!("{scheme:?}, {mass}"));
            }
        }
    }
    // Atoms that touch gently get no warning.
    let (mut world, tree, _) = overlapping(1.0, 1.1);
    let mut fields = build(tree, Scheme::KickDriftKick);
    for _ in 0..100 {
        let outcome = fields.step(&mut world).expect("a finite step");
        assert_eq!(outcome.warnings, 0, "{:?}", fields.warnings());
    }
}

fn chooses(scheme: Scheme) -> bool {
    matches!(
        scheme,
        Scheme::Auto { .. } | Scheme::Substep(Substeps::PerBody { .. })
    )
}

/// The implicit scheme damps the orbit of a planet until it falls into its sun and is thrown out.
#[test]
fn the_implicit_scheme_warns_before_it_throws_a_planet_out() {
    for count in [100, 400] {
        let dt = from_f64(std::f64::consts::TAU / f64::from(count));
        let mut world = weightless(dt);
        let speed = from_f64((0.5_f64 / 1.5).sqrt());
        let planet = insert_ball(&mut world, 1.0, Vector::X * 1.5, Vector::Y * speed);
        let energy = move |world: &PhysicsWorld| {
            let place = world.bodies[planet].translation();
            kinetic(world) - to_f64(place.length()).recip()
        };
        let tree = Field::radial(-1.0, -2.0).into();
        let run = (world, tree, Scheme::LinearlyImplicit);
        let steps = first_steps(run, energy, (0.5, 4000));
        assert_told_before(steps, &format!("{count} steps an orbit"));
    }
}

/// Nearly one or two whole turns between two kicks.
#[test]
fn gyration_that_resonates_with_a_well_is_warned_of() {
    for scheme in [Scheme::KickDriftKick, Scheme::Kick] {
        for turn in [6.2, 6.25, 12.5] {
            let mut world = weightless(0.01);
            let ball = insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
            let field = Field::magnetic(Vector::Y * (turn / 0.01)).coupled_to(Coupling::Each);
            let tree = Field::spring(50.0 * 50.0).sum_union(field);
            let energy = move |world: &PhysicsWorld| {
                let place = world.bodies[ball].translation();
                kinetic(world) + 0.5 * 2500.0 * to_f64(place.length_squared())
            };
            // `Kick` shows velocities half a step before positions.
            let steps = first_steps((world, tree, scheme), energy, (1e5, 600));
            assert_told_before(steps, &format!("{scheme:?}, {turn} radians a step"));
        }
    }
}

/// A spring with damping, or between two bodies, just below and just above the reported largest stable step.
#[test]
fn motion_is_stable_up_to_the_largest_stable_step_only() {
    for (damping, coupled) in [(0.0, false), (20.0, false), (300.0, false), (0.0, true)] {
        let scene = |dt: Real| {
            let mut world = weightless(dt);
            let [one, other] = [0.0, 1.1].map(|x| {
                let ball = insert_ball(&mut world, 1.0, Vector::X * x, Vector::ZERO);
                world.bodies[ball].set_linear_damping(damping);
                ball
            });
            pass_through(&mut world);
            world.step();
            let spring = match coupled {
                true => Field::spring_damper(2500.0, 0.0, 1.0).reacting().at(one),
                false => Field::spring(2500.0),
            };
            (world, Tree::from(spring), other)
        };
        let (world, tree, ball) = scene(0.001);
        let fields = build(tree, Scheme::KickDriftKick);
        let report = fields.stiffness(ball, 0.001, &world);
        let largest = report
            .expect("finite")
            .expect("a dynamic body")
            .largest_stable_dt;
        for (share, stable) in [(0.97, true), (1.03, false)] {
            let (mut world, tree, ball) = scene(largest * share);
            let mut fields = build(tree, Scheme::KickDriftKick);
            world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
            let mut farthest: Real = 0.0;
            for _ in 0..500 {
                if fields.step(&mut world).is_err() {
                    farthest = Real::MAX;
                    break;
                }
                farthest = farthest.max(world.bodies[ball].translation().length());
            }
            let what = format!("damping {damping}, coupled {coupled}, {share} of {largest}");
            assert_eq!(farthest < 20.0, stable, "{what}: {farthest}");
        }
    }
}

/// A ball dropped on a floor that pushes back by a spring.
fn dropped(stiffness: Real, damping: Real) -> (PhysicsWorld, Tree, RigidBodyHandle) {
    let mut world = PhysicsWorld::new();
    let body = RigidBodyBuilder::dynamic().translation(Vector::Y);
    let ball = ColliderBuilder::ball(0.5).mass(1.0);
    let (body, ball) = world.insert(body.can_sleep(false), ball);
    world.insert_collider(
        ColliderBuilder::cuboid(5.0, 0.5, 5.0).translation(-Vector::Y * 0.5),
        None,
    );
    let law = ContactLaw::Penalty { stiffness, damping };
    (world, Field::contact(law).at(ball).into(), body)
}

#[test]
fn damping_of_contacts_is_stable_at_any_strength() {
    // c·dt from 0.5 to 1e6 for a mass of 1.
    for damping in [30.0, 120.0, 600.0, 6e4, 6e7] {
        let stiffness = 400.0;
        let (mut world, tree, ball) = dropped(stiffness, damping);
        let mut fields = build(tree, Scheme::KickDriftKick);
        let mut highest = Real::NEG_INFINITY;
        let mut touched = false;
        for _ in 0..600 {
            let outcome = fields.step(&mut world).expect("a finite step");
            assert_eq!(outcome.warnings, 0, "{:?}", fields.warnings());
            touched |= outcome.contacts > 0;
            if touched {
                highest = highest.max(world.bodies[ball].translation().y);
            }
        }
        let depth = 0.5 - world.bodies[ball].translation().y;
        // The ball rests where the spring holds it, or creeps there from the depth that it reached in a step.
        let rest = 9.81 / stiffness;
        let deepest = rest.max(3.2 / 60.0) * 1.01;
        assert!(highest <= 0.5, "{damping}: it bounced to {highest}");
        assert!(depth > 0.0 && depth < deepest, "{damping}: {depth} deep");
        if damping < 200.0 {
            assert_close(to_f64(depth / rest), 1.0, 1e-3, "where it rests");
        }
    }
}

#[test]
fn stiff_springs_of_contacts_are_warned_of() {
    let (mut world, tree, ball) = dropped(3600.0 * 2.25, 0.0);
    let mut fields = build(tree, Scheme::KickDriftKick);
    let mut told = false;
    for _ in 0..60 {
        let outcome = fields.step(&mut world).expect("a finite step");
        for warning in fields.warnings() {
            let StepWarning::Stiff {
                body,
                dt_omega,
                largest_stable_dt,
            } = warning
            else {
                panic!("{warning}");
            };
            assert!(outcome.contacts > 0);
            assert_eq!(*body, ball);
            assert_close(to_f64(*dt_omega), 1.5, 1e-4, "dt·ω");
            assert_close(to_f64(*largest_stable_dt), 2.0 / 90.0, 1e-5, "2/ω");
            told = true;
        }
    }
    assert!(told);
}

/// At commit 95daff4 the largest stable step was 0 for a blast beside an articulation, and for every stiff field under
/// `ExternalForce`: these gain energy at any step. Now it is the step from which on they warn, 0.02/ω.
#[test]
fn the_largest_stable_step_of_a_warning_is_not_zero() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let a = insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
        let b = insert_ball(&mut world, 1.0, Vector::X * 2.0, Vector::ZERO);
        let joint = SphericalJointBuilder::new().local_anchor2(Vector::X * -1.0);
        let link = world.multibody_joints.insert(a, b, joint, true);
        link.expect("a chain");
        let blast = Field::explosion(10.0, 4.0);
        let mut fields = build(blast + Field::spring(9.0), scheme);
        let mut told = 0;
        for _ in 0..60 {
            fields.step(&mut world).expect("a finite step");
            for warning in fields.warnings() {
                let StepWarning::Stiff {
                    dt_omega,
                    largest_stable_dt,
                    ..
                } = warning
                else {
                    continue;
                };
                let share = to_f64(*largest_stable_dt) * to_f64(*dt_omega) * 60.0;
                // The warning of that scheme's own kind applies from 0.25/ω on.
                let own = scheme == Scheme::LinearlyImplicit && share > 0.1;
                assert_close(share, if own { 0.25 } else { 0.02 }, 1e-5, "of 1/ω");
                told += 1;
            }
        }
        assert!(told > 0, "{scheme:?}");
    }
}

/// The same for a stiffness report: 0.02/ω under `ExternalForce`, 2/ω under `KickDriftKick`, infinite without a field
/// that varies; and for no stiffness does the step round to zero.
#[test]
fn the_largest_stable_step_of_a_report_is_not_zero() {
    let mut world = weightless(0.01);
    let ball = insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
    world.bodies[ball].recompute_mass_properties_from_colliders(&world.colliders);
    let largest = |tree: Field, scheme| {
        let report = build(tree, scheme).stiffness(ball, 0.01, &world);
        report.expect("finite").expect("a ball").largest_stable_dt
    };
    for (scheme, limit) in [
        (Scheme::ExternalForce, 0.02),
        (Scheme::KickDriftKick, 2.0),
        (Scheme::Kick, 2.0),
    ] {
        let found = largest(Field::spring(2500.0), scheme);
        assert_close(to_f64(found), limit / 50.0, 1e-5, format!("{scheme:?}"));
        let found = largest(Field::uniform(Vector::X), scheme);
        assert_eq!(found, Real::INFINITY, "{scheme:?}");
    }
    for scheme in SCHEMES {
        for stiffness in [1.0, 1e30, Real::MAX] {
            let found = largest(Field::spring(stiffness), scheme);
            assert!(found > 0.0, "{scheme:?}, {stiffness:e}: {found:e}");
        }
    }
}

/// `Auto` reports its error in every step, not only where it misses the tolerance.
#[test]
fn auto_reports_the_error_that_it_reached() {
    for (turn, tolerance) in [(0.001, 1e-3), (0.05, 1e-3), (1.0, 1e-3), (1.0, 0.1)] {
        let mut world = weightless(0.01);
        insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
        let omega: Real = turn / 0.01;
        let tree: Tree = Field::spring(omega * omega).into();
        let mut fields = build(tree, Scheme::Auto { tolerance });
        for _ in 0..20 {
            let outcome = fields.step(&mut world).expect("a finite step");
            let error = outcome.error.expect("a scheme that chooses");
            assert!(error > 0.0 && error <= tolerance, "{turn}: {error}");
        }
    }
    let mut world = weightless(0.01);
    insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
    let mut fields = build(Field::spring(1.0), Scheme::KickDriftKick);
    assert_eq!(fields.step(&mut world).expect("a finite step").error, None);
}

/// A body flies into a force that grows with the cube of the distance. With the strength in proportion to the mass, all
/// masses move alike, and are warned of in the same step.
#[test]
fn stiffness_is_warned_of_at_any_mass() {
    for scheme in [Scheme::Kick, Scheme::KickDriftKick] {
        let first = [-10, 0, 10].map(|exponent| {
            let mass = (2.0 as Real).powi(exponent);
            let mut world = weightless(1.0 / 60.0);
            let body = RigidBodyBuilder::dynamic().linvel(Vector::X * 8.0);
            world.insert(body, ColliderBuilder::ball(0.01).mass(mass));
            let mut fields = build(Field::radial(-2e5 * mass, 3.0), scheme);
            (0..20).find(|_| {
                fields.step(&mut world).expect("a step");
                let mut told = fields.warnings().iter();
                told.any(|it| matches!(it, StepWarning::Stiff { .. }))
            })
        });
        assert!(first[0].is_some(), "{scheme:?}");
        assert_eq!(first, [first[1]; 3], "{scheme:?}");
    }
}
