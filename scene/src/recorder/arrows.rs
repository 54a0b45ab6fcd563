//! Fields as arrows, at some moments of a run.

use std::collections::HashSet;

use super::super::fields::math::{ColliderSet, DVec3, RigidBodySet, Vector, from_dvec3, to_dvec3};
use super::super::fields::rapier::pipeline::PhysicsWorld;
use super::super::fields::{Fields, WorldRef};
use super::bounds::{Bounds, Part, Parts};
use super::frames::{Counts, four_digits};
use super::paths::Paths;
use crate::page::{Arrows, Moment};

/// Arrows of a moment: about this many on an even grid, and at most this many along paths.
const ABOUT: f64 = 220.0;
const MOST: usize = 400;

/// If a grid over the box that is shown has fewer arrows than this, arrows are along the paths of bodies instead.
const FEW: usize = 30;

/// The longest arrow stands for this quantile of all forces: near a singular centre, forces are unbounded.
const USUAL: f64 = 0.9;

/// The shortest arrow, as a share of the longest, so that weak forces can be seen.
const SHORTEST: f64 = 0.2;

/// The fields, and the bodies and colliders to which they may be anchored, at one frame.
pub(super) struct Snapshot {
    frame: usize,
    fields: Fields,
    bodies: RigidBodySet,
    colliders: ColliderSet,
}

impl Snapshot {
    /// `None` if the fields, the settings or the state are not valid.
    pub fn new(frame: usize, world: &PhysicsWorld, fields: &Fields) -> Option<Self> {
        let (settings, state) = (fields.settings.clone(), fields.state.clone());
        Some(Snapshot {
            frame,
            fields: Fields::from_parts(fields.set.clone(), settings, state).ok()?,
            bodies: world.bodies.clone(),
            colliders: world.colliders.clone(),
        })
    }

    /// The forces at those points where a field is defined and its force is finite and not zero.
    fn forces(&self, points: &[DVec3]) -> Vec<Force> {
        let places: Vec<Vector> = points.iter().map(|it| from_dvec3(*it)).collect();
        let values = self
            .fields
            .values_at(&places, WorldRef::new(&self.bodies, &self.colliders));
        let forces = points.iter().zip(values);
        let forces = forces.filter(|(_, value)| value.is_defined);
        let forces = forces.map(|(at, value)| Force {
            at: *at,
            force: to_dvec3(value.force),
        });
        forces
            .filter(|it| it.force.is_finite() && it.force != DVec3::ZERO)
            .collect()
    }
}

struct Force {
    at: DVec3,
    force: DVec3,
}

/// Points, and their spacing.
struct Grid {
    points: Vec<DVec3>,
    spacing: f64,
}

impl Grid {
    /// An even grid over the box that is shown.
    fn over(bounds: &Bounds) -> Self {
        let half = widened(bounds.half);
        let mut spacing = half.max_element();
        while count(half, spacing) < ABOUT {
            spacing *= 0.95;
        }
        let steps = (half / spacing).floor();
        let along = |axis: usize| {
            let most = steps[axis] as i64;
            (-most..=most).map(move |it| it as f64 * spacing)
        };
        let points = along(0).flat_map(|x| {
            let rows = along(1).flat_map(move |y| along(2).map(move |z| DVec3::new(x, y, z)));
            rows.map(|it| bounds.center + it)
        });
        Grid {
            points: points.collect(),
            spacing,
        }
    }

    /// The nodes of a grid near which bodies pass.
    fn along(paths: &[DVec3], bounds: &Bounds) -> Self {
        let mut spacing = bounds.half.max_element() / 12.0;
        loop {
            let mut seen = HashSet::new();
            let mut points = Vec::new();
            for at in paths {
                let cell = ((*at - bounds.center) / spacing).round();
                let inside = ((*at - bounds.center).abs())
                    .cmple(bounds.half * 1.01)
                    .all();
                if inside && seen.insert(cell.to_array().map(|it| it as i64)) {
                    points.push(bounds.center + cell * spacing);
                }
            }
            if points.len() <= MOST {
                return Grid { points, spacing };
            }
            spacing *= 1.25;
        }
    }
}

impl Grid {
    /// Without the points in fixed solid parts, where arrows could not be seen.
    fn outside(mut self, parts: &Parts) -> Self {
        let solid = |part: &&Part| !part.is_sensor;
        let inside = |at: DVec3| parts.fixed().filter(solid).any(|part| part.contains(at));
        self.points.retain(|at| !inside(*at));
        self
    }
}

/// Half the size of the grid: flat scenes have one layer of arrows, but scenes on a line are widened to the sides.
fn widened(half: DVec3) -> DVec3 {
    let mut sizes = half.to_array();
    sizes.sort_unstable_by(f64::total_cmp);
    let [_, middle, large] = sizes;
    let least = 0.5 * large;
    if middle >= least {
        return half;
    }
    // To the sides, not upwards.
    let beside = if half.y == large {
        DVec3::X
    } else {
        DVec3::X + DVec3::Z
    };
    half.max(beside * least)
}

fn count(half: DVec3, spacing: f64) -> f64 {
    let counts = (half / spacing).floor() * 2.0 + 1.0;
    counts.element_product()
}

/// The arrows of all moments, if there is any force.
pub(super) fn all(
    snapshots: &[Snapshot],
    bounds: &Bounds,
    parts: &Parts,
    paths: &Paths,
) -> Option<Arrows> {
    let sample = |grid: &Grid| -> Vec<Vec<Force>> {
        let forces = snapshots.iter().map(|it| it.forces(&grid.points));
        forces.collect()
    };
    let mut grid = Grid::over(bounds).outside(parts);
    let mut sampled = sample(&grid);
    let most = |sampled: &[Vec<Force>]| sampled.iter().map(Vec::len).max().unwrap_or(0);
    if most(&sampled) < FEW {
        let other = Grid::along(paths.places(), bounds).outside(parts);
        let along = sample(&other);
        if most(&along) > most(&sampled) {
            (grid, sampled) = (other, along);
        }
    }
    let longest = usual_force(&sampled)?;
    let counts = Counts::new(bounds);
    let moments = snapshots
        .iter()
        .zip(&sampled)
        .map(|(snapshot, forces)| Moment {
            frame: snapshot.frame,
            arrows: forces
                .iter()
                .flat_map(|it| arrow(it, longest, grid.spacing, &counts))
                .collect(),
        });
    let mut moments: Vec<Moment> = moments.collect();
    moments.dedup_by(|later, earlier| later.arrows == earlier.arrows);
    Some(Arrows {
        longest: four_digits(longest),
        moments,
    })
}

/// The quantile [`USUAL`] of all forces; `None` without forces.
fn usual_force(sampled: &[Vec<Force>]) -> Option<f64> {
    let all = sampled.iter().flatten();
    let mut sizes: Vec<f64> = all.map(|it| it.force.length()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let last = sizes.len().checked_sub(1)?;
    Some(sizes[(USUAL * last as f64).round() as usize])
}

/// Start and vector of an arrow, in counts.
fn arrow(force: &Force, longest: f64, spacing: f64, counts: &Counts) -> [i64; 6] {
    let size = force.force.length();
    let length = 0.85 * spacing * (size / longest).sqrt().clamp(SHORTEST, 1.0);
    let [x, y, z] = counts.place(force.at);
    let [u, v, w] = counts.place(force.force / size * length);
    [x, y, z, u, v, w]
}
