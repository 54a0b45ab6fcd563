//! Rapier's steps between `begin` and `finish`: without one, `finish` is an error; with several, it warns.

use rapier3d_fields::math::to_f64;
use rapier3d_fields::prelude::*;

use crate::lab::stability::SCHEMES;
use crate::support::bits::bits;
use crate::support::{assert_close, weightless};

type Run = (PhysicsWorld, Fields);

fn finish_after((world, fields): &mut Run, rapiers_steps: usize) -> Result<(), StepError> {
    let open = fields.begin(WorldMut::from(&mut *world)).expect("a step");
    for _ in 0..rapiers_steps {
        world.step_with_events(&open.hooks(&()), &());
    }
    fields.finish(open, WorldMut::from(world)).map(|_| ())
}

fn others(fields: &Fields) -> Option<f64> {
    fields.warnings().iter().find_map(|told| match told {
        StepWarning::OtherSteps { advanced, dt } => Some(to_f64(*advanced) / to_f64(*dt)),
        _ => None,
    })
}

/// Boxes on a floor and in the air, a sleeper that the field wakes, a joint, a kinematic body.
fn yard(tree: impl Into<Tree>, scheme: Scheme) -> Run {
    let mut world = PhysicsWorld::new();
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    world.insert(floor, ColliderBuilder::cuboid(50.0, 0.5, 50.0));
    let body = |x: Real, y: Real| RigidBodyBuilder::dynamic().translation(Vector::new(x, y, 0.0));
    let part = || ColliderBuilder::cuboid(0.5, 0.4, 0.3);
    world.insert(body(0.0, 0.4), part());
    world.insert(body(0.1, 1.2), part());
    world.insert(body(4.0, 6.0).linvel(Vector::X).angvel(Vector::ONE), part());
    world.insert(body(8.0, 0.4).sleeping(true), part());
    let a = world.insert(body(12.0, 5.0), part()).0;
    let b = world.insert(body(14.0, 5.0), part()).0;
    let joint = SphericalJointBuilder::new().local_anchor2(Vector::X * -2.0);
    world.impulse_joints.insert(a, b, joint, true);
    let led = RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::X);
    world.insert(led.translation(Vector::Z * 9.0), part());
    let fields = Fields::builder(tree).scheme(scheme).build();
    (world, fields.expect("a valid tree"))
}

fn trees() -> [Tree; 2] {
    let well = Field::spring(3.0) + Field::drag(0.1, 0.0);
    [Field::uniform(Vector::X).into(), well]
}

/// In 95daff4 `finish` returned `Ok`, the kick stayed in the velocities, and the next step kicked again. Now it returns
/// an error and restores the world: the run goes on as if that step had not begun.
#[test]
fn a_missing_step_is_an_error_and_leaves_the_world_as_it_was() {
    for scheme in SCHEMES {
        for tree in trees() {
            let mut plain = yard(tree.clone(), scheme);
            let mut halted = yard(tree, scheme);
            for step in 0..40 {
                if step % 3 == 0 {
                    let before = bits(&halted.0);
                    let error = finish_after(&mut halted, 0).expect_err("no step was made");
                    assert_eq!(error, StepError::NotStepped, "{scheme:?}");
                    assert_eq!(bits(&halted.0), before, "{scheme:?}, step {step}");
                }
                plain.1.step(&mut plain.0).expect("a step");
                finish_after(&mut halted, 1).expect("a step");
                assert_eq!(others(&halted.1), None, "{scheme:?}, step {step}");
            }
            assert_eq!(plain.1.time(), halted.1.time());
            assert!(bits(&plain.0) == bits(&halted.0), "{scheme:?}");
        }
    }
}

