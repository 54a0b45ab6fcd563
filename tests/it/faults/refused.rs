//! A step that is refused leaves the world as it was, whatever is in it.

use rapier3d_fields::math::Real;
use rapier3d_fields::prelude::*;
use serde_json::Value;

use crate::lab::stability::SCHEMES;

/// A world with one of each kind of body, joint and motion.
fn world() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    world.insert(floor, ColliderBuilder::cuboid(30.0, 0.5, 30.0));
    let at = |x: Real| Vector::new(x, 0.6, 0.0);
    let cube = || ColliderBuilder::cuboid(0.5, 0.5, 0.25);
    let spinning = RigidBodyBuilder::dynamic()
        .translation(at(0.0) + Vector::Y * 3.0)
        .linvel(Vector::new(1.0, -3.0, 0.0))
        .angvel(Vector::new(1.0, 2.0, 3.0))
        .ccd_enabled(true);
    let (pushed, _) = world.insert(spinning, cube());
    world.bodies[pushed].add_force(Vector::new(0.1, 0.2, -0.3), true);
    world.bodies[pushed].add_torque(Vector::new(-0.1, 0.2, 0.3), true);
    world.insert(RigidBodyBuilder::dynamic().translation(at(2.0)), cube());
    world.insert(
        RigidBodyBuilder::dynamic().translation(at(2.1) + Vector::Y),
        cube(),
    );
    let plain = RigidBodyBuilder::dynamic()
        .translation(at(4.0) + Vector::Y)
        .gyroscopic_forces_enabled(false)
        .angvel(Vector::ONE);
    world.insert(plain, cube());
    let (sleeper, _) = world.insert(RigidBodyBuilder::dynamic().translation(at(6.0)), cube());
    world.bodies[sleeper].sleep();
    let off = RigidBodyBuilder::dynamic()
        .translation(at(8.0))
        .enabled(false);
    world.insert(off, cube());
    let led = RigidBodyBuilder::kinematic_position_based().translation(at(10.0));
    world.insert(led, cube());
    let driven = RigidBodyBuilder::kinematic_velocity_based()
        .translation(at(12.0))
        .linvel(Vector::new(0.5, 0.0, 0.25))
        .angvel(Vector::Y);
    world.insert(driven, cube());
    // A pair with a motor, and an arm.
    let [one, other] = [14.0, 15.2].map(|x| {
        let body = RigidBodyBuilder::dynamic().translation(at(x) + Vector::Y * 2.0);
        world.insert(body, cube()).0
    });
    let motor = RevoluteJointBuilder::new(Vector::Z)
        .local_anchor1(Vector::X * 0.6)
        .local_anchor2(Vector::X * -0.6)
        .motor_velocity(3.0, 0.5);
    world.impulse_joints.insert(one, other, motor, true);
    // A joint without motor: only its impulses change.
    let hook = RigidBodyBuilder::fixed().translation(at(14.0) + Vector::Y * 6.0);
    let hook = world.bodies.insert(hook);
    let weight = RigidBodyBuilder::dynamic().translation(at(14.5) + Vector::Y * 5.0);
    let (weight, _) = world.insert(weight, cube());
    let chain = SphericalJointBuilder::new().local_anchor2(Vector::new(-0.5, 1.0, 0.0));
    world.impulse_joints.insert(hook, weight, chain, true);
    let post = RigidBodyBuilder::fixed().translation(at(18.0) + Vector::Y * 6.0);
    let mut last = world.bodies.insert(post);
    for k in 1..4 {
        let body = RigidBodyBuilder::dynamic().translation(at(18.0 + k as Real) + Vector::Y * 6.0);
        let (body, _) = world.insert(body, ColliderBuilder::capsule_x(0.3, 0.1));
        let joint = RevoluteJointBuilder::new(Vector::Z)
            .local_anchor1(Vector::X * 0.5)
            .local_anchor2(Vector::X * -0.5)
            .motor_position(0.3, 2.0, 0.1);
        world.multibody_joints.insert(last, body, joint, true);
        last = body;
    }
    let middle = Vector::new(25.0, 4.0, 0.0);
    let cloth = SoftBodyBuilder::cloth(middle, Vector::X * 0.5, Vector::Z * 0.5, 4, 4);
    let cloth = world.insert_soft_body(cloth.mass(2.0));
    world.soft_bodies[cloth].set_particle_pinned(0, true);
    world
}

