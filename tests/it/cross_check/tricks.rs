//! Contacts that users change by skins, hooks, groups, edits and joints: each is reported as what it is, none as a
//! disagreement of the fields.

use rapier3d_fields::cross_check::{CrossCheckReport, Difference};
use rapier3d_fields::math::{Real, Vector, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use super::mutants::{MADE, Made, step_changed};
use super::report;
use crate::support::collide::*;

/// A part that falls on a ground and comes to rest there, with a contact field on both.
struct Drop {
    world: PhysicsWorld,
    fields: Fields,
    part: ColliderHandle,
    ground: ColliderHandle,
}

impl Drop {
    fn new(made: Made, law: ContactLaw, detection: Detection) -> Self {
        let mut world = arena(from_f64(1.0 / 60.0));
        world.gravity = Vector::Y * -9.81;
        let ground = ColliderBuilder::cuboid(5.0, 0.5, 5.0).translation(Vector::Y * -0.5);
        let ground = world.colliders.insert(ground);
        let turn = Vector::new(0.1, 0.3, -0.2);
        let thing = made.insert(&mut world, Vector::Y * 0.9, turn);
        let tree = touch([thing.parts[0], ground], law);
        let builder = Fields::builder(tree).detection(detection);
        Drop {
            world,
            fields: builder.cross_check(true).build().expect("a valid tree"),
            part: thing.parts[0],
            ground,
        }
    }

    fn colliders(&mut self) -> [&mut Collider; 2] {
        let [part, ground] = [self.part, self.ground];
        let (one, two) = self.world.colliders.get_pair_mut(part, ground);
        [one.expect("the part"), two.expect("the ground")]
    }

    fn run(&mut self, hooks: &dyn PhysicsHooks, steps: usize) -> &CrossCheckReport {
        for _ in 0..steps {
            let stepped = self.fields.step_with(&mut self.world, hooks, &());
            stepped.expect("a step");
            let warnings = self.fields.warnings();
            let forgotten = warnings.contains(&StepWarning::HooksNotGiven);
            assert!(!forgotten, "{warnings:?}");
        }
        report(&self.fields)
    }
}

fn drops() -> impl Iterator<Item = (String, Drop)> {
    let resting = ContactLaw::restitution(0.3);
    let laws = [ContactLaw::Observe, resting];
    let each = MADE.into_iter().flat_map(move |made| {
        let detections = [Detection::Discrete, Detection::Swept];
        let each = detections.into_iter();
        each.flat_map(move |it| laws.map(|law| (made, law, it)))
    });
    each.map(|(made, law, detection)| {
        let name = format!("{made:?} {law:?} {detection:?}");
        (name, Drop::new(made, law, detection))
    })
}

/// Fails unless a contact lasted, and nothing differs.
#[track_caller]
fn assert_holds(name: &str, found: &CrossCheckReport) {
    println!("{name}\n{found}");
    assert_eq!(found.disagreed(), 0, "{name}\n{found}");
    // A contact that Rapier holds may touch without overlap.
    let lasting = found.total.both + found.answers.by_rapier.contacts;
    assert!(lasting > 20, "{name}\n{found}");
}

/// Before, each resting contact of a box of unequal `contact_skin`, or on a ground with one, was reported
/// as "other point", up to 135 bands off: the fields took the middle of the surfaces for that of the skins.
#[test]
fn contact_skins_that_differ_are_no_disagreement() {
    for skins in [[0.02, 0.0], [0.0, 0.02], [0.01, 0.05], [0.3, 0.1]] {
        for (name, mut drop) in drops() {
            for (collider, skin) in drop.colliders().into_iter().zip(skins) {
                collider.set_contact_skin(from_f64(skin));
            }
            assert_holds(&format!("{name} {skins:?}"), drop.run(&(), 90));
        }
    }
}

/// Turns on the modification of solver contacts for the part.
fn hooked(drop: &mut Drop) {
    let [part, _] = drop.colliders();
    part.set_active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
}

struct Modify<F>(F);

impl<F: Fn(&mut ContactModificationContext<'_>) + Sync + Send> PhysicsHooks for Modify<F> {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        (self.0)(context);
    }
}

