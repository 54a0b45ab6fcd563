//! Bodies that are added, removed or changed between steps: only these are evaluated before the step, with the same
//! bits as if all were.

use rapier3d_fields::field::Turbulence;
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::prelude::FixedJointBuilder;
use rapier3d_fields::{Detection, StepWarning};

use crate::support::bits::bits;

fn shape(number: usize) -> ColliderBuilder {
    match number % 5 {
        0 => ColliderBuilder::ball(0.4),
        1 => ColliderBuilder::cuboid(0.4, 0.3, 0.5),
        2 => ColliderBuilder::capsule_y(0.3, 0.25),
        3 => ColliderBuilder::cylinder(0.3, 0.4),
        _ => ColliderBuilder::cone(0.4, 0.4),
    }
}

fn add(world: &mut PhysicsWorld, number: usize) {
    let cell = [number % 4, number / 4 % 3, number % 3].map(|n| n as Real * 1.7);
    let place = Vector::from_array(cell) + Vector::Y * (0.6 + 0.3 * (number % 7) as Real);
    let body = RigidBodyBuilder::dynamic().translation(place);
    world.insert(body.angvel(Vector::splat(0.3)), shape(number));
}

/// Bodies over a floor, with gravity, in fields that cut them, act at several points, or push at centres. If `all`,
/// each body is evaluated before a step in which any has changed: with a field on a collider, one may act on another.
fn scene(all: bool) -> (PhysicsWorld, Fields) {
    let mut world = PhysicsWorld::new();
    let floor = ColliderBuilder::cuboid(20.0, 0.5, 20.0).translation(Vector::Y * -0.5);
    let floor = world.colliders.insert(floor);
    (0..24).for_each(|number| add(&mut world, number));
    let wells = (0..80).map(|number| {
        let at = [number * 37 % 11, number * 53 % 7, number * 71 % 13].map(|n| n as Real * 0.5);
        let well = Field::radial(-0.2, -1.0).within(Region::ball(0.8));
        Tree::from(well.at(Vector::from_array(at)))
    });
    let belt = Field::uniform(Vector::X).within(Region::cuboid(Vector::new(2.0, 1.0, 9.0)));
    let gusts = Field::turbulence(Turbulence::new(3, 2.0, 4.0)).sampled(Sampling::Surface);
    let dome = Field::spring(0.3).within(Region::ball(2.5));
    let dome =
        Tree::from(Field::uniform(Vector::Z)).replace_union(dome.at(Vector::new(3.0, 0.0, 2.0)));
    let mut tree = Tree::fold(Operator::SumUnion, wells) + belt + gusts + dome;
    if all {
        // Within the floor, where it acts on no body.
        let carried = Field::uniform(Vector::X).within(Region::ball(0.01));
        tree += carried.at(floor);
    }
    let fields = Fields::builder(tree).build().expect("a valid tree");
    (world, fields)
}

/// An edit that a program may make between two steps.
fn edit(world: &mut PhysicsWorld, step: usize) {
    let handles: Vec<_> = world.bodies.iter().map(|(handle, _)| handle).collect();
    let chosen = handles[step * 7 % handles.len()];
    let collider = world.bodies[chosen].colliders()[0];
    match step % 9 {
        0 => add(world, step),
        1 => {
            world.remove_body(chosen);
        }
        2 => {
            let body = &mut world.bodies[chosen];
            body.set_translation(body.translation() + Vector::new(0.3, 0.5, -0.2), true);
        }
        3 => world.colliders[collider].set_density(2.0 + (step % 3) as Real),
        4 => {
            let shape = shape(step / 9).build().shared_shape().clone();
            world.colliders[collider].set_shape(shape);
        }
        5 => world.bodies[chosen].sleep(),
        6 => {
            let more = shape(step).translation(Vector::X * 0.4);
            world.insert_collider(more, Some(chosen));
        }
        7 => world.bodies[chosen].set_linvel(Vector::Y, true),
        _ => {}
    }
}

