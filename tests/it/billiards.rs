//! Many impacts in one step, in the right order: Galperin's billiard and hard spheres in a cube.

use rapier3d_fields::math::{from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::lab::scenes::hard_spheres::{Gas, Method, in_order};
use crate::support::collide::*;
use crate::support::{Table, assert_at_most, either};

/// A light ball between a wall and a heavy ball that approaches. Returns the time of each collision and whether it is
/// with the wall, and the final velocities.
fn galperin(ratio: f64, dt: f64) -> (Vec<(f64, bool)>, [f64; 2]) {
    let mut world = arena(from_f64(dt));
    let plane = ColliderBuilder::new(SharedShape::halfspace(Vector::X));
    let wall = world.colliders.insert(plane);
    let mut ball = |x: Real, v: Real, mass: f64| {
        let body = RigidBodyBuilder::dynamic()
            .linvel(Vector::X * v)
            .can_sleep(false);
        let part = ColliderBuilder::ball(0.25).mass(from_f64(mass));
        insert(&mut world, body.translation(Vector::X * x), [part])
    };
    let (light, heavy) = (ball(2.0, 0.0, 1.0), ball(4.0, -1.0, ratio));
    let tree = touch([wall, light.parts[0], heavy.parts[0]], ELASTIC);
    let builder = Fields::builder(tree).detection(Detection::Swept);
    let mut fields = builder.build().expect("a valid tree");
    let mut collisions = Vec::new();
    for _ in 0..(400.0 / dt) as usize {
        let outcome = fields.step(&mut world).expect("a step");
        assert!(!outcome.exhausted);
        for contact in fields
            .contacts()
            .iter()
            .filter(|c| c.time_of_impact.is_some())
        {
            let time = contact.time_of_impact.expect("a time");
            collisions.push((time, contact.colliders.contains(&wall)));
        }
    }
    let end = [&light, &heavy].map(|thing| to_f64(linvel(&world, thing).x));
    (collisions, end)
}

#[test]
fn galperins_billiard_counts_the_digits_of_pi() {
    let table = Table::parse(include_str!("../data/h_stiff/galperin.csv"));
    let exact = [
        (1.0, 3, [0.0, 1.0]),
        (
            100.0,
            31,
            [0.477_860_208_205_885_9, 0.998_857_595_563_118_5],
        ),
        (
            10_000.0,
            314,
            [0.169_731_316_195_039_98, 0.999_998_559_562_977_3],
        ),
    ];
    for (ratio, digits, last) in exact {
        for dt in [1.0 / 60.0, 1.0 / 7.0] {
            let (collisions, end) = galperin(ratio, dt);
            assert_eq!(collisions.len(), digits, "ratio {ratio}, dt {dt}");
            let rows = table.rows().filter(|row| row.number("ratio") == ratio);
            let mut worst = 0.0_f64;
            for row in rows {
                // The table lists only some of the collisions.
                let (time, wall) = &collisions[row.number("n") as usize - 1];
                assert_eq!(
                    *wall,
                    row.number("type") == 1.0,
                    "collision {}",
                    row.number("n")
                );
                worst = worst.max((time - row.number("t")).abs());
            }
            println!("ratio {ratio}, dt {dt:.4}: times within {worst:.1e}");
            assert_at_most(worst, either(7e-4, 1e-10), "time");
            for (found, exact) in end.iter().zip(last) {
                // Relative to the largest speed of the light ball.
                let error = (found - exact).abs() / ratio.sqrt();
                assert_at_most(error, either(1e-4, 1e-9), "velocity");
            }
        }
    }
}

#[test]
fn long_steps_resolve_a_whole_billiard() {
    let (collisions, _) = galperin(10_000.0, 6.0);
    assert_eq!(collisions.len(), 314);
}

#[test]
#[cfg(feature = "f64")]
fn the_fourth_digit_needs_64_bits() {
    assert_eq!(galperin(1e6, 1.0 / 60.0).0.len(), 3141);
}

#[test]
fn hard_spheres_collide_in_the_order_of_the_exact_run() {
    for gas in Gas::references() {
        for dt in [1.0 / 10.0, 1.0 / 60.0, 1e-3, either(1e-3, 1e-4)] {
            let mut run = gas.build(Method::Swept, dt).expect("a valid tree");
            let events = run.finish(&gas).expect("steps");
            let matched = in_order(&events, &gas);
            let error = events.iter().zip(&gas.events).take(matched);
            let error = error.map(|(found, exact)| (found.time - exact.time).abs());
            let error = crate::support::largest(error);
            println!(
                "{} dt {dt:.3}: {matched} of 60 in order, times within {error:.1e}",
                gas.name
            );
            // In 32 bits each step rounds the positions, by 1e-5 over the 500 steps of the dilute gas at
            // 1/60, which grows ten-thousandfold over the collisions.
            let coarse = dt >= 1.0 / 60.0;
            let least = match (gas.name, coarse) {
                ("dense", true) => 60.0,
                (_, true) => either(40.0, 60.0),
                (_, false) => either(20.0, 60.0),
            };
            assert!(matched as f64 >= least, "{} dt {dt}: {matched}", gas.name);
            let bound = if coarse { 2e-2 } else { f64::MAX };
            let steps = (1.0 / 60.0 / dt).max(1.0);
            assert_at_most(error, either(bound, 1e-9 * steps), "time");
        }
        let mut run = gas
            .build(Method::Discrete, 1.0 / 60.0)
            .expect("a valid tree");
        let matched = in_order(&run.finish(&gas).expect("steps"), &gas);
        println!("{}: sampling at 1/60 reproduces {matched}", gas.name);
        assert!(matched < 60, "no need to sweep");
    }
}

/// Within the default limit of work. In `f32`, the velocities of the heavy ball are too coarse.
#[cfg(feature = "f64")]
#[test]
fn a_billiard_of_a_million_has_its_3141_impacts_in_one_step() {
    let (collisions, end) = galperin(1e6, 400.0);
    assert_eq!(collisions.len(), 3141);
    assert!((end[1] - 1.0).abs() < 1e-5, "{end:?}");
}