/// Before, 169 of 169 contacts of a hook that flips Rapier's normal were counted as "as deep in another direction":
/// only the normal of the fields was read.
#[test]
fn a_hook_that_flips_the_normal_of_rapier_is_a_disagreement_of_normals() {
    let flip = Modify(|context: &mut ContactModificationContext<'_>| {
        if let Some(manifold) = context.rigid_mut() {
            *manifold.normal = -*manifold.normal;
        }
    });
    for made in MADE {
        let mut world = still_arena();
        let turn = Vector::new(0.2, -0.1, 0.3);
        let places = [Vector::ZERO, Vector::new(0.6, 0.1, 0.05)];
        let things = [0, 1].map(|i| made.insert(&mut world, places[i], turn * i as Real));
        let part = &mut world.colliders[things[0].parts[0]];
        part.set_active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
        let mut fields = cross_checked(&[&things[0], &things[1]], ContactLaw::Observe);
        for steps in 1..=5 {
            fields.step_with(&mut world, &flip, &()).expect("a step");
            let found = report(&fields);
            assert_eq!(found.total.normal, steps, "{made:?}\n{found}");
            assert_eq!(found.total.ambiguous, 0, "{made:?}\n{found}");
            let is_normal = |it: &Difference| matches!(it, Difference::Normal { .. });
            let listed = found.disagreements.iter();
            assert!(
                listed.clone().any(|it| is_normal(&it.difference)),
                "{found}"
            );
        }
    }
}

/// Rapier has found a contact even if a hook removes it; the solver's points that a hook moves are no finding.
#[test]
fn hooks_that_remove_or_move_contacts_are_no_disagreement() {
    let remove = Modify(|context: &mut ContactModificationContext<'_>| {
        if let Some(manifold) = context.rigid_mut() {
            manifold.solver_contacts.clear();
        }
    });
    let shift = Modify(|context: &mut ContactModificationContext<'_>| {
        if let Some(manifold) = context.rigid_mut() {
            for contact in manifold.solver_contacts.iter_mut() {
                contact.anchor1 += Vector::X * 0.1;
                contact.anchor2 += Vector::X * 0.1;
            }
        }
    });
    // Without contacts the part sinks into the ground, not yet so deep that the nearest way out is another.
    let hooks: [(&dyn PhysicsHooks, usize); 2] = [(&remove, 24), (&shift, 60)];
    for (hooks, steps) in hooks {
        for made in MADE {
            let mut drop = Drop::new(made, ContactLaw::Observe, Detection::Discrete);
            hooked(&mut drop);
            let found = drop.run(hooks, steps);
            println!("{made:?}\n{found}");
            assert_eq!(found.disagreed(), 0, "{made:?}\n{found}");
            assert!(found.total.both > 0, "{made:?}\n{found}");
        }
    }
}

/// A one-way platform: the part rises through it from below, and falls back on it.
#[test]
fn a_one_way_platform_is_no_disagreement() {
    let one_way = Modify(|context: &mut ContactModificationContext<'_>| {
        context.update_as_oneway_platform(-Vector::Y, from_f64(0.2));
    });
    for (name, mut drop) in drops() {
        hooked(&mut drop);
        let body = body(&mut drop.world, drop.part);
        body.set_translation(Vector::Y * -2.0, true);
        body.set_linvel(Vector::Y * 8.0, true);
        let found = drop.run(&one_way, 90);
        println!("{name}\n{found}");
        assert_eq!(found.disagreed(), 0, "{name}\n{found}");
        let seen = found.total.both + found.touches.total();
        assert!(seen > 0, "{name}\n{found}");
    }
}

#[test]
fn solver_groups_that_keep_rapier_from_answering_are_no_disagreement() {
    for (name, mut drop) in drops() {
        for collider in drop.colliders() {
            collider.set_solver_groups(InteractionGroups::none());
        }
        let found = drop.run(&(), 24);
        println!("{name}\n{found}");
        assert_eq!(found.disagreed(), 0, "{name}\n{found}");
        let seen = found.total.both + found.touches.total();
        assert!(seen > 0, "{name}\n{found}");
    }
}

/// A user's edits of a part that rests on a ground.
type Edit = fn(&mut PhysicsWorld, [ColliderHandle; 2]);

