//! Floors and walls: fixed flat faces with all moving bodies on one side. They are drawn as faces, so that the
//! near walls of a closed box do not hide its contents.

use super::super::fields::math::{DVec3, to_dvec3};
use super::super::fields::rapier::parry::shape::TypedShape;
use super::bounds::{Bounds, Part, Parts};
use super::frames::Counts;
use super::paths::Paths;

/// How far bodies may be behind a wall, and how far the wall is drawn beyond the box in which bodies move, as
/// shares of half the size of the view.
const BEHIND: f64 = 0.03;
const BEYOND: f64 = 0.2;

/// Half the length and half the width of a wall, at least, as shares of half the size of the view.
const LEAST: [f64; 2] = [0.6, 0.2];

/// A half-space: the points on the outer side of a plane.
#[derive(Clone, Copy)]
struct Side {
    outward: DVec3,
    offset: f64,
}

impl Side {
    fn through(point: DVec3, outward: DVec3) -> Self {
        Side {
            outward,
            offset: outward.dot(point),
        }
    }

    /// The distance of a point from the plane, positive on the outer side.
    fn height(&self, point: DVec3) -> f64 {
        self.outward.dot(point) - self.offset
    }

    /// The part of a flat convex face that is on the outer side.
    fn cut(&self, corners: &[DVec3]) -> Vec<DVec3> {
        let mut kept = Vec::new();
        for (number, &here) in corners.iter().enumerate() {
            let next = corners[(number + 1) % corners.len()];
            let heights = [self.height(here), self.height(next)];
            if heights[0] >= 0.0 {
                kept.push(here);
            }
            if (heights[0] < 0.0) != (heights[1] < 0.0) {
                kept.push(here.lerp(next, heights[0] / (heights[0] - heights[1])));
            }
        }
        kept
    }
}

/// A rectangle.
struct Face {
    middle: DVec3,
    outward: DVec3,
    /// Vectors from the middle to the middles of two edges that meet.
    edges: [DVec3; 2],
}

/// A floor or a wall.
pub(super) struct Wall {
    /// The number of its body, and its own among the parts of that body.
    body: usize,
    place: usize,
    side: Side,
    face: Vec<DVec3>,
}

impl Wall {
    pub fn is_of(&self, part: &Part) -> bool {
        (self.body, self.place) == (part.body, part.place)
    }

    pub fn corners(&self, counts: &Counts) -> Vec<[i64; 3]> {
        self.face.iter().map(|it| counts.place(*it)).collect()
    }
}

/// All floors and walls.
pub(super) fn all(parts: &Parts, paths: &Paths, bounds: &Bounds) -> Vec<Wall> {
    let walls = parts
        .fixed()
        .filter_map(|part| wall(part, paths.places(), bounds));
    let mut walls: Vec<Wall> = walls.collect();
    // The part of a wall behind another wall cannot be seen.
    let sides: Vec<Side> = walls.iter().map(|wall| wall.side).collect();
    for (number, wall) in walls.iter_mut().enumerate() {
        for (other, side) in sides.iter().enumerate() {
            if other != number && side.outward.dot(wall.side.outward).abs() < 0.9 {
                wall.face = side.cut(&wall.face);
            }
        }
    }
    walls.retain(|wall| wall.face.len() > 2);
    walls
}

fn wall(part: &Part, paths: &[DVec3], bounds: &Bounds) -> Option<Wall> {
    if part.is_sensor || paths.is_empty() {
        return None;
    }
    let size = bounds.half.max_element();
    let faces = faces(part, bounds);
    let height = |face: &Face| Side::through(face.middle, face.outward).height(bounds.center);
    let face = faces
        .into_iter()
        .max_by(|a, b| height(a).total_cmp(&height(b)))?;
    let side = Side::through(face.middle, face.outward);
    let mut lengths = face.edges.map(DVec3::length);
    lengths.sort_unstable_by(|a, b| b.total_cmp(a));
    let is_large = lengths
        .iter()
        .zip(LEAST)
        .all(|(it, least)| *it >= least * size);
    let all_before = paths.iter().all(|at| side.height(*at) > -BEHIND * size);
    (is_large && all_before && height(&face) > 0.0).then(|| Wall {
        body: part.body,
        place: part.place,
        side,
        face: trimmed(&face, bounds),
    })
}

/// The faces of a cuboid, or the piece of a half-space's plane near the box that is shown.
fn faces(part: &Part, bounds: &Bounds) -> Vec<Face> {
    let pose = part.first;
    match part.shape.as_typed_shape() {
        TypedShape::Cuboid(cuboid) => {
            let half = to_dvec3(cuboid.half_extents);
            let axis = |number: usize| pose.rotation * DVec3::AXES[number % 3];
            let faces = (0..6).map(|number| {
                let outward = axis(number) * if number < 3 { 1.0 } else { -1.0 };
                let edge = |after: usize| axis(number + after) * half[(number + after) % 3];
                Face {
                    middle: pose.translation + outward * half[number % 3],
                    outward,
                    edges: [edge(1), edge(2)],
                }
            });
            faces.collect()
        }
        TypedShape::HalfSpace(half) => {
            let outward = pose.rotation * to_dvec3(half.normal);
            let height = Side::through(pose.translation, outward).height(bounds.center);
            let (one, other) = outward.any_orthonormal_pair();
            let reach = 2.0 * bounds.half.length();
            vec![Face {
                middle: bounds.center - outward * height,
                outward,
                edges: [one * reach, other * reach],
            }]
        }
        _ => Vec::new(),
    }
}

/// The corners of a face cut off near the box that is shown, counter-clockwise as seen from outside.
fn trimmed(face: &Face, bounds: &Bounds) -> Vec<DVec3> {
    let [u, v] = face.edges;
    let mut corners: Vec<DVec3> = [-u - v, u - v, u + v, v - u]
        .map(|it| face.middle + it)
        .into();
    if u.cross(v).dot(face.outward) < 0.0 {
        corners.reverse();
    }
    let half = bounds.half + BEYOND * bounds.half.max_element();
    for axis in DVec3::AXES {
        // Not along the normal: a floor may be far below the bodies.
        if face.outward.dot(axis).abs() < 0.7 {
            let reach = half.dot(axis);
            for inward in [axis, -axis] {
                let edge = bounds.center - inward * reach;
                corners = Side::through(edge, inward).cut(&corners);
            }
        }
    }
    corners
}
