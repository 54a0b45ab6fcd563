//! A step by any route: `step`, `step_with`, and `begin` and `finish` around the user's own pipeline agree bit for bit,
//! whatever is in the world.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::channel;

use rapier3d_fields::math::to_f64;
use rapier3d_fields::pipeline::StepOutcome;
use rapier3d_fields::prelude::*;

use crate::lab::stability::SCHEMES;
use crate::support::bits::bits;
use crate::support::weightless;

type Run = (PhysicsWorld, Fields);

/// Counts its calls, and allows all pairs.
#[derive(Default)]
struct Counting(AtomicUsize);

impl PhysicsHooks for Counting {
    fn filter_contact_pair(&self, _: &PairFilterContext<'_>) -> Option<SolverFlags> {
        self.0.fetch_add(1, Ordering::Relaxed);
        Some(SolverFlags::COMPUTE_RIGID_IMPULSES)
    }
}

/// A step by `begin` and `finish` around the user's own pipeline.
fn own_step(
    (world, fields): &mut Run,
    pipeline: &mut PhysicsPipeline,
    hooks: &dyn PhysicsHooks,
    events: &dyn EventHandler,
) -> Vec<StepWarning> {
    let open = fields.begin(WorldMut::from(&mut *world)).expect("a step");
    pipeline.step(
        world.gravity,
        &world.integration_parameters,
        &mut world.islands,
        &mut world.broad_phase,
        &mut world.narrow_phase,
        &mut world.bodies,
        &mut world.colliders,
        &mut world.impulse_joints,
        &mut world.multibody_joints,
        &mut world.soft_bodies,
        &mut world.ccd_solver,
        &open.hooks(hooks),
        events,
    );
    fields.finish(open, WorldMut::from(world)).expect("a step");
    fields.warnings().to_vec()
}

/// A step by a `FieldPipeline` that is kept apart from the set, the settings and the state.
fn step_of_parts((world, fields): &mut Run, pipeline: &mut FieldPipeline) -> StepOutcome {
    let Fields {
        set,
        settings,
        state,
        ..
    } = fields;
    let open = pipeline.begin(set, settings, state, WorldMut::from(&mut *world));
    let open = open.expect("a step");
    world.step_with_events(&open.hooks(&()), &());
    let done = pipeline.finish(set, settings, state, open, WorldMut::from(world));
    done.expect("a step")
}

/// The states of all bodies and particles, bit for bit.
fn all(world: &PhysicsWorld) -> Vec<u64> {
    let particles = world.soft_bodies.iter().flat_map(|(_, soft)| {
        let places = soft.particle_positions().zip(soft.particle_velocities());
        let numbers = places.flat_map(|(x, v)| [x.to_array(), v.to_array()].concat());
        numbers.map(|x| to_f64(x).to_bits()).collect::<Vec<_>>()
    });
    bits(world).into_iter().flatten().chain(particles).collect()
}

#[track_caller]
fn agree(what: &str, build: impl Fn() -> Run, steps: usize) {
    let (mut easy, mut with, mut own, mut apart) = (build(), build(), build(), build());
    let mut pipeline = PhysicsPipeline::new();
    let mut machinery = FieldPipeline::new();
    let start = all(&easy.0);
    let (collisions, _heard) = channel();
    let (forces, _heard_too) = channel();
    let (tears, _heard_as_well) = channel();
    let events = ChannelEventCollector::new(collisions, forces, tears);
    let (one, other) = (Counting::default(), Counting::default());
    for step in 0..steps {
        let plain = easy.1.step(&mut easy.0).expect("a step");
        let hooked = with
            .1
            .step_with(&mut with.0, &one, &events)
            .expect("a step");
        let warnings = own_step(&mut own, &mut pipeline, &other, &());
        let outcome = step_of_parts(&mut apart, &mut machinery);
        assert_eq!(plain, outcome, "{what}, step {step}: its outcome");
        assert_eq!(
            all(&easy.0),
            all(&apart.0),
            "{what}, step {step}: parts kept apart"
        );
        assert_eq!(plain, hooked, "{what}, step {step}");
        assert_eq!(
            all(&easy.0),
            all(&with.0),
            "{what}, step {step}: with hooks"
        );
        assert_eq!(
            all(&easy.0),
            all(&own.0),
            "{what}, step {step}: own pipeline"
        );
        assert_eq!(easy.1.warnings(), warnings, "{what}, step {step}");
        assert_eq!(easy.1.contacts(), own.1.contacts(), "{what}, step {step}");
        assert_eq!(
            easy.1.contacts(),
            machinery.contacts(),
            "{what}, step {step}"
        );
        assert_eq!(
            easy.1.warnings(),
            machinery.warnings(),
            "{what}, step {step}"
        );
        assert_eq!(easy.1.cross_check(), own.1.cross_check(), "{what}");
    }
    assert_ne!(all(&easy.0), start, "{what}: something moved");
    let asked = [&one, &other].map(|hooks| hooks.0.load(Ordering::Relaxed));
    assert_eq!(asked[0], asked[1], "{what}: the user's hooks");
}