/// The same where no field reaches any body: an awake body that fields do not write to shows whether Rapier stepped,
/// from the first step on. The run has the bits of one of whole steps.
#[test]
fn missing_and_extra_steps_show_on_bodies_that_no_field_reaches() {
    let far = || {
        Field::spring(3.0)
            .within(Region::ball(1.0))
            .at(Vector::X * 1e4)
    };
    for scheme in SCHEMES {
        // The body flies, rests and may not sleep, or rests and may fall asleep.
        for (linvel, sleeps) in [
            (Vector::X, true),
            (Vector::ZERO, false),
            (Vector::ZERO, true),
        ] {
            let build = || {
                let world = weightless(1.0 / 60.0);
                let fields = Fields::builder(far()).scheme(scheme).build();
                let mut run = (world, fields.expect("a valid tree"));
                let ball = RigidBodyBuilder::dynamic().linvel(linvel).can_sleep(sleeps);
                run.0.insert(ball, ColliderBuilder::ball(0.5));
                run
            };
            let what = format!("{scheme:?}, {linvel}, {sleeps}");
            let (mut plain, mut halted) = (build(), build());
            for step in 0..12 {
                let before = bits(&halted.0);
                let error = finish_after(&mut halted, 0).expect_err("no step was made");
                assert_eq!(error, StepError::NotStepped, "{what}, step {step}");
                assert_eq!(bits(&halted.0), before, "{what}, step {step}");
                plain.1.step(&mut plain.0).expect("a step");
                finish_after(&mut halted, 1).expect("a step");
                assert_eq!(others(&halted.1), None, "{what}, step {step}");
            }
            assert!(bits(&plain.0) == bits(&halted.0), "{what}");
            for count in [2, 3, 5] {
                finish_after(&mut halted, count).expect("told, not refused");
                // A body that neither moves nor may sleep shows that steps were made, but not how many.
                let shows = linvel != Vector::ZERO || sleeps;
                let advanced = others(&halted.1);
                assert_eq!(advanced.is_some(), shows, "{what}, {count}: {advanced:?}");
                if let Some(advanced) = advanced {
                    assert_close(advanced, f64::from(count as u32), 0.05, &what);
                }
            }
        }
    }
}

/// The same in a world of many bodies, of which no field reaches any.
#[test]
fn a_missing_step_shows_in_a_yard_that_no_field_reaches() {
    for scheme in SCHEMES {
        let far = Field::spring(3.0).within(Region::ball(1.0));
        let mut halted = yard(far.at(Vector::X * 1e4), scheme);
        let mut alone = yard(Field::uniform(Vector::ZERO), scheme).0;
        for step in 0..40 {
            let before = bits(&halted.0);
            let error = finish_after(&mut halted, 0).expect_err("no step was made");
            assert_eq!(error, StepError::NotStepped, "{scheme:?}");
            assert_eq!(bits(&halted.0), before, "{scheme:?}, step {step}");
            finish_after(&mut halted, 1).expect("a step");
            assert_eq!(others(&halted.1), None, "{scheme:?}, step {step}");
            alone.step();
        }
        let asleep = |world: &PhysicsWorld| {
            let bodies = world.bodies.iter();
            bodies.map(|it| it.1.is_sleeping()).collect::<Vec<_>>()
        };
        assert_eq!(asleep(&halted.0), asleep(&alone), "{scheme:?}");
    }
}

/// Bodies that fields disabled in the first half are enabled again.
#[test]
fn a_missing_step_takes_back_a_quarantine() {
    let broken = Field::closure([], |_: &Sample| Vector::X / 0.0).within(Region::ball(1.0));
    let mut run = yard(broken, Scheme::KickDriftKick);
    let before = bits(&run.0);
    let error = finish_after(&mut run, 0).expect_err("no step was made");
    assert_eq!(error, StepError::NotStepped);
    assert_eq!(bits(&run.0), before);
    finish_after(&mut run, 1).expect("a step");
    assert!(run.0.bodies.iter().any(|(_, body)| !body.is_enabled()));
}

/// In 95daff4 `finish` returned `Ok` without a warning, and a body pushed at 1 m/s² gained half of its speed in the
/// time of two steps. Now a warning states by how much Rapier advanced, for flying as for resting bodies.
#[test]
fn several_steps_give_a_warning() {
    for scheme in SCHEMES {
        for count in [2, 3, 5] {
            let mut world = weightless(1.0 / 60.0);
            let ball = RigidBodyBuilder::dynamic().linvel(Vector::new(1.0, 2.0, 0.0));
            world.insert(ball, ColliderBuilder::ball(0.5));
            let fields = Fields::builder(Field::uniform(Vector::X * 0.1)).scheme(scheme);
            let mut run = (world, fields.build().expect("a valid tree"));
            finish_after(&mut run, count).expect("told, not refused");
            let advanced = others(&run.1).expect("told");
            assert_close(advanced, count as f64, 0.05, format!("{scheme:?} flies"));
            finish_after(&mut run, 1).expect("a step");
            assert_eq!(others(&run.1), None, "{scheme:?}");

            let mut world = PhysicsWorld::new();
            world.insert(
                RigidBodyBuilder::fixed(),
                ColliderBuilder::cuboid(9.0, 0.5, 9.0),
            );
            let chest = RigidBodyBuilder::dynamic().translation(Vector::Y);
            world.insert(chest, ColliderBuilder::cuboid(0.5, 0.5, 0.5));
            let fields = Fields::builder(Field::uniform(Vector::X * 0.1)).scheme(scheme);
            let mut run = (world, fields.build().expect("a valid tree"));
            for _ in 0..5 {
                finish_after(&mut run, 1).expect("a step");
                assert_eq!(others(&run.1), None, "{scheme:?}");
            }
            finish_after(&mut run, count).expect("told, not refused");
            let advanced = others(&run.1).expect("told");
            assert_close(advanced, count as f64, 1e-3, format!("{scheme:?} rests"));
        }
    }
}