/// Targets that a user may have set since the last step.
fn lead(world: &mut PhysicsWorld) {
    let is_led = |body: &RigidBody| body.body_type() == RigidBodyType::KinematicPositionBased;
    let led = world.bodies.iter().find(|(_, body)| is_led(body));
    let led = led.map(|(handle, _)| handle).expect("one of each");
    let now = world.bodies[led].translation();
    world.bodies[led].set_next_kinematic_translation(now + Vector::new(0.1, 0.05, 0.0));
    let cloth = world.soft_bodies.iter().next();
    let cloth = cloth.map(|(handle, _)| handle).expect("one of each");
    let soft = &mut world.soft_bodies[cloth];
    let pinned = soft.particle_position(0);
    soft.set_particle_kinematic_target(0, pinned + Vector::Y * 0.01);
}

fn value(of: &impl serde::Serialize) -> Value {
    serde_json::to_value(of).expect("what can be written")
}

/// Everything that Rapier saves of a world, except its bookkeeping: places in lists, marks of changes, and derived
/// values.
fn everything(world: &PhysicsWorld) -> Vec<String> {
    let without = |mut value: Value, keys: &[&str]| {
        let map = value.as_object_mut().expect("a struct");
        keys.iter().for_each(|key| {
            map.remove(*key);
        });
        value.to_string()
    };
    let bodies = world.bodies.iter();
    let bodies =
        bodies.map(|(_, body)| without(value(body), &["ids", "changes", "soft_motion_margin"]));
    let colliders = world.colliders.iter();
    let colliders = colliders.map(|(_, it)| format!("{:?}", it.position()));
    let joints = world
        .impulse_joints
        .iter()
        .map(|(_, it)| format!("{} {:?}", value(&it.data), it.impulses));
    // The root's own joint is left out: Rapier makes it in its first step.
    let links = world.multibody_joints.multibodies().map(|it| {
        let of = |link: &MultibodyLink| {
            let velocity = it.joint_velocity(link);
            let velocity: Vec<Real> = velocity.iter().copied().collect();
            (value(&link.joint), velocity)
        };
        let links: Vec<_> = it.links().skip(1).map(of).collect();
        format!("{links:?}")
    });
    let softs = world.soft_bodies.iter();
    let softs = softs.map(|(_, it)| without(value(it), &["modified", "positions_modified"]));
    let all = bodies.chain(colliders).chain(joints);
    all.chain(links).chain(softs).collect()
}

/// When a field gives NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
enum When {
    /// After an edit of its axis.
    Now,
    /// From this time on.
    From(Real),
}

/// Fields of which one gives NaN, near a place or everywhere.
fn bad(when: When, near: Option<Vector>, scheme: Scheme) -> Fields {
    let axes = ["broken".into(), Axis::Time];
    let bad = Field::closure(axes, move |sample: &Sample| {
        let bad = match when {
            When::Now => sample.axes[0] > 0.0,
            When::From(time) => sample.axes[1] > time,
        };
        Vector::Y * if bad { Real::NAN } else { 0.5 }
    });
    let bad = match near {
        Some(near) => bad.within(Region::ball(1.0).at(near)),
        None => bad,
    };
    let wind = Field::wind(Vector::new(1.0, 0.0, 0.5), 0.3, 0.0);
    let builder = Fields::builder(wind.sum_union(bad.named("culprit")))
        .axis("broken", 0.0)
        .scheme(scheme)
        .on_fault(FaultPolicy::Refuse);
    builder.build().expect("a valid tree")
}

/// Fails unless two steps are refused and the world is unchanged.
fn refuses(fields: &mut Fields, world: &mut PhysicsWorld, place: &str) {
    let before = everything(world);
    for _ in 0..2 {
        let error = fields.step(world).expect_err(place);
        assert!(error.to_string().contains("`culprit`"), "{error}");
        for (now, was) in everything(world).iter().zip(&before) {
            assert_eq!(now, was, "{place}: {error}");
        }
    }
}