fn ball(world: &mut PhysicsWorld, x: Real, v: Real) -> (RigidBodyHandle, ColliderHandle) {
    let body = RigidBodyBuilder::dynamic()
        .translation(Vector::X * x)
        .linvel(Vector::X * v);
    world.insert(body, ColliderBuilder::ball(0.5))
}

fn elastic(collider: ColliderHandle) -> Field {
    Field::contact(ContactLaw::elastic()).at(collider)
}

/// Two balls that meet at 2 m/s; fields answer their contact.
fn two_balls(detection: Detection) -> Run {
    let mut world = weightless(1.0 / 60.0);
    let (left, right) = (ball(&mut world, -1.0, 1.0), ball(&mut world, 1.0, -1.0));
    let tree = elastic(left.1).sum_union(elastic(right.1));
    let fields = Fields::builder(tree).detection(detection).cross_check(true);
    (world, fields.build().expect("a valid tree"))
}

#[test]
fn routes_agree_on_two_elastic_balls() {
    for detection in [Detection::Discrete, Detection::Swept] {
        let build = || two_balls(detection);
        agree(&format!("{detection:?}"), build, 90);
        let mut run = build();
        let mut pipeline = PhysicsPipeline::new();
        for _ in 0..90 {
            own_step(&mut run, &mut pipeline, &(), &());
        }
        let speeds = run.0.bodies.iter().map(|(_, body)| to_f64(body.linvel().x));
        assert_eq!(
            speeds.collect::<Vec<_>>(),
            [-1.0, 1.0],
            "{detection:?}: they part"
        );
    }
}

#[test]
fn routes_agree_on_a_multibody_arm_in_wind() {
    for scheme in SCHEMES {
        let build = || {
            let mut world = PhysicsWorld::new();
            let mut last = world.bodies.insert(RigidBodyBuilder::fixed());
            for k in 1..4 {
                let body = RigidBodyBuilder::dynamic().translation(Vector::X * k as Real);
                let link = ColliderBuilder::capsule_x(0.3, 0.1);
                let (body, _) = world.insert(body, link);
                let joint = RevoluteJointBuilder::new(Vector::Z)
                    .local_anchor1(Vector::X * 0.5)
                    .local_anchor2(Vector::X * -0.5);
                world.multibody_joints.insert(last, body, joint, true);
                last = body;
            }
            let wind = Field::wind(Vector::new(0.0, 3.0, 1.0), 0.4, 0.1);
            let fields = Fields::builder(wind).scheme(scheme).build();
            (world, fields.expect("a valid tree"))
        };
        agree(&format!("{scheme:?}"), build, 60);
    }
}

#[test]
fn routes_agree_on_a_soft_body_in_wind() {
    for scheme in SCHEMES {
        let build = || {
            let mut world = PhysicsWorld::new();
            let soft = SoftBodyBuilder::cloth(Vector::ZERO, Vector::X * 0.5, Vector::Z * 0.5, 4, 4)
                .mass(2.0);
            let PhysicsWorld {
                soft_bodies,
                bodies,
                colliders,
                ..
            } = &mut world;
            soft_bodies.insert(soft, bodies, colliders);
            ball(&mut world, 5.0, 0.0);
            let wind = Field::wind(Vector::X * 2.0, 0.5, 0.0).sum_union(Field::spring(2.0));
            let fields = Fields::builder(wind).scheme(scheme).build();
            (world, fields.expect("a valid tree"))
        };
        agree(&format!("{scheme:?}"), build, 40);
    }
}