/// No false alarm where Rapier's correction of positions moves a body by more than its velocity, continuous detection
/// stops one, a strong field changes velocities by much, or a step has no length.
#[test]
fn a_single_step_gives_no_warning() {
    for scheme in SCHEMES {
        let mut run = yard(Field::uniform(Vector::new(30.0, -80.0, 5.0)), scheme);
        let part = || ColliderBuilder::cuboid(0.5, 0.5, 0.5);
        for k in 0..6 {
            let place = Vector::new(20.0 + 0.2 * k as Real, 0.3, 0.0);
            run.0.insert(
                RigidBodyBuilder::dynamic()
                    .translation(place)
                    .linvel(Vector::X * 0.1),
                part(),
            );
            let fast = RigidBodyBuilder::dynamic()
                .translation(Vector::new(-9.0 + k as Real * 2.0, 3.0, 6.0))
                .linvel(Vector::Y * -90.0)
                .ccd_enabled(k % 2 == 0);
            run.0.insert(fast, ColliderBuilder::ball(0.2));
        }
        for step in 0..120 {
            run.0.integration_parameters.dt = match step % 10 {
                7 => 0.0,
                8 => 1e-5,
                _ => 1.0 / 60.0,
            };
            finish_after(&mut run, 1).expect("a step");
            assert_eq!(others(&run.1), None, "{scheme:?}, step {step}");
        }
    }
}

/// After an invalid edit between the halves, the step is finished without it, and the next one is refused.
#[test]
fn the_next_step_refuses_an_invalid_edit_between_the_halves() {
    for scheme in SCHEMES {
        for tree in trees() {
            let mut plain = yard(tree.clone(), scheme);
            let mut edited = yard(tree, scheme);
            for _ in 0..5 {
                finish_after(&mut plain, 1).expect("a step");
                finish_after(&mut edited, 1).expect("a step");
            }
            finish_after(&mut plain, 1).expect("a step");
            let (world, fields) = &mut edited;
            let open = fields.begin(WorldMut::from(&mut *world)).expect("a step");
            world.step_with_events(&open.hooks(&()), &());
            let edit = fields.set.insert(Field::radial(Real::NAN, -2.0));
            let done = fields.finish(open, WorldMut::from(&mut *world));
            done.expect("a step without the edit");
            assert!(bits(world) == bits(&plain.0), "{scheme:?}");
            let error = fields.step(world).expect_err("NaN");
            assert!(matches!(error, StepError::Setting(_)), "{error}");
            assert!(bits(world) == bits(&plain.0), "{scheme:?}");
            fields.set.remove(edit);
            finish_after(&mut edited, 1).expect("a step");
            finish_after(&mut plain, 1).expect("a step");
            let apart = |(handle, body): (RigidBodyHandle, &RigidBody)| {
                (edited.0.bodies[handle].translation() - body.translation()).length()
            };
            let apart = plain.0.bodies.iter().map(apart).fold(0.0, Real::max);
            assert!(apart < 1e-5, "{scheme:?}: {apart}");
        }
    }
}

/// The step was reported as missing, and taken back: it set the time for which the body had been slow, one step, to zero
/// and added one step.
#[test]
fn a_step_in_which_a_body_is_woken_is_no_missing_one() {
    // The body moves a little, or not at all.
    for (scheme, strength) in SCHEMES.iter().flat_map(|it| [(*it, 1e-4), (*it, 0.0)]) {
        let mut world = weightless(1.0 / 60.0);
        let (body, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
        let mut fields = Fields::builder(Field::uniform(Vector::X * strength))
            .scheme(scheme)
            .build()
            .expect("a valid tree");
        let mut was_slow_for_one = false;
        for step in 0..4 {
            let slow_for = world.bodies[body].activation().time_since_can_sleep;
            was_slow_for_one |= slow_for == 1.0 / 60.0;
            let open = fields.begin(WorldMut::from(&mut world)).expect("begins");
            world.bodies[body].wake_up(true);
            world.step_with_events(&open.hooks(&()), &());
            let outcome = fields.finish(open, WorldMut::from(&mut world));
            assert!(outcome.is_ok(), "{scheme:?}, step {step}: {outcome:?}");
        }
        assert!(was_slow_for_one, "{scheme:?}");
    }
}