#[test]
fn evaluating_only_changed_bodies_gives_the_same_bits() {
    let (mut one, mut fields) = scene(false);
    let (mut other, mut all_fields) = scene(true);
    for step in 0..300 {
        edit(&mut one, step);
        edit(&mut other, step);
        fields.step(&mut one).expect("a step");
        all_fields.step(&mut other).expect("a step");
        assert!(bits(&one) == bits(&other), "step {step}");
    }
}

/// Rapier recomputes the inertia of a changed body within its step, and keeps the angular velocity.
#[test]
fn a_body_whose_shape_or_mass_is_changed_keeps_its_angular_velocity() {
    let planet = || Field::point_gravity(1.0).at(Vector::Y * -50.0);
    let contact = Field::contact(ContactLaw::restitution(1.0));
    let fields = [
        ("at the centre", planet().sampled(Sampling::Centre)),
        ("over the volume", planet()),
        ("nowhere near", planet().within(Region::ball(1.0))),
        ("contact", contact),
    ];
    let spin = Vector::new(3.0, 4.0, 0.0);
    for scheme in [
        Scheme::KickDriftKick,
        Scheme::Kick,
        Scheme::Forward4,
        Scheme::Substep(Substeps::PerBody { tolerance: 1e-3 }),
    ] {
        for (name, field) in &fields {
            for changes_shape in [true, false] {
                let mut world = PhysicsWorld::new();
                world.gravity = Vector::ZERO;
                let body = RigidBodyBuilder::dynamic().angvel(spin);
                let (body, collider) = world.insert(body, ColliderBuilder::cuboid(0.5, 0.4, 0.3));
                let mut field = field.clone();
                if *name == "contact" {
                    field = field.at(collider);
                }
                let builder = Fields::builder(field).detection(Detection::Swept);
                let mut fields = builder.build().expect("a valid tree");
                fields.settings.scheme = scheme;
                for _ in 0..3 {
                    fields.step(&mut world).expect("a step");
                }
                if changes_shape {
                    world.colliders[collider].set_shape(SharedShape::cuboid(0.1, 0.08, 0.06));
                } else {
                    world.colliders[collider].set_density(40.0);
                }
                let before = world.bodies[body].angvel();
                fields.step(&mut world).expect("a step");
                let off = (world.bodies[body].angvel() - before).length();
                // The largest is 0.022 rad/s: a free top turns its angular velocity.
                assert!(off < 0.03, "{name}, {scheme:?}, {changes_shape}: {off}");
            }
        }
    }
}

