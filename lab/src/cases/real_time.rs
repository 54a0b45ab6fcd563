//! How many bodies of the paper's two simulations keep pace with a screen.

use std::time::Instant;

use super::super::scenes::{ammonia::AmmoniaSettings, spheres::SpheresSettings};
use super::{PRECISION, fields};
use crate::AnyError;
use crate::study::{Ceiling, quantile};
use fields::math::{Real, from_f64};
use fields::rapier::prelude::PhysicsWorld;
use fields::{ContactLaw, Fields};

/// Seconds of a frame: 60 Hz.
const FRAME: f64 = 1.0 / 60.0;
/// Seconds that the steps of a probe may take.
const LIMIT: f64 = 0.5;
/// Steps of a probe that are not counted, and counted ones at least and at most.
const STEPS: [usize; 3] = [5, 5, 60];
/// Bodies to begin with, and at most.
const COUNTS: (usize, usize) = (32, 1 << 17);
/// Å
const CUTOFF: Real = 10.0;

/// What is simulated, and by whom.
pub const SCENES: [&str; 4] = [
    "spheres by fields",
    "spheres by Rapier alone",
    "ammonia gas by fields",
    "ammonia gas by Rapier alone",
];

/// The most bodies of one of [`SCENES`] of which a step takes no longer than a frame of 60 Hz; nothing
/// if not even the fewest keep pace.
///
/// Spheres and their contacts are as in the paper's first simulation, at the density of its 20 in a cube
/// of 10; molecules as in its second, one step of 1 fs in a frame. Rapier alone moves and bounces the same
/// bodies, without forces between them.
///
/// # Errors
/// A scene cannot be built, or a step fails.
pub fn ceiling(scene: &str) -> Result<Option<Ceiling>, AnyError> {
    let mut failed = None;
    let found = Ceiling::find(COUNTS, FRAME, |count| match probe(scene, count) {
        Ok(step) => Some(step),
        Err(error) => {
            failed = Some(error);
            None
        }
    });
    if let Some(error) = failed {
        return Err(error);
    }
    Ok(found.map(|((count, step), beyond)| Ceiling {
        precision: PRECISION,
        scene: scene.to_owned(),
        count,
        step,
        beyond,
        frame: FRAME,
        limit: LIMIT,
    }))
}

/// The median step of a scene of so many bodies, seconds.
fn probe(scene: &str, count: usize) -> Result<f64, AnyError> {
    let (mut world, mut fields) = build(scene, count)?;
    let (began, mut times) = (Instant::now(), Vec::new());
    let [unseen, least, most] = STEPS;
    while times.len() < unseen + most {
        if times.len() >= unseen + least && began.elapsed().as_secs_f64() > LIMIT {
            break;
        }
        let clock = Instant::now();
        match &mut fields {
            Some(fields) => drop(fields.step(&mut world)?),
            None => world.step(),
        }
        times.push(clock.elapsed().as_secs_f64());
    }
    times.drain(..unseen);
    times.sort_unstable_by(f64::total_cmp);
    Ok(quantile(&times, 0.5))
}

fn build(scene: &str, count: usize) -> Result<(PhysicsWorld, Option<Fields>), AnyError> {
    let by_fields = scene.ends_with("fields");
    if scene.starts_with("spheres") {
        let usual = SpheresSettings::default();
        let larger = (count as f64 / usual.count as f64).cbrt();
        let settings = SpheresSettings {
            count,
            half_extent: usual.half_extent * from_f64(larger),
            ..usual
        };
        let scene = settings.build()?;
        let fields = by_fields.then(|| Fields::new(scene.tree(ContactLaw::elastic())));
        return Ok((scene.world, fields.transpose()?));
    }
    let settings = AmmoniaSettings {
        count,
        ..AmmoniaSettings::default()
    };
    let scene = settings.build()?;
    let tree = scene.tree(Some(CUTOFF), ContactLaw::elastic());
    let fields = by_fields.then(|| scene.fields(Fields::builder(tree)));
    let fields = fields.transpose()?;
    Ok((scene.world, fields))
}
