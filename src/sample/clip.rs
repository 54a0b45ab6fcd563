//! Closed surfaces made of triangles, cut by planes.
//!
//! The enclosed volume is a sum of signed tetrahedra. So a solid need not be convex, and the lid that closes a cut, a
//! fan of triangles, may overlap itself.

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

    /// The area of the plane's section through the solid that triangles enclose, and the integral over it of
    /// the square of the distance from `apex`, a point of the plane. Distances along `straight`, a unit vector or
    /// zero, do not count.
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

    /// The content of the part below the plane of the solid that triangles enclose. `near` is any point.
    pub(super) fn below(&self, triangles: &[Triangle], near: DVec3) -> Content {
        // The lid on the cut adds no volume if the origin of the tetrahedra is in the plane.
        let mut sum = Sum::from(self.foot(near));
        self.clip(triangles, |[a, b, c], _| sum.add([a, b, c]));
        sum.content()
    }

    /// Appends the surface of that part. The lid on the cut is a fan of triangles around the foot of `near`.
    pub(super) fn keep_below(&self, triangles: &[Triangle], near: DVec3, kept: &mut Vec<Triangle>) {
        let apex = self.foot(near);
        self.clip(triangles, |triangle, cut| {
            kept.push(triangle);
            kept.extend(cut.map(|[from, to]| [apex, to, from]));
        });
    }

    fn foot(&self, point: DVec3) -> DVec3 {
        point - self.normal * self.above(point)
    }

    /// Calls `keep` with the triangles that make up the surface below the plane, and the edge at which each was cut.
    fn clip(&self, triangles: &[Triangle], mut keep: impl FnMut(Triangle, Option<[DVec3; 2]>)) {
        for [a, b, c] in triangles {
            let (a, b, c, one) = match [a, b, c].map(|corner| self.above(*corner) < 0.0) {
                [true, true, true] => {
                    keep([*a, *b, *c], None);
                    continue;
                }
                [false, false, false] => continue,
                [true, false, false] => (*a, *b, *c, true),
                [false, true, false] => (*b, *c, *a, true),
                [false, false, true] => (*c, *a, *b, true),
                [false, true, true] => (*a, *b, *c, false),
                [true, false, true] => (*b, *c, *a, false),
                [true, true, false] => (*c, *a, *b, false),
            };
            if one {
                let (ab, ac) = (self.crossing(a, b), self.crossing(a, c));
                keep([a, ab, ac], Some([ab, ac]));
            } else {
                let (ab, ac) = (self.crossing(b, a), self.crossing(c, a));
                keep([b, c, ac], None);
                keep([b, ac, ab], Some([ac, ab]));
            }
        }
    }

    /// The point where an edge crosses the plane; bit for bit the same for both triangles at the edge.
    fn crossing(&self, below: DVec3, above: DVec3) -> DVec3 {
        let (low, high) = (self.above(below), self.above(above));
        below + (above - below) * (low / (low - high))
    }
}

/// A volume, and its centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Content {
    pub volume: f64,
    pub centre: DVec3,
}

impl Content {
    /// The content of the rest, without a part.
    pub(super) fn without(&self, part: &Content) -> Self {
        let volume = self.volume - part.volume;
        let first = (self.centre - part.centre) * part.volume;
        let centre = self.centre + first / volume;
        Content { volume, centre }
    }
}

/// The content of a solid, added up over the triangles that enclose it.
struct Sum {
    origin: DVec3,
    /// Six times the volume.
    six: f64,
    first: DVec3,
}

impl Sum {
    fn from(origin: DVec3) -> Self {
        let (six, first) = (0.0, DVec3::ZERO);
        Sum { origin, six, first }
    }

    /// Adds the tetrahedron of a triangle and the origin.
    fn add(&mut self, triangle: Triangle) {
        let [a, b, c] = triangle.map(|corner| corner - self.origin);
        let six = a.dot(b.cross(c));
        self.six += six;
        self.first += (a + b + c) * six;
    }

    fn content(&self) -> Content {
        Content {
            volume: self.six / 6.0,
            centre: self.origin + self.first / (4.0 * self.six),
        }
    }
}

/// The content of the solid that triangles enclose.
pub(super) fn content(triangles: &[Triangle]) -> Content {
    let origin = triangles.first().map_or(DVec3::ZERO, |first| first[0]);
    let mut sum = Sum::from(origin);
    triangles.iter().for_each(|triangle| sum.add(*triangle));
    sum.content()
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

    /// A hollow cube is not convex, and the lids of its cuts are rings.
    #[test]
    fn the_parts_of_a_cut_hollow_cube_add_up() {
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
        let whole = content(&hollow);
        assert!((whole.volume - 7.0).abs() < 1e-14 && whole.centre.length() < 1e-14);
        let plane = Plane {
            normal: DVec3::X,
            offset: 0.25,
        };
        let near = DVec3::ONE * 0.1;
        for (plane, volume) in [
            (plane, 1.25 * 4.0 - 0.75),
            (plane.flipped(), 0.75 * 4.0 - 0.25),
        ] {
            let mut kept = Vec::new();
            plane.keep_below(&hollow, near, &mut kept);
            let (part, same) = (plane.below(&hollow, near), content(&kept));
            let rest = plane.flipped().below(&hollow, near);
            assert!((part.volume - volume).abs() < 1e-14, "{part:?}");
            for (one, other) in [(same, part), (whole.without(&rest), part)] {
                assert!((one.volume - other.volume).abs() < 1e-14, "{one:?}");
                assert!((one.centre - other.centre).length() < 1e-14, "{one:?}");
            }
        }
    }
}
