//! Pairs that cannot be compared are counted as such, by their reason, and never as agreement.

use rapier3d_fields::cross_check::{ContactCounts, NotComparable};
use rapier3d_fields::math::Vector;
use rapier3d_fields::prelude::*;

use super::mutants::step_changed;
use super::report;
use crate::support::collide::*;

/// Fails unless a step of two overlapping balls counts this reason once and nothing else.
#[track_caller]
fn assert_reason(counts: &ContactCounts, reason: impl Fn(&NotComparable) -> u64) {
    assert_eq!(reason(&counts.not_comparable), 1, "{counts:?}");
    assert_eq!(counts.not_comparable.total(), 1, "{counts:?}");
    let found = (counts.both, counts.within_band, counts.disagreed());
    assert_eq!(found, (0, 0, 0), "{counts:?}");
}

/// The counts of a step after a change of the world.
fn counted(law: ContactLaw, change: impl Fn(&mut PhysicsWorld, [&Thing; 2])) -> ContactCounts {
    let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
    change(&mut world, [&a, &b]);
    let mut fields = cross_checked(&[&a, &b], law);
    step(&mut fields, &mut world);
    report(&fields).last_step
}

#[test]
fn several_passes_of_continuous_detection_are_not_comparable() {
    let counts = counted(ELASTIC, |world, _| {
        world.integration_parameters.max_ccd_substeps = 2;
    });
    assert_reason(&counts, |it| it.ccd_substeps);
}

#[test]
fn pairs_on_joints_without_contacts_are_not_comparable() {
    let counts = counted(ELASTIC, |world, [a, b]| {
        let joint = FixedJointBuilder::new().contacts_enabled(false);
        world.impulse_joints.insert(a.body, b.body, joint, true);
    });
    assert_reason(&counts, |it| it.jointed);
}

#[test]
fn pairs_with_a_sensor_are_not_comparable() {
    let counts = counted(ELASTIC, |world, [a, _]| {
        world.colliders[a.parts[0]].set_sensor(true);
    });
    assert_reason(&counts, |it| it.sensor);
}

#[test]
fn sleeping_pairs_are_not_comparable() {
    let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
    let mut fields = cross_checked(&[&a, &b], ContactLaw::Observe);
    step(&mut fields, &mut world);
    assert_eq!(report(&fields).last_step.both, 1);
    for thing in [&a, &b] {
        world.bodies[thing.body].sleep();
    }
    step(&mut fields, &mut world);
    assert_reason(&report(&fields).last_step, |it| it.asleep);
}

#[test]
fn bodies_moved_or_removed_while_a_step_is_open_are_not_comparable() {
    let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
    let mut fields = cross_checked(&[&a, &b], ContactLaw::Observe);
    step_changed(&mut fields, &mut world, |world| {
        let nearer = world.bodies[b.body].translation() * 0.9;
        world.bodies[b.body].set_translation(nearer, true);
    });
    assert_reason(&report(&fields).last_step, |it| it.moved);
    step_changed(&mut fields, &mut world, |world| {
        world.remove_body(b.body);
    });
    assert_reason(&report(&fields).last_step, |it| it.removed);
}

struct Blind;

impl PhysicsHooks for Blind {
    fn filter_contact_pair(&self, _: &PairFilterContext<'_>) -> Option<SolverFlags> {
        None
    }
}

#[test]
fn pairs_that_a_users_hooks_hide_are_not_comparable() {
    for law in [ContactLaw::Observe, ELASTIC] {
        let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
        world.colliders[a.parts[0]].set_active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS);
        let mut fields = cross_checked(&[&a, &b], law);
        fields.step_with(&mut world, &Blind, &()).expect("a step");
        assert_reason(&report(&fields).last_step, |it| it.hidden);
    }
}

#[test]
fn pairs_outside_the_region_of_their_fields_are_not_comparable() {
    let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
    let nowhere = Region::ball(0.25).at(Vector::Y * 9.0);
    let blind = |thing: &Thing| {
        let field = Field::contact(ELASTIC).at(thing.parts[0]);
        field.within(nowhere.clone())
    };
    let builder = Fields::builder(blind(&a).sum_union(blind(&b)));
    let mut fields = builder.cross_check(true).build().expect("a valid tree");
    step(&mut fields, &mut world);
    assert_reason(&report(&fields).last_step, |it| it.masked);
}

#[test]
fn reasons_are_printed() {
    let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
    world.integration_parameters.max_ccd_substeps = 2;
    let mut fields = cross_checked(&[&a, &b], ELASTIC);
    step(&mut fields, &mut world);
    let printed = report(&fields).to_string();
    assert!(printed.contains("not comparable        1"), "{printed}");
    assert!(printed.contains("several passes"), "{printed}");
}