const EDITS: [(&str, Edit); 11] = [
    ("a sensor", |world, [part, _]| {
        world.colliders[part].set_sensor(true);
    }),
    ("disabled", |world, [part, _]| {
        world.colliders[part].set_enabled(false);
    }),
    ("disabled body", |world, [part, _]| {
        body(world, part).set_enabled(false);
    }),
    ("put elsewhere", |world, [part, _]| {
        body(world, part).set_translation(Vector::Y * 4.0, true);
    }),
    ("put a little higher", |world, [part, _]| {
        let body = body(world, part);
        body.set_translation(body.translation() + Vector::Y * 0.05, true);
    }),
    ("fixed", |world, [part, _]| {
        body(world, part).set_body_type(RigidBodyType::Fixed, true);
    }),
    ("asleep", |world, [part, _]| body(world, part).sleep()),
    ("smaller", |world, [part, _]| {
        world.colliders[part].set_shape(SharedShape::ball(0.01));
    }),
    ("of no group", |world, [part, _]| {
        world.colliders[part].set_collision_groups(InteractionGroups::none());
    }),
    ("without collision types", |world, both| {
        for collider in both {
            let types = ActiveCollisionTypes::empty();
            world.colliders[collider].set_active_collision_types(types);
        }
    }),
    ("removed", |world, [part, _]| {
        let handle = world.colliders[part].parent().expect("a body");
        world.remove_body(handle);
    }),
];

fn body(world: &mut PhysicsWorld, part: ColliderHandle) -> &mut RigidBody {
    let handle = world.colliders[part].parent().expect("a body");
    &mut world.bodies[handle]
}

/// Before, `HooksNotGiven` was raised in steps that were given the hooks, after a user had ended a contact that Rapier
/// held: it was derived from the contacts held before the step.
#[test]
fn edits_are_not_taken_for_hooks_that_were_forgotten() {
    for (edit, change) in EDITS {
        for detection in [Detection::Discrete, Detection::Swept] {
            for made in MADE {
                let name = format!("{edit}, {made:?} {detection:?}");
                let resting = || {
                    let mut drop = Drop::new(made, ContactLaw::restitution(0.3), detection);
                    drop.run(&(), 90);
                    drop
                };
                let mut drop = resting();
                change(&mut drop.world, [drop.part, drop.ground]);
                let found = drop.run(&(), 3);
                // Fields ignore collision types.
                if edit != "without collision types" {
                    assert_eq!(found.disagreed(), 0, "{name}\n{found}");
                }
                let mut drop = resting();
                let both = [drop.part, drop.ground];
                let Drop { world, fields, .. } = &mut drop;
                step_changed(fields, world, |world| change(world, both));
                let warnings = fields.warnings();
                let forgotten = warnings.contains(&StepWarning::HooksNotGiven);
                assert!(!forgotten, "{name}, within the step: {warnings:?}");
            }
        }
    }
}

/// A joint without contacts between two parts, inserted between two steps.
#[test]
fn a_new_joint_without_contacts_is_counted_as_jointed() {
    for detection in [Detection::Discrete, Detection::Swept] {
        let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
        let tree = touch(parts(&[&a, &b]), ContactLaw::restitution(0.3));
        let builder = Fields::builder(tree).detection(detection);
        let mut fields = builder.cross_check(true).build().expect("a valid tree");
        step(&mut fields, &mut world);
        let joint = FixedJointBuilder::new().contacts_enabled(false);
        world.impulse_joints.insert(a.body, b.body, joint, true);
        step(&mut fields, &mut world);
        let found = report(&fields);
        assert_eq!(found.last_step.not_comparable.jointed, 1, "{found}");
        assert_eq!(found.disagreed(), 0, "{found}");
        assert!(fields.warnings().is_empty(), "{:?}", fields.warnings());
    }
}

/// A part that is moved while a step is open is counted as moved.
#[test]
fn a_body_moved_while_a_step_is_open_is_counted_as_moved() {
    for made in MADE {
        let mut drop = Drop::new(made, ContactLaw::restitution(0.3), Detection::Discrete);
        drop.run(&(), 90);
        let handle = drop.world.colliders[drop.part].parent().expect("a body");
        let Drop { world, fields, .. } = &mut drop;
        step_changed(fields, world, |world| {
            let place = world.bodies[handle].translation() - Vector::Y * 0.01;
            world.bodies[handle].set_translation(place, true);
        });
        let counts = report(fields).last_step;
        assert_eq!(counts.not_comparable.moved, 1, "{made:?} {counts:?}");
        assert_eq!(counts.disagreed(), 0, "{made:?} {counts:?}");
        assert!(to_f64(world.bodies[handle].linvel().length()).is_finite());
    }
}
