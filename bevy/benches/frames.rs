//! The time of a frame of 10,000 bodies with fields, beside the same frame of `bevy_rapier3d` alone.
//!
//! `cargo bench --bench frames --ignore-rust-version`. Frames of the two apps alternate; each figure is a median with
//! its quartiles.

use std::time::{Duration, Instant};

use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use bevy_rapier3d::prelude::*;
use bevy_rapier3d_fields::prelude::*;

const BODIES: u16 = 10_000;
const ROUNDS: usize = 151;

/// The strength of all fields: so weak that bodies stay apart, and Rapier's work is the same as without fields.
const WEAK: f32 = 1e-5;

fn main() {
    println!("{BODIES} balls apart from each other, ms a frame: median (quartiles)");
    println!(
        "{:38} {:>20} {:>20} {:>6}",
        "fields", "with fields", "Rapier alone", "ratio"
    );
    compare("none", |_| {}, |_| {});
    let uniform = |app: &mut App| {
        app.world_mut()
            .spawn(ForceField::new(Field::uniform(Vec3::Y * WEAK)));
    };
    compare("one, uniform", uniform, |_| {});
    let zones = |app: &mut App| {
        uniform(app);
        let planet = Field::point_gravity(WEAK).within(Region::ball(200.0));
        app.world_mut().spawn(ForceField::new(planet));
        let wind = ForceField::new(Field::wind(Vec3::Z, WEAK, 0.0));
        app.world_mut().spawn((sensor(), WithinCollider, wind));
    };
    // Rapier detects the bodies in the sensor with and without a field.
    let sensor_alone = |app: &mut App| {
        app.world_mut().spawn(sensor());
    };
    compare("planet, wind within a sensor, uniform", zones, sensor_alone);
    let small = |app: &mut App| {
        for number in 0..1_000_u16 {
            let zone = Field::uniform(Vec3::Y * WEAK).within(Region::ball(2.0));
            let at = Transform::from_translation(place(number * 10));
            app.world_mut().spawn((ForceField::new(zone), at));
        }
    };
    compare("1,000 entities, each with a small zone", small, |_| {});
}

fn sensor() -> impl Bundle {
    (Collider::cuboid(40.0, 40.0, 40.0), Sensor)
}

/// Compares frames of an app with fields to those of one without. An argument of the program selects by name.
fn compare(name: &str, add_fields: impl Fn(&mut App), add_to_rapier: impl Fn(&mut App)) {
    let mut arguments = std::env::args().skip(1).filter(|it| !it.starts_with('-'));
    if arguments.next().is_some_and(|part| !name.contains(&part)) {
        return;
    }
    let mut with = app(RapierFieldsPlugin::<NoUserData>::default());
    add_fields(&mut with);
    let mut alone = app(RapierPhysicsPlugin::<NoUserData>::default());
    add_to_rapier(&mut alone);
    for app in [&mut with, &mut alone] {
        (0..20).for_each(|_| app.update());
    }
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..ROUNDS {
        for (app, times) in [&mut with, &mut alone].into_iter().zip(&mut times) {
            let start = Instant::now();
            app.update();
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    let [with, alone] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        [1, 2, 3].map(|quarter| times[times.len() * quarter / 4])
    });
    let show = |[low, middle, high]: [f64; 3]| format!("{middle:.2} ({low:.2}-{high:.2})");
    let ratio = with[1] / alone[1];
    println!(
        "{name:38} {:>20} {:>20} {ratio:>6.2}",
        show(with),
        show(alone)
    );
}

fn app(plugin: impl Plugin) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, plugin));
    let dt = 1.0 / 60.0;
    app.insert_resource(TimestepMode::Fixed { dt, substeps: 1 });
    let frame = Duration::from_secs_f32(dt);
    app.insert_resource(TimeUpdateStrategy::ManualDuration(frame));
    app.finish();
    for number in 0..BODIES {
        let at = Transform::from_translation(place(number));
        let body = (
            RigidBody::Dynamic,
            Collider::ball(0.2),
            Sleeping::disabled(),
        );
        app.world_mut().spawn((body, at));
    }
    app
}

/// A place on a grid of 22 in each direction.
fn place(number: u16) -> Vec3 {
    let [x, y, z] = [number % 22, number / 22 % 22, number / 484].map(f32::from);
    Vec3::new(x, y, z) * 3.0
}
