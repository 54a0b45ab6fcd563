//! Touches of swept detection beside Parry's cast.

use rapier3d_fields::TouchCounts;
use rapier3d_fields::math::{Vector, from_f64};
use rapier3d_fields::prelude::*;

use super::mutants::{MADE, Made};
use super::report;
use crate::support::collide::*;
use crate::support::either;

/// Two parts that fly at each other without turning, and meet in the first step at `speed`.
fn shot(made: Made, speed: f64, aside: f64) -> (PhysicsWorld, Fields) {
    let mut world = arena(from_f64(0.1));
    let place = Vector::new(2.0, from_f64(aside), 0.1);
    let things = [Vector::ZERO, place].map(|place| made.insert(&mut world, place, Vector::ZERO));
    world.bodies[things[1].body].set_linvel(Vector::X * from_f64(-speed), true);
    let tree = touch(parts(&[&things[0], &things[1]]), ELASTIC);
    let builder = Fields::builder(tree).detection(Detection::Swept);
    let fields = builder.cross_check(true).build().expect("a valid tree");
    (world, fields)
}

fn touches(made: Made, speed: f64, aside: f64) -> TouchCounts {
    let (mut world, mut fields) = shot(made, speed, aside);
    step(&mut fields, &mut world);
    assert_eq!(
        report(&fields).disagreed(),
        0,
        "{made:?}\n{}",
        report(&fields)
    );
    report(&fields).touches
}

#[test]
fn the_time_of_a_touch_is_that_of_a_cast() {
    for made in MADE {
        for aside in [0.0, 0.1, 0.3] {
            let found = touches(made, 14.0, aside);
            println!("{made:?}, {aside} aside: {found:?}");
            // A hull that was hit aside turns, and may hit again: that cannot be compared. Nor can
            // what Parry's cast does not bring to rounding in 64 bits.
            let missing = found.not_comparable;
            let unsettled = if cfg!(feature = "f64") {
                missing.unsettled
            } else {
                0
            };
            assert_eq!(
                (found.agreed + unsettled, found.disagreed),
                (1, 0),
                "{made:?}: {found:?}"
            );
            let other = missing.total() - unsettled;
            assert_eq!(other, missing.again, "{made:?}: {found:?}");
            let error = f64::from(found.time_error as f32);
            assert!(error < either(1e-4, 1e-9), "{made:?}: {found:?}");
        }
        assert_eq!(touches(made, 1.0, 0.0).total(), 0, "too slow to meet");
    }
}

#[test]
fn what_sampling_would_miss_is_counted() {
    for made in MADE {
        // Gone through: 8 in a step of parts that are at most 1.4 long. Or still inside.
        assert_eq!(touches(made, 80.0, 0.1).missed_by_sampling, 1, "{made:?}");
        assert_eq!(touches(made, 14.0, 0.1).missed_by_sampling, 0, "{made:?}");
    }
}

#[test]
fn discrete_detection_has_no_touches() {
    let (mut world, things) = overlapping([Vector::X, Vector::ZERO], [1.0; 2]);
    let mut fields = cross_checked(&[&things[0], &things[1]], ELASTIC);
    step(&mut fields, &mut world);
    assert_eq!(report(&fields).touches, TouchCounts::default());
}

#[test]
fn a_way_that_is_bent_is_not_compared() {
    let (mut world, mut fields) = shot(Made::Ball, 14.0, 0.0);
    world.gravity = Vector::new(0.0, -30.0, 0.0);
    world.bodies.iter_mut().for_each(|(handle, body)| {
        let falls = handle.into_raw_parts().0 == 0;
        body.set_gravity_scale(if falls { 1.0 } else { 0.0 }, true);
    });
    step(&mut fields, &mut world);
    let found = report(&fields).touches;
    assert_eq!(
        (found.not_comparable.bent, found.total()),
        (1, 1),
        "{found:?}"
    );
}