#[test]
fn routes_agree_on_rules_for_pairs() {
    let build = || {
        let mut world = weightless(1.0 / 60.0);
        let balls: Vec<_> = (0..6)
            .map(|k| {
                ball(
                    &mut world,
                    1.3 * k as Real,
                    if k % 2 == 0 { 1.0 } else { -1.0 },
                )
                .1
            })
            .collect();
        let tree = Tree::fold(Operator::SumUnion, balls.iter().map(|part| elastic(*part)));
        let fields = Fields::builder(tree)
            .responder_among([balls[0], balls[1]], Responder::Rapier)
            .responder_among([balls[2], balls[3]], Responder::Both)
            .build();
        (world, fields.expect("a valid tree"))
    };
    agree("rules", build, 120);
}

/// A heap of mixed shapes on a floor, under Rapier's gravity, in a weak wind, with joints; bodies
/// fall asleep.
fn heap(scheme: Scheme) -> Run {
    let mut world = PhysicsWorld::new();
    let floor = ColliderBuilder::cuboid(20.0, 0.5, 20.0).translation(Vector::Y * -0.5);
    world.colliders.insert(floor);
    let mut last = None;
    for k in 0..24 {
        let place = Vector::new(
            (k % 3) as Real * 0.9,
            0.6 + 0.7 * k as Real,
            (k % 2) as Real,
        );
        let body = RigidBodyBuilder::dynamic().translation(place);
        let collider = match k % 5 {
            0 => ColliderBuilder::ball(0.4),
            1 => ColliderBuilder::cuboid(0.4, 0.3, 0.5),
            2 => ColliderBuilder::capsule_y(0.3, 0.25),
            3 => ColliderBuilder::cylinder(0.3, 0.4),
            _ => ColliderBuilder::cone(0.4, 0.4),
        };
        let collider = collider.active_hooks(match k % 4 {
            0 => ActiveHooks::FILTER_CONTACT_PAIRS,
            _ => ActiveHooks::empty(),
        });
        let (body, _) = world.insert(body, collider);
        if let Some(last) = last.replace(body).filter(|_| k % 7 == 6) {
            let joint = SphericalJointBuilder::new().local_anchor1(Vector::Y * 0.7);
            world.impulse_joints.insert(last, body, joint, true);
        }
    }
    let wind = Field::uniform(Vector::X * 0.05).within(Region::cuboid(Vector::splat(30.0)));
    let pull = Field::point_gravity(2.0).softened(1.0).at(Vector::Y * 4.0);
    let fields = Fields::builder(wind.sum_union(pull)).scheme(scheme).build();
    (world, fields.expect("a valid tree"))
}

#[test]
fn routes_agree_on_a_heap_under_gravity() {
    for scheme in SCHEMES {
        agree(&format!("{scheme:?}"), || heap(scheme), 120);
    }
}

/// Boxes that sleep on a floor, and a body that flies over them with a field that lifts them.
fn passed_over(scheme: Scheme) -> Run {
    let mut world = PhysicsWorld::new();
    let floor = ColliderBuilder::cuboid(20.0, 0.5, 20.0).translation(Vector::Y * -0.5);
    world.colliders.insert(floor);
    for k in 0..12 {
        let place = Vector::new(k as Real, 0.4, (k % 3) as Real);
        let collider = ColliderBuilder::cuboid(0.4, 0.4, 0.4);
        let collider = collider.active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS);
        world.insert(RigidBodyBuilder::dynamic().translation(place), collider);
    }
    (0..60).for_each(|_| world.step());
    let by = RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::X * 8.0);
    let by = world.insert_body(by.translation(Vector::new(-4.0, 1.5, 1.0)));
    let lift = Field::uniform(Vector::Y * 9.0).within(Region::ball(2.0));
    let fields = Fields::builder(lift.at(by)).scheme(scheme).build();
    (world, fields.expect("a valid tree"))
}

