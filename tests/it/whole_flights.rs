//! Whole flights from the first moment on, many steps before they touch: detection and motion
//! together, against the table itself.
//!
//! The bound for rounding is derived: in each of Rapier's iterations within a step a centre gains half a rounding of
//! its position and of its attitude, and its velocity is off by a rounding all the time. That distance, over the speed
//! of approach, is a time.

use rapier3d_fields::contact::FieldContact;
use rapier3d_fields::math::{Real, from_f64, to_dvec3};
use rapier3d_fields::prelude::*;

use crate::support::collide::*;
use crate::support::either;
use crate::support::flight::*;

const EPSILON: f64 = Real::EPSILON as f64;

/// The distance by which rounding may displace a pair until `time`.
fn drift(case: &Case, dt: f64, time: f64) -> f64 {
    let steps = time / dt + 2.0;
    let of = |flight: &Flight| {
        let far = flight.position.length() + (flight.velocity * time).length();
        let reach = flight.spheres.iter().map(|it| it.0.length());
        let reach = reach.fold(0.0, f64::max);
        // In each step the angular momentum gains some roundings, and with it all further turning.
        let turned = 2.0 * steps * flight.angvel().length() * time * reach;
        4.0 * steps * 0.5 * EPSILON * (far + 2.0 * reach)
            + EPSILON * (flight.velocity.length() * time + turned)
    };
    let start = EPSILON
        * case
            .flights
            .iter()
            .map(|it| it.position.length())
            .sum::<f64>();
    start + case.flights.iter().map(of).sum::<f64>()
}

/// The first touch of a pair in a world.
fn fly(case: &Case, dt: f64) -> Option<FieldContact> {
    let mut world = arena(from_f64(dt));
    let things = case.flights.each_ref();
    let things = things.map(|it| insert_flight(&mut world, it, from_f64(case.restitution)));
    let law = ContactLaw::restitution(from_f64(case.restitution));
    let tree = touch(parts(&[&things[0], &things[1]]), law);
    let builder = Fields::builder(tree).detection(Detection::Swept);
    let mut fields = builder.build().expect("a valid tree");
    let last = if case.hit {
        case.toi + 2.0 * dt
    } else {
        case.end
    };
    for _ in 0..(last / dt).ceil() as usize {
        fields.step(&mut world).expect("a step");
        let mut contacts = fields.contacts().iter();
        if let Some(contact) = contacts.find(|it| it.time_of_impact.is_some()) {
            return Some(*contact);
        }
    }
    None
}

fn check(cases: &[Case], dt: f64) {
    let (mut worst, mut wrong) = ([0.0_f64; 4], Vec::new());
    for case in cases {
        let found = fly(case, dt);
        let drift = drift(case, dt, if case.hit { case.toi } else { case.end });
        let at = case.flights.each_ref().map(|it| it.after(case.toi));
        match (found, case.hit) {
            (None, false) => {}
            (Some(_), false) if case.gap <= drift => {}
            (Some(_), false) => wrong.push(format!("{} is invented", case.number)),
            (None, true) => {
                // How deep the flights overlap, if nothing answers.
                let deep = deepest_before(&at, 4.0 * dt);
                if deep > drift {
                    wrong.push(format!("{} is missed, {deep:e} deep", case.number));
                }
            }
            (Some(contact), true) => {
                let impact = Impact::of(&at, &nearest(&at), case.restitution);
                let time = contact.time_of_impact.expect("a time");
                let off = (time - case.toi).abs();
                let distance = off * impact.approach.abs();
                let impulse = to_dvec3(contact.impulses[1]) - case.normal * case.impulse;
                let scale = impact.speed_scale(&at);
                let velocity = impact.velocity_error(&at, impulse) / scale;
                // Lateness turns the normal of a pair that passes by: by drift/size times speed over approach.
                let graze = scale / impact.approach.abs();
                let bent = 4.0 * graze * drift / case.size + 100.0 * EPSILON;
                let errors = [off / dt, distance / drift, velocity, velocity / bent];
                let tight = either(f64::MAX, 1e-6);
                // At a graze the time is ill-defined, the distance is not.
                let moment = if graze > 100.0 { f64::MAX } else { tight };
                let bounds = [moment, 1.0, tight, 1.0];
                for (worst, error) in worst.iter_mut().zip(errors) {
                    *worst = worst.max(error);
                }
                if errors
                    .iter()
                    .zip(bounds)
                    .any(|(error, bound)| *error > bound)
                {
                    wrong.push(format!("{}: {errors:?}, graze {graze}", case.number));
                }
            }
        }
    }
    println!(
        "dt {dt:e}: time off by {:.1e} steps at most, {:.1e} of what rounding may do; velocity by {:.1e}, \
         {:.1e} of what rounding may do",
        worst[0], worst[1], worst[2], worst[3],
    );
    assert!(wrong.is_empty(), "dt {dt:e}: {wrong:#?}");
}

#[test]
fn spheres_fly_to_where_the_table_says() {
    check(&spheres(), 1e-3);
    check(&spheres(), 1e-2);
}

#[test]
fn molecules_fly_to_where_the_table_says() {
    check(&molecules(), 1e-3);
    check(&molecules(), 1e-2);
}
