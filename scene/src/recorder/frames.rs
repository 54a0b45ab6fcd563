//! The poses of bodies by frame, and lengths as whole numbers.

use super::super::fields::math::{DQuat, DVec3, to_f64};
use super::super::fields::rapier::pipeline::PhysicsWorld;
use super::bodies::Body;
use super::bounds::Bounds;
use crate::page::DrawnBody;

/// The unit of lengths in a page is at most this share of half the size of the box that is shown.
const FINE: f64 = 1e-4;

/// The largest count in a page: positions farther away are drawn there.
const MOST: f64 = 1e12;

/// Converts lengths to counts of a unit, which is a power of ten.
pub(super) struct Counts {
    exponent: i32,
}

impl Counts {
    pub fn new(bounds: &Bounds) -> Self {
        let exponent = (FINE * bounds.half.max_element()).log10().floor();
        Counts {
            exponent: exponent.clamp(-300.0, 300.0) as i32,
        }
    }

    /// The length of one count.
    pub fn unit(&self) -> f64 {
        10_f64.powi(self.exponent)
    }

    pub fn length(&self, length: f64) -> f64 {
        length / self.unit()
    }

    /// A length in counts, to four significant digits: for shapes, which may be much smaller than the scene.
    pub fn fine(&self, length: f64) -> f64 {
        four_digits(self.length(length))
    }

    pub fn whole(&self, length: f64) -> i64 {
        self.length(length).clamp(-MOST, MOST).round() as i64
    }

    pub fn place(&self, place: DVec3) -> [i64; 3] {
        place.to_array().map(|it| self.whole(it))
    }
}

/// Rounds to four significant digits.
pub(super) fn four_digits(number: f64) -> f64 {
    // A printed number can be parsed.
    format!("{number:.3e}").parse().unwrap_or(number)
}

/// The pose of a body in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub at: DVec3,
    pub turn: DQuat,
    /// Whether it sleeps or is disabled; false for fixed bodies.
    pub asleep: bool,
}

/// All bodies at one time.
pub(super) struct Frame {
    pub time: f64,
    pub places: Vec<Place>,
}

impl Frame {
    pub fn new(time: f64, bodies: &[Body], world: &PhysicsWorld) -> Self {
        let place = |body: &Body| {
            let it = body.handle.and_then(|handle| world.bodies.get(handle));
            let pose = it.map(|it| *it.position()).unwrap_or_default();
            let idle = it.is_some_and(|it| it.is_sleeping() || !it.is_enabled());
            Place {
                at: DVec3::from_array(pose.translation.to_array().map(to_f64)),
                turn: DQuat::from_array(pose.rotation.to_array().map(to_f64)),
                asleep: idle && !body.is_fixed,
            }
        };
        Frame {
            time,
            places: bodies.iter().map(place).collect(),
        }
    }
}

/// The changes by frame; see [`Replay::frames`](crate::page::Replay::frames).
pub(super) fn differences(
    frames: &[Frame],
    bodies: &[DrawnBody],
    counts: &Counts,
) -> Vec<Vec<i64>> {
    let mut known = vec![[0_i64; 7]; bodies.len()];
    let changes = frames.iter().map(|frame| {
        let mut row = Vec::new();
        let bodies = bodies.iter().zip(&frame.places).zip(&mut known);
        for (number, ((body, place), known)) in bodies.enumerate() {
            let now = numbers(place, known, counts);
            let shown = if body.turns { 7 } else { 3 };
            if now[..shown] != known[..shown] {
                row.push(number as i64);
                row.extend((0..shown).map(|it| now[it] - known[it]));
                *known = now;
            }
        }
        row
    });
    changes.collect()
}

/// Position and attitude; of the two quaternions of an attitude, the one nearer to that in `before`.
fn numbers(place: &Place, before: &[i64; 7], counts: &Counts) -> [i64; 7] {
    let turn = place.turn.to_array();
    let along: f64 = (0..4).map(|it| turn[it] * before[3 + it] as f64).sum();
    let sign = if along < 0.0 { -1e3 } else { 1e3 };
    let mut numbers = [0; 7];
    numbers[..3].copy_from_slice(&counts.place(place.at));
    for (number, part) in numbers[3..].iter_mut().zip(turn) {
        *number = (sign * part).round() as i64;
    }
    numbers
}

/// By frame, the numbers of the bodies that fell asleep or woke.
pub(super) fn sleep(frames: &[Frame]) -> Vec<Vec<usize>> {
    let mut known = vec![false; frames.first().map_or(0, |it| it.places.len())];
    let changes = frames.iter().map(|frame| {
        let places = frame.places.iter().zip(&mut known).enumerate();
        let changed = places.filter(|(_, (place, known))| place.asleep != **known);
        let changed = changed.map(|(number, (place, known))| {
            *known = place.asleep;
            number
        });
        changed.collect()
    });
    changes.collect()
}