/// A body that Rapier's solver holds, and every body under schemes that apply forces within Rapier's step, has the
/// force on the mass before in the step after a change, unless the mass is recomputed with the change.
#[test]
fn a_force_on_a_mass_that_was_changed_is_warned_of() {
    let g = Vector::Y * -9.81;
    for (scheme, held) in [
        (Scheme::KickDriftKick, true),
        (Scheme::Forward4, true),
        (Scheme::ExternalForce, true),
        (Scheme::ExternalForce, false),
        (Scheme::KickDriftKick, false),
    ] {
        for recomputes in [false, true] {
            let mut world = PhysicsWorld::new();
            world.gravity = Vector::ZERO;
            let body = |at| RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
            let (body, other) = (body(Vector::ZERO), body(Vector::X * 2.0));
            let (body, collider) = world.insert(body, ColliderBuilder::cuboid(0.5, 0.4, 0.3));
            let (other, _) = world.insert(other, ColliderBuilder::cuboid(0.3, 0.3, 0.3));
            if held {
                let joint = FixedJointBuilder::new().local_anchor1(Vector::X);
                let joint = joint.local_anchor2(-Vector::X);
                world.impulse_joints.insert(body, other, joint, true);
            }
            let gravity = Field::uniform(g).force_mode(ForceMode::Acceleration);
            let mut fields = Fields::new(gravity).expect("a valid tree");
            fields.settings.scheme = scheme;
            for _ in 0..3 {
                fields.step(&mut world).expect("a step");
            }
            world.colliders[collider].set_shape(SharedShape::cuboid(0.1, 0.08, 0.06));
            if recomputes {
                let PhysicsWorld {
                    bodies, colliders, ..
                } = &mut world;
                bodies[body].recompute_mass_properties_from_colliders(colliders);
            }
            let before = world.bodies[body].linvel().y;
            fields.step(&mut world).expect("a step");
            let mut told = fields.warnings().to_vec();
            // The pair turns after a wrong push, but its centre of mass falls as it should.
            let speed = |world: &PhysicsWorld| {
                let moved = [body, other].map(|it| &world.bodies[it]);
                let moved = if held { &moved[..] } else { &moved[..1] };
                let mass: Real = moved.iter().map(|it| it.mass()).sum();
                let momentum: Real = moved.iter().map(|it| it.mass() * it.linvel().y).sum();
                momentum / mass
            };
            let after = speed(&world);
            for _ in 0..2 {
                fields.step(&mut world).expect("a step");
                told.extend_from_slice(fields.warnings());
            }
            let dt = world.integration_parameters.dt;
            let share = (speed(&world) - after) / (g.y * 2.0 * dt);
            assert!((share - 1.0).abs() < 1e-3, "{scheme:?} {held}: {share}");
            let is_told = matches!(told[..], [StepWarning::MassChanged { body: of, before, after }]
                if of == body && (before / after - 125.0).abs() < 0.1);
            let applies = held || scheme == Scheme::ExternalForce;
            assert_eq!(
                is_told,
                applies && !recomputes,
                "{scheme:?} {held} {told:?}"
            );
            if !is_told {
                assert!(told.is_empty(), "{scheme:?} {held} {told:?}");
                let fell = world.bodies[body].linvel().y - before;
                let due = g.y * 3.0 * world.integration_parameters.dt;
                assert!(
                    (fell / due - 1.0).abs() < 0.02,
                    "{scheme:?} {held}: {fell} of {due}"
                );
            }
        }
    }
}

/// Changes of a collider that leave the mass of its body as it is are seen by the next step.
#[test]
fn a_collider_without_mass_is_sampled_as_it_has_become() {
    type Change = fn(&mut Collider);
    let changes: [(&str, Change); 4] = [
        ("a shape", |it| {
            it.set_shape(SharedShape::cuboid(0.2, 1.0, 0.2))
        }),
        ("a place", |it| {
            it.set_position_wrt_parent(Pose::from_translation(Vector::new(0.5, 0.25, 0.0)));
        }),
        ("a sensor", |it| it.set_sensor(true)),
        ("groups", |it| {
            it.set_collision_groups(InteractionGroups::none());
        }),
    ];
    for (what, change) in changes {
        let build = || {
            let mut world = PhysicsWorld::new();
            world.gravity = Vector::ZERO;
            let mass = MassProperties::new(Vector::ZERO, 2.0, Vector::splat(0.5));
            let body = RigidBodyBuilder::dynamic().additional_mass_properties(mass);
            let cuboid = ColliderBuilder::cuboid(0.5, 0.4, 0.3).density(0.0);
            let (body, collider) = world.insert(body.linvel(Vector::X * 0.1), cuboid);
            let push = Field::uniform(Vector::Z * 3.0).within(Region::half_space(Vector::X, 0.1));
            let fields = Fields::new(push.groups(InteractionGroups::all())).expect("a valid tree");
            (world, fields, body, collider)
        };
        let run = |change: Option<Change>, anew: bool| {
            let (mut world, mut fields, body, collider) = build();
            for _ in 0..3 {
                fields.step(&mut world).expect("a step");
            }
            if let Some(change) = change {
                change(&mut world.colliders[collider]);
            }
            if anew {
                fields = build().1;
            }
            fields.step(&mut world).expect("a step");
            let body = &world.bodies[body];
            [body.linvel(), body.angvel()]
        };
        let [kept, anew, unchanged] = [(Some(change), false), (Some(change), true), (None, false)]
            .map(|(change, anew)| run(change, anew));
        assert_ne!(kept, unchanged, "{what}");
        assert_eq!(kept, anew, "{what}");
    }
}