#[test]
fn routes_agree_on_sleepers_that_a_moving_field_wakes() {
    for scheme in SCHEMES {
        let (mut world, mut fields) = passed_over(scheme);
        let asleep = |world: &PhysicsWorld| {
            let bodies = world.bodies.iter();
            bodies.filter(|it| it.1.is_sleeping()).count()
        };
        assert_eq!(asleep(&world), 12, "{scheme:?}");
        (0..90).for_each(|_| assert!(fields.step(&mut world).is_ok()));
        assert!(asleep(&world) < 4, "{scheme:?}: {}", asleep(&world));
        agree(&format!("{scheme:?}"), || passed_over(scheme), 120);
    }
}

/// Balls that roll on a floor with a wall, and boxes that spin above it, in a wind that acts at centres of mass: each
/// body is visited, and none is sampled.
pub fn rolling(scheme: Scheme) -> Run {
    let mut world = PhysicsWorld::new();
    let floor = ColliderBuilder::cuboid(20.0, 0.5, 20.0).translation(Vector::Y * -0.5);
    world.colliders.insert(floor);
    let wall = ColliderBuilder::cuboid(0.5, 2.0, 20.0).translation(Vector::X * 7.0);
    world.colliders.insert(wall);
    for k in 0..12 {
        let place = Vector::new(
            k as Real - 6.0,
            0.3 + (k % 3) as Real,
            0.8 * (k % 4) as Real,
        );
        let body = RigidBodyBuilder::dynamic().translation(place);
        let body = body.angvel(Vector::new(1.0, 0.0, 2.0));
        let collider = match k % 3 {
            2 => ColliderBuilder::cuboid(0.2, 0.3, 0.4),
            _ => ColliderBuilder::ball(0.3),
        };
        world.insert(body, collider);
    }
    let wind = Field::wind(Vector::X * 4.0, 0.2, 0.05).sampled(Sampling::Centre);
    let fields = Fields::builder(wind).scheme(scheme).build();
    (world, fields.expect("a valid tree"))
}

#[test]
fn routes_agree_on_bodies_that_are_slowed_and_held() {
    for scheme in [Scheme::KickDriftKick, Scheme::Kick] {
        agree(&format!("{scheme:?}"), || rolling(scheme), 150);
    }
}

/// A pipeline that steps two worlds in turn gives each the bits of a pipeline of its own: caches of one world are not
/// used for the other, although both have the same handles and numbers of steps.
#[test]
fn one_pipeline_steps_two_worlds() {
    for scheme in SCHEMES {
        let build = || {
            let resting = heap(scheme);
            let (mut falling, mut fields) = heap(scheme);
            for (_, body) in falling.bodies.iter_mut() {
                let up = body.translation() * 2.0 + Vector::Y * 3.0;
                body.set_translation(up, true);
            }
            let drag = Field::drag(0.3, 0.1).named("drag");
            fields.set.insert(drag);
            [resting, (falling, fields)]
        };
        let (mut apart, mut shared) = (build(), build());
        let mut pipeline = FieldPipeline::new();
        for step in 0..120 {
            for (number, run) in shared.iter_mut().enumerate() {
                let own = &mut apart[number];
                own.1.step(&mut own.0).expect("a step");
                step_of_parts(run, &mut pipeline);
                let same = all(&run.0) == all(&own.0);
                assert!(same, "{scheme:?}, step {step}, world {number}");
            }
        }
    }
}

#[test]
fn one_uniform_field_is_the_same_by_its_own_path_and_by_the_general_one() {
    for scheme in [Scheme::KickDriftKick, Scheme::Kick] {
        let wind =
            || Field::uniform(Vector::new(0.3, 0.1, -0.2)).force_mode(ForceMode::Acceleration);
        let build = |tree: Tree| {
            let (world, _) = heap(scheme);
            let fields = Fields::builder(tree).scheme(scheme).build();
            (world, fields.expect("a valid tree"))
        };
        // A second field, far off and negligible, selects the general path.
        let far = Field::uniform(Vector::X * 1e-30)
            .within(Region::ball(1.0))
            .at(Vector::X * 1e6);
        let (mut short, mut long) = (build(wind().into()), build(wind().sum_union(far)));
        for step in 0..200 {
            short.1.step(&mut short.0).expect("a step");
            long.1.step(&mut long.0).expect("a step");
            assert_eq!(all(&short.0), all(&long.0), "{scheme:?}, step {step}");
        }
    }
}

