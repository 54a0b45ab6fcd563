//! The number of bodies at which the paper's two simulations still run in real time.

use std::time::Instant;

use super::super::scenes::{ammonia::AmmoniaSettings, spheres::SpheresSettings};
use super::{PRECISION, fields};
use crate::AnyError;
use crate::study::{Ceiling, quantile};
use fields::math::{Real, from_f64};
use fields::rapier::prelude::PhysicsWorld;
use fields::{ContactLaw, Fields};

/// Time of a frame at 60 Hz, s.
const FRAME: f64 = 1.0 / 60.0;
/// A probe ends after this time, s, if it has counted its minimum of steps.
const LIMIT: f64 = 0.5;
/// Steps of a probe: uncounted first ones, and the minimum and maximum of counted ones.
const STEPS: [usize; 3] = [5, 5, 60];
/// Minimum and maximum number of bodies.
const COUNTS: (usize, usize) = (32, 1 << 17);
/// Cutoff of the forces between molecules, Å.
const CUTOFF: Real = 10.0;

/// The simulations.
pub const SCENES: [&str; 4] = [
    "spheres by fields",
    "spheres by Rapier alone",
    "ammonia gas by fields",
    "ammonia gas by Rapier alone",
];

/// The largest number of bodies of one of [`SCENES`] with which a step takes at most a frame of 60 Hz; `None` if even
/// the smallest number takes longer.
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

/// Median time of a step of a scene with `count` bodies, s.
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
