//! Closed surfaces made of triangles, cut by planes.
//!
//! The enclosed volume is a sum of signed tetrahedra. So a solid need not be convex, and the lid on a cut may
//! overlap itself: it is closed by a fan of triangles.

use std::ops::Range;

use crate::math::DVec3;

pub(super) type Triangle = [DVec3; 3];

/// The plane of all x with `normal` · x = `offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub normal: DVec3,
    pub offset: f64,
}

impl Plane {
    /// The distance of a point from the plane, positive on the side that the normal points to.
    fn above(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// The same plane, seen from the other side.
    pub(super) fn flipped(self) -> Self {
        Plane {
            normal: -self.normal,
            offset: -self.offset,
        }
    }

    /// Returns true if triangles reach farther than `least` on both sides.
    pub(super) fn parts(&self, triangles: &[Triangle], least: f64) -> bool {
        let (mut lowest, mut highest) = (0.0_f64, 0.0_f64);
        for corner in triangles.iter().flatten() {
            let above = self.above(*corner);
            (lowest, highest) = (lowest.min(above), highest.max(above));
        }
        lowest < -least && highest > least
    }

    /// The area of the plane's section through the solid that triangles enclose, and the integral over it of
    /// the square of the distance from `apex`, a point of the plane. Distances along `straight`, a unit vector,
    /// do not count.
    pub(super) fn section(&self, triangles: &[Triangle], apex: DVec3, straight: DVec3) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for [a, b, c] in triangles {
            let (a, b, c) = match [a, b, c].map(|corner| self.above(*corner) < 0.0) {
                [true, false, false] | [false, true, true] => (*a, *b, *c),
                [false, true, false] | [true, false, true] => (*b, *c, *a),
                [false, false, true] | [true, true, false] => (*c, *a, *b),
                [true, true, true] | [false, false, false] => continue,
            };
            let sign = if self.above(a) < 0.0 { 0.5 } else { -0.5 };
            let (p, q) = (self.crossing(a, c) - apex, self.crossing(a, b) - apex);
            let area = self.normal.dot(p.cross(q)) * sign;
            let across = |v: DVec3| v - straight * straight.dot(v);
            let (p, q) = (across(p), across(q));
            sum[0] += area;
            sum[1] += area * (p.dot(p) + p.dot(q) + q.dot(q)) / 6.0;
        }
        sum
    }

    /// Appends the part below the plane of the solid that some of the triangles enclose. `near` is any point;
    /// the fan of the lid starts at its foot on the plane.
    pub(super) fn keep_below(
        &self,
        triangles: &mut Vec<Triangle>,
        solid: Range<usize>,
        near: DVec3,
    ) {
        let apex = near - self.normal * self.above(near);
        for number in solid {
            let [a, b, c] = triangles[number];
            let heights = [a, b, c].map(|corner| self.above(corner));
            match heights.map(|height| height < 0.0) {
                [true, true, true] => triangles.push([a, b, c]),
                [false, false, false] => {}
                [true, false, false] => self.one_below([a, b, c], apex, triangles),
                [false, true, false] => self.one_below([b, c, a], apex, triangles),
                [false, false, true] => self.one_below([c, a, b], apex, triangles),
                [false, true, true] => self.two_below([a, b, c], apex, triangles),
                [true, false, true] => self.two_below([b, c, a], apex, triangles),
                [true, true, false] => self.two_below([c, a, b], apex, triangles),
            }
        }
    }

    /// For a triangle of which only the first corner is below.
    fn one_below(&self, [a, b, c]: Triangle, apex: DVec3, triangles: &mut Vec<Triangle>) {
        let (ab, ac) = (self.crossing(a, b), self.crossing(a, c));
        triangles.extend([[a, ab, ac], [apex, ac, ab]]);
    }

    /// For a triangle of which only the first corner is not below.
    fn two_below(&self, [a, b, c]: Triangle, apex: DVec3, triangles: &mut Vec<Triangle>) {
        let (ab, ac) = (self.crossing(b, a), self.crossing(c, a));
        triangles.extend([[b, c, ac], [b, ac, ab], [apex, ab, ac]]);
    }

    /// The point where an edge crosses the plane; bit for bit the same for both triangles at the edge.
    fn crossing(&self, below: DVec3, above: DVec3) -> DVec3 {
        let (low, high) = (self.above(below), self.above(above));
        below + (above - below) * (low / (low - high))
    }
}

/// The volume that triangles enclose, and the centre of that volume.
pub(super) fn content(triangles: &[Triangle]) -> (f64, DVec3) {
    let Some([origin, ..]) = triangles.first() else {
        return (0.0, DVec3::ZERO);
    };
    let (mut volume, mut first) = (0.0, DVec3::ZERO);
    for [a, b, c] in triangles {
        let (a, b, c) = (*a - *origin, *b - *origin, *c - *origin);
        let six = a.dot(b.cross(c));
        volume += six;
        first += (a + b + c) * six;
    }
    (volume / 6.0, *origin + first / (4.0 * volume))
}

/// The largest distance of a corner from a point.
pub(super) fn extent(triangles: &[Triangle], from: DVec3) -> f64 {
    let corners = triangles.iter().flatten();
    let squares = corners.map(|corner| corner.distance_squared(from));
    squares.fold(0.0, f64::max).sqrt()
}

/// The plane that halves the bounding box of triangles across its longest edge.
pub(super) fn halving(triangles: &[Triangle]) -> Plane {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for corner in triangles.iter().flatten() {
        (low, high) = (low.min(*corner), high.max(*corner));
    }
    let axis = (high - low).max_position();
    Plane {
        normal: DVec3::AXES[axis],
        offset: (low[axis] + high[axis]) * 0.5,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bowl is not convex, and the lids of its cuts are rings.
    #[test]
    fn cuts_of_what_is_not_convex_add_up() {
        let corner = |n: usize| {
            let sign = |bit: usize| if n >> bit & 1 == 1 { 1.0 } else { -1.0 };
            DVec3::new(sign(0), sign(1), sign(2))
        };
        // A cube of edge 2, and one of edge 1 in it, inside out.
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let mut hollow = Vec::new();
        for [a, b, c, d] in quads {
            let face = [[a, b, c], [a, c, d]];
            hollow.extend(face.map(|face| face.map(corner)));
            hollow.extend(face.map(|[a, b, c]| [a, c, b].map(|n| corner(n) * 0.5)));
        }
        let (volume, centre) = content(&hollow);
        assert!((volume - 7.0).abs() < 1e-14 && centre.length() < 1e-14);
        let plane = Plane {
            normal: DVec3::X,
            offset: 0.25,
        };
        let below = |plane: Plane| {
            let mut triangles = hollow.clone();
            plane.keep_below(&mut triangles, 0..hollow.len(), DVec3::ONE * 0.1);
            content(&triangles[hollow.len()..])
        };
        let (low, high) = (below(plane), below(plane.flipped()));
        assert!((low.0 - (1.25 * 4.0 - 0.75)).abs() < 1e-14, "{low:?}");
        assert!((high.0 - (0.75 * 4.0 - 0.25)).abs() < 1e-14, "{high:?}");
        assert!((low.1 * low.0 + high.1 * high.0).length() < 1e-14);
    }
}