/// A step of Rapier without the hooks gives a warning in that step.
#[test]
fn forgotten_hooks_give_a_warning() {
    let (mut world, mut fields) = two_balls(Detection::Discrete);
    let mut told = false;
    for _ in 0..90 {
        let open = fields.begin(WorldMut::from(&mut world)).expect("a step");
        world.step();
        fields
            .finish(open, WorldMut::from(&mut world))
            .expect("a step");
        told |= fields.warnings().contains(&StepWarning::HooksNotGiven);
    }
    assert!(told);
}

/// Removed bodies are left out, new ones take part from the next step on, and edited fields act as edited.
#[test]
fn bodies_and_fields_may_change_between_the_halves() {
    for scheme in SCHEMES {
        let build = || {
            let mut world = weightless(1.0 / 60.0);
            let handles: Vec<_> = (0..3)
                .map(|k| ball(&mut world, 3.0 * k as Real, 0.0).0)
                .collect();
            let tree = Field::uniform(Vector::Y)
                .within(Region::ball(100.0))
                .named("push")
                .sum_union(Field::spring(0.0).named("idle"));
            let fields = Fields::builder(tree).scheme(scheme).build();
            (world, fields.expect("a valid tree"), handles)
        };
        let (mut world, mut fields, handles) = build();
        let open = fields.begin(WorldMut::from(&mut world)).expect("a step");
        world.remove_body(handles[1]);
        let (added, _) = ball(&mut world, 20.0, 0.0);
        fields["push"].strength = 3.0;
        world.step_with_events(&open.hooks(&()), &());
        fields
            .finish(open, WorldMut::from(&mut world))
            .expect("a step");
        let mass = to_f64(world.bodies[handles[0]].mass());
        let dt = 1.0 / 60.0;
        let gained = to_f64(world.bodies[handles[0]].linvel().y) * mass / dt;
        if scheme == Scheme::KickDriftKick {
            assert!((gained - (0.5 + 1.5)).abs() < 1e-3, "{gained}");
        }
        assert!(gained > 0.9 && gained < 3.1, "{scheme:?}: {gained}");
        for _ in 0..3 {
            fields.step(&mut world).expect("a step");
        }
        assert!(
            world.bodies[added].linvel().y > 0.0,
            "{scheme:?}: the new one"
        );
        assert!(world.bodies.get(handles[1]).is_none());
    }
}

/// Where no field acts, balls move as in Rapier alone, bit for bit: all of them where every field is far off, and those
/// out of reach beside one that a field pushes. (Spinning bodies of unequal inertia are rotated by this crate wherever
/// a field could rotate any body: 21 of 40 random worlds differ by a far-off spring.)
#[test]
fn balls_that_no_field_reaches_move_as_in_rapier() {
    for scheme in SCHEMES {
        for near in [false, true] {
            let build = || {
                let mut world = PhysicsWorld::new();
                let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
                world.insert(floor, ColliderBuilder::cuboid(30.0, 0.5, 30.0));
                for k in 0..12 {
                    let place = Vector::new(0.3 * (k % 3) as Real, 0.6 + 1.1 * k as Real, 0.0);
                    let ball = RigidBodyBuilder::dynamic().translation(place);
                    world.insert(
                        ball.angvel(Vector::new(0.0, 1.0, k as Real))
                            .linear_damping(0.1),
                        ColliderBuilder::ball(0.5).friction(0.7),
                    );
                }
                let (pushed, _) = ball(&mut world, 500.0, 0.0);
                (world, pushed)
            };
            let (mut alone, pushed) = build();
            let (mut world, _) = build();
            let at = if near { 500.0 } else { 1e4 };
            let well = Field::spring(9.0).within(Region::ball(200.0));
            let fields = Fields::builder(well.at(Vector::X * at)).scheme(scheme);
            let mut fields = fields.build().expect("a valid tree");
            for step in 0..150 {
                alone.step();
                fields.step(&mut world).expect("a step");
                for ((handle, a), (_, b)) in alone.bodies.iter().zip(world.bodies.iter()) {
                    let of = |body: &RigidBody| (*body.position(), body.linvel(), body.angvel());
                    let same = of(a) == of(b) && a.is_sleeping() == b.is_sleeping();
                    assert!(
                        same || (near && handle == pushed),
                        "{scheme:?}, near: {near}, step {step}: {handle:?}"
                    );
                }
            }
        }
    }
}
