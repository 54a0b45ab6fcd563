//! The cross-check with Rapier: what it compares, and what it counts.

mod mutants;
mod obstacles;
mod touches;
mod tricks;

use rapier3d_fields::cross_check::{ContactCounts, CrossCheck, CrossCheckReport, Difference};
use rapier3d_fields::math::{InteractionGroups, Real, Vector, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::collide::*;
use crate::support::{assert_at_most, assert_close, either};

fn report(fields: &Fields) -> &CrossCheckReport {
    fields.cross_check().expect("it is on")
}

/// Fails unless fields and Rapier found the same contacts, up to rounding.
#[track_caller]
fn assert_agrees(report: &CrossCheckReport) {
    assert_eq!(report.total.disagreed(), 0, "{:?}", report.disagreements);
    assert_at_most(to_f64(report.depth_error), either(4e-6, 8e-15), "depth");
    assert_at_most(to_f64(report.point_error), either(4e-6, 8e-15), "point");
    assert_at_most(to_f64(report.normal_error), either(8e-6, 2e-14), "normal");
}

#[test]
fn the_cross_check_is_off_by_default() {
    let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
    let mut fields = detect(&[&a, &b], ContactLaw::Observe);
    step(&mut fields, &mut world);
    assert!(fields.cross_check().is_none());
}

#[test]
fn contacts_are_counted_per_step_and_in_all() {
    let mut world = still_arena();
    let row = [0.0, 0.9, 1.8].map(|x| Vector::X * from_f64(x));
    let [a, b, c] = row.map(|place| ball(&mut world, 1.0, place, Vector::ZERO));
    let mut fields = cross_checked(&[&a, &b, &c], ContactLaw::Observe);
    assert_eq!(report(&fields), &CrossCheckReport::default());
    for steps in 1..=3 {
        step(&mut fields, &mut world);
        let report = report(&fields);
        assert_eq!((report.steps, report.last_step.both), (steps, 2));
        assert_eq!(report.total.both, 2 * steps);
    }
    world.remove_body(c.body);
    step(&mut fields, &mut world);
    let report = report(&fields);
    assert_eq!((report.last_step.both, report.total.both), (1, 7));
    assert_agrees(report);
}

/// Two tops that spin through each other without a response to contacts, fast for the length of a step.
fn spinning_pair(dt: f64, speed: f64) -> (PhysicsWorld, [Thing; 2]) {
    let mut world = arena(from_f64(dt));
    let speed = from_f64(speed);
    let things = [-0.9, 0.9].map(|x| {
        let spin = Vector::new(from_f64(x), 2.0, -1.0) * speed;
        let body = RigidBodyBuilder::dynamic().translation(Vector::X * from_f64(x));
        asymmetric(&mut world, body.angvel(spin), 1.0)
    });
    unsolved(&mut world, &[&things[0], &things[1]]);
    (world, things)
}

#[test]
fn contacts_are_compared_at_the_same_poses() {
    let (mut world, [a, b]) = spinning_pair(1.0 / 60.0, 6.0);
    let mut fields = cross_checked(&[&a, &b], ContactLaw::Observe);
    let (mut changes, mut jump, mut last) = (0, 0.0_f64, Vec::new());
    for _ in 0..200 {
        step(&mut fields, &mut world);
        let now: Vec<_> = fields
            .contacts()
            .iter()
            .map(|c| (c.colliders, c.depth))
            .collect();
        let pairs = |list: &[(_, Real)]| list.iter().map(|c| c.0).collect::<Vec<[_; 2]>>();
        changes += usize::from(pairs(&now) != pairs(&last));
        let depth_of = |pair| last.iter().find(|c: &&(_, Real)| c.0 == pair);
        for (pair, depth) in &now {
            let before = depth_of(*pair).map_or(*depth, |c| c.1);
            jump = jump.max(to_f64((depth - before).abs()));
        }
        last = now;
    }
    println!(
        "{changes} changes, depths jump by {jump}, {:?}",
        report(&fields)
    );
    // At poses one step off, pairs would be missed and depths be wrong by this much.
    assert!(changes > 40 && jump > 0.1, "{changes} changes, jump {jump}");
    assert!(report(&fields).total.both > 100);
    assert_agrees(report(&fields));
}

/// The report on slowly turning tops in a world that recycles contacts, which the check allows if `on`.
fn with_recycling(on: bool) -> CrossCheckReport {
    let (mut world, [a, b]) = spinning_pair(1.0 / 240.0, 0.1);
    world.integration_parameters.contact_recycling = true;
    // A hook claims the contacts that fields resolve, and Rapier recycles no contact that has one. So here
    // Rapier finds the contacts itself, and solves none of them.
    for (_, collider) in world.colliders.iter_mut() {
        collider.set_solver_groups(InteractionGroups::none());
    }
    let tree = touch(parts(&[&a, &b]), ContactLaw::Observe);
    let check = if on {
        CrossCheck::all().let_recycle()
    } else {
        CrossCheck::all()
    };
    let mut fields = Fields::builder(tree)
        .cross_check(check)
        .responder(Responder::Both)
        .build()
        .expect("a valid tree");
    for _ in 0..4000 {
        step(&mut fields, &mut world);
    }
    report(&fields).clone()
}

#[test]
fn recycled_contacts_are_reported_as_not_comparable() {
    let stale = with_recycling(true);
    println!(
        "recycling: {:?}, depth error {}",
        stale.total, stale.depth_error
    );
    assert!(stale.recycling);
    // Recycled contacts may be 0.05 out of date, so they are neither agreement nor disagreement.
    let counts = &stale.total;
    assert!(counts.not_comparable.recycled > 1000, "{counts:?}");
    assert_eq!((counts.both, counts.disagreed()), (0, 0), "{counts:?}");
    let live = with_recycling(false);
    assert!(
        !live.recycling && live.total.both > 1000,
        "{:?}",
        live.total
    );
    assert_agrees(&live);
}

/// Asserts that both sides find the same `both` contacts after a `change` to a world with a touching pair.
#[track_caller]
fn assert_follows(change: impl Fn(&mut PhysicsWorld, &[Thing; 2]), both: u64) {
    let (mut world, things) = overlapping([Vector::ZERO; 2], [1.0; 2]);
    let mut fields = cross_checked(&[&things[0], &things[1]], ContactLaw::Observe);
    for _ in 0..2 {
        step(&mut fields, &mut world);
    }
    change(&mut world, &things);
    for _ in 0..2 {
        step(&mut fields, &mut world);
        assert_eq!(report(&fields).last_step.both, both);
        assert_agrees(report(&fields));
    }
    assert_eq!(report(&fields).steps, 4);
}

#[test]
fn changes_of_bodies_between_steps_are_no_disagreement() {
    let move_to = |place: Vector| {
        move |world: &mut PhysicsWorld, things: &[Thing; 2]| {
            world.bodies[things[1].body].set_translation(place, true);
        }
    };
    assert_follows(move_to(Vector::X * 3.0), 0);
    assert_follows(move_to(Vector::new(0.25, 0.5, 0.0)), 1);
    assert_follows(
        |world, things| world.bodies[things[0].body].set_linvel(Vector::Y, true),
        1,
    );
    assert_follows(|world, things| drop(world.remove_body(things[0].body)), 0);
    assert_follows(
        |world, _| drop(ball(world, 1.0, Vector::Y * 0.5, Vector::ZERO)),
        3,
    );
}

#[test]
fn changes_of_colliders_between_steps_are_no_disagreement() {
    let grow = |radius: Real| {
        move |world: &mut PhysicsWorld, things: &[Thing; 2]| {
            world.colliders[things[1].parts[0]].set_shape(SharedShape::ball(radius));
        }
    };
    assert_follows(grow(0.25), 0);
    assert_follows(grow(0.75), 1);
    let disable = |world: &mut PhysicsWorld, things: &[Thing; 2]| {
        world.colliders[things[1].parts[0]].set_enabled(false);
    };
    assert_follows(disable, 0);
}

#[test]
fn explicit_begin_and_finish_give_the_same_report() {
    let (mut world, [a, b]) = spinning_pair(1.0 / 60.0, 6.0);
    let (mut own, _) = spinning_pair(1.0 / 60.0, 6.0);
    let mut fields = cross_checked(&[&a, &b], ELASTIC);
    let mut explicit = cross_checked(&[&a, &b], ELASTIC);
    for _ in 0..100 {
        step(&mut fields, &mut world);
        let open = explicit.begin(WorldMut::from(&mut own));
        let open = open.expect("a beginning");
        own.step_with_events(&open.hooks(&()), &());
        let end = explicit.finish(open, WorldMut::from(&mut own));
        end.expect("an end");
        assert_eq!(report(&explicit), report(&fields));
    }
    assert!(report(&fields).total.both > 0);
}

#[test]
fn the_band_is_32_half_units_in_the_last_place() {
    let ulp = to_f64(Real::EPSILON);
    for (far, size) in [(0.0, 1.0), (5.0, 1.0), (1000.0, 0.5)] {
        let point = Vector::new(0.6, 0.0, -0.8) * from_f64(far);
        let band = to_f64(CrossCheckReport::band(point, from_f64(size)));
        let expected = 16.0 * ulp * (far + size);
        assert_close(band / expected, 1.0, 4.0 * ulp, "band");
    }
}

#[test]
fn contacts_that_only_fields_find_are_listed() {
    let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
    for hidden in [&a, &b] {
        unseen(&mut world, hidden);
    }
    let mut fields = cross_checked(&[&a, &b], ContactLaw::Observe);
    step(&mut fields, &mut world);
    let report = report(&fields);
    let expected = (report.last_step.only_field, report.last_step.disagreed());
    assert_eq!(expected, (1, 1));
    let [listed] = report.disagreements[..] else {
        panic!("{report:?}")
    };
    assert_eq!(listed.colliders, [a.parts[0], b.parts[0]]);
    let Difference::OnlyField { depth } = listed.difference else {
        panic!("{listed:?}")
    };
    assert_close(to_f64(depth), 0.1, rounding(), "depth");
    assert_eq!(report.first, Some(listed));
    assert_eq!(listed.band, CrossCheckReport::band(Vector::ZERO, 1.0));
}

#[test]
fn contacts_that_only_rapier_finds_are_listed_until_they_end() {
    let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
    let mut fields = cross_checked(&[&a, &b], ELASTIC);
    // The fields look at a part that is smaller than it is for Rapier.
    let part = a.parts[0];
    let ball = |radius| {
        move |world: &mut PhysicsWorld| {
            world.colliders[part].set_shape(SharedShape::ball(radius));
        }
    };
    ball(0.3)(&mut world);
    mutants::step_changed(&mut fields, &mut world, ball(0.5));
    let Difference::OnlyRapier { depth } = report(&fields).disagreements[0].difference else {
        panic!("{:?}", report(&fields))
    };
    assert_close(to_f64(depth), 0.1, rounding(), "depth");
    world.bodies[b.body].set_translation(Vector::X * 5.0, true);
    step(&mut fields, &mut world);
    let report = report(&fields);
    assert_eq!(
        (report.total.only_rapier, report.disagreements.len()),
        (1, 0)
    );
    assert_eq!(report.last_step, ContactCounts::default());
}

#[test]
fn contacts_too_shallow_to_compare_are_counted_apart() {
    let depth = 2.0 * Real::EPSILON;
    let mut world = still_arena();
    let [a, b] = [0.0, 1.0 - depth].map(|x| ball(&mut world, 1.0, Vector::X * x, Vector::ZERO));
    for hidden in [&a, &b] {
        unseen(&mut world, hidden);
    }
    let mut fields = cross_checked(&[&a, &b], ContactLaw::Observe);
    step(&mut fields, &mut world);
    let report = report(&fields);
    assert_eq!((report.total.within_band, report.total.disagreed()), (1, 0));
    assert!(report.disagreements.is_empty());
}

#[test]
fn only_chosen_pairs_are_checked_and_disagreements_are_reported_at_once() {
    use std::sync::{Arc, Mutex};
    let mut world = still_arena();
    let row = [0.0, 0.9, 1.8].map(|x| Vector::X * from_f64(x));
    let [a, b, c] = row.map(|place| ball(&mut world, 1.0, place, Vector::ZERO));
    for hidden in [&a, &b, &c] {
        unseen(&mut world, hidden);
    }
    let told = Arc::new(Mutex::new(Vec::new()));
    let list = Arc::clone(&told);
    let check = CrossCheck::pairs([(b.parts[0], a.parts[0])])
        .on_disagreement(move |found| list.lock().expect("a list").push(*found));
    let tree = touch(parts(&[&a, &b, &c]), ContactLaw::Observe);
    let mut fields = Fields::builder(tree)
        .cross_check(check)
        .build()
        .expect("a valid tree");
    for _ in 0..3 {
        assert_eq!(step(&mut fields, &mut world), 2);
    }
    let told = told.lock().expect("a list");
    assert_eq!(told.iter().map(|d| d.step).collect::<Vec<_>>(), [1, 2, 3]);
    assert!(
        told.iter().all(|d| d.colliders == [a.parts[0], b.parts[0]]),
        "{told:?}"
    );
    assert_eq!(report(&fields).total.only_field, 3);
}

/// Two bouncing balls meet at 1 m/s each.
#[test]
fn the_report_tells_whether_fields_or_rapier_resolved_a_contact() {
    let answers = |responder: Responder| {
        let mut world = arena(1.0 / 60.0);
        let [a, b] = [-1.0, 1.0].map(|side| {
            let side = from_f64(side);
            let thing = ball(&mut world, 1.0, Vector::X * side, -Vector::X * side);
            let collider = &mut world.colliders[thing.parts[0]];
            collider.set_restitution(1.0);
            collider.set_restitution_combine_rule(CoefficientCombineRule::Max);
            thing
        });
        let tree = touch(parts(&[&a, &b]), ContactLaw::elastic());
        let builder = Fields::builder(tree).responder(responder);
        let mut fields = builder.cross_check(true).build().expect("a valid tree");
        for _ in 0..120 {
            step(&mut fields, &mut world);
        }
        report(&fields).answers
    };
    let fields = answers(Responder::Fields);
    assert_eq!(
        (fields.by_fields.contacts, fields.by_rapier.contacts),
        (1, 0)
    );
    // From two metres a second towards each other to two apart.
    assert_close(fields.by_fields.velocity_change, 4.0, 1e-5, "by the fields");
    let rapier = answers(Responder::Rapier);
    assert_eq!(rapier.by_fields.contacts, 0);
    assert!(rapier.by_rapier.velocity_change > 1.9, "{rapier:?}");
    let both = answers(Responder::Both);
    let change = both.by_fields.velocity_change + both.by_rapier.velocity_change;
    assert!(
        change > 3.9,
        "who is turned back is turned by somebody: {both:?}"
    );
}

#[test]
fn disagreements_of_all_kinds_are_counted() {
    let mut report = CrossCheckReport::default();
    let total = &mut report.total;
    (total.only_field, total.only_rapier) = (1, 2);
    (total.depth, total.normal, total.point) = (4, 8, 16);
    report.touches.disagreed = 32;
    assert_eq!(report.disagreed(), 63);
}

#[test]
fn only_a_check_of_all_pairs_without_options_is_plain() {
    let none = || CrossCheck::pairs([]);
    assert!(CrossCheck::from(true).is_plain());
    assert!(!CrossCheck::from(false).is_plain());
    assert!(!none().is_plain());
    assert!(!CrossCheck::from(true).let_recycle().is_plain());
}