#[test]
fn a_refused_step_leaves_the_world_as_it_was() {
    let dt = PhysicsWorld::new().integration_parameters.dt;
    let cloth = Vector::new(25.0, 4.0, 0.0);
    for scheme in SCHEMES {
        // Schemes that evaluate rigid bodies once a step still evaluate soft bodies at its end.
        for when in [When::Now, When::From(4.5 * dt)] {
            for near in [None, Some(cloth), Some(Vector::new(0.0, 3.0, 0.0))] {
                let place = format!("{scheme:?}, {when:?}, {near:?}");
                let mut world = world();
                let mut fields = bad(when, near, scheme);
                for _ in 0..4 {
                    lead(&mut world);
                    fields.step(&mut world).expect("not yet");
                }
                lead(&mut world);
                if when == When::Now {
                    fields.set_axis("broken", 1.0).expect("its axis");
                }
                let soft = near == Some(cloth) || near.is_none();
                let once = matches!(
                    scheme,
                    Scheme::Kick | Scheme::ExternalForce | Scheme::LinearlyImplicit
                );
                if once && when != When::Now && !soft {
                    fields.step(&mut world).expect("it is not looked at");
                    lead(&mut world);
                }
                refuses(&mut fields, &mut world, &place);
                // Under another policy the world goes on.
                fields.settings.on_fault = FaultPolicy::LeaveOut;
                fields.step(&mut world).expect("the world goes on");
                // Nothing is left of the copies of the refused steps.
                fields.settings.on_fault = FaultPolicy::Refuse;
                refuses(&mut fields, &mut world, &place);
            }
        }
    }
}

/// The mass of a new body is computed before Rapier's step; a refusal takes that back.
#[test]
fn a_refused_first_step_leaves_no_trace() {
    for scheme in SCHEMES {
        for when in [When::From(-1.0), When::From(0.001)] {
            let mut world = world();
            let mut fields = bad(when, None, scheme);
            refuses(&mut fields, &mut world, &format!("{scheme:?}, {when:?}"));
        }
    }
}

/// After a refused step soft bodies and their colliders go on as if it had not been.
#[test]
fn soft_bodies_go_on_from_where_they_were() {
    for scheme in SCHEMES {
        let run = |refused: bool| {
            let mut world = PhysicsWorld::new();
            let middle = Vector::new(25.0, 4.0, 0.0);
            let cloth = SoftBodyBuilder::cloth(middle, Vector::X * 0.5, Vector::Z * 0.5, 4, 4);
            let cloth = world.insert_soft_body(cloth.mass(2.0));
            let later = When::From(4.5 * world.integration_parameters.dt);
            let mut fields = bad(later, Some(middle), scheme);
            for _ in 0..4 {
                fields.step(&mut world).expect("not yet");
            }
            if refused {
                refuses(&mut fields, &mut world, &format!("{scheme:?}"));
            }
            (0..3).for_each(|_| world.step());
            let soft = &world.soft_bodies[cloth];
            let particles: Vec<_> = soft.particle_positions().collect();
            let colliders = world.colliders.iter();
            let bounds = colliders.map(|(_, it)| it.compute_aabb());
            (particles, format!("{:?}", bounds.collect::<Vec<_>>()))
        };
        assert_eq!(run(true), run(false), "{scheme:?}");
    }
}

/// A refused step does not take back a quarantine of an earlier one.
#[test]
fn bodies_stay_in_quarantine_after_a_refused_step() {
    for scheme in [Scheme::KickDriftKick, Scheme::Forward4] {
        let mut world = PhysicsWorld::new();
        let dt = world.integration_parameters.dt;
        world.gravity = Vector::ZERO;
        let bodies = [0.0, 9.0].map(|x| {
            let body = RigidBodyBuilder::dynamic().translation(Vector::X * x);
            world.insert(body, ColliderBuilder::ball(0.5)).0
        });
        let bad = |x: Real, after: Real| {
            let bad = Field::closure([Axis::Time], move |sample: &Sample| {
                let is_late = sample.axes[0] > after;
                Vector::Y * if is_late { Real::NAN } else { 0.5 }
            });
            bad.within(Region::ball(1.0).at(Vector::X * x))
        };
        let tree = bad(-9.0, -1.0).sum_union(bad(9.0, 4.5 * dt));
        let fields = Fields::builder(tree).scheme(scheme);
        let fields = fields.on_fault(FaultPolicy::Quarantine).build();
        let mut fields = fields.expect("a valid tree");
        for step in 0..4 {
            if step == 2 {
                world.bodies[bodies[0]].set_translation(Vector::X * -9.0, true);
            }
            fields.step(&mut world).expect("a step");
        }
        fields.settings.on_fault = FaultPolicy::Refuse;
        let before = everything(&world);
        fields.step(&mut world).expect_err("it is refused");
        assert_eq!(everything(&world), before, "{scheme:?}");
        let enabled = bodies.map(|body| world.bodies[body].is_enabled());
        assert_eq!(enabled, [false, true], "{scheme:?}");
    }
}
