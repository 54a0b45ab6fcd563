//! What holds on a boundary: the one place that says so.
//!
//! Sets are closed and regularised (§3.1.1): a set is the closure of its interior. So whether a
//! sample on a boundary belongs to a composite set is decided by what lies right beside it. The
//! surfaces that pass through the sample cut its neighbourhood into open **pieces**; within a
//! piece every set is either everywhere or nowhere.
//!
//! - A set is known at the sample by the pieces that lie in it, and pieces combine like sets:
//!   union, intersection, difference and complement act on them bit by bit.
//! - **The sample belongs to a set if at least one piece does.**
//!
//! Two boxes that share only a face therefore intersect in nothing (no piece lies in both), a
//! difference keeps its cut boundary (the piece just outside the cut lies in it), and a point on
//! a common face of two equal boxes lies in their intersection and not in their difference.
//! Away from all surfaces there is one piece, and this is the plain algebra of sets.
//!
//! Which vector holds where two operands meet is decided by membership in each of them, as
//! everywhere else: on a face that E and G share from opposite sides, E ∩ G is empty, and the
//! operators on their union give what they give for a sample in both.
//!
//! A sample lies on a surface when its distance is zero exactly, in `f64`. The surfaces are taken
//! as planes through the sample, which decides the pieces wherever the surfaces cross; at points
//! where curved surfaces touch without crossing (two balls from outside) the planes coincide, and
//! the pieces are the two sides of it. The apex of a cone counts as a point of a plane across its
//! axis.

use std::borrow::Cow;
use std::cell::Cell;
use std::ops::{BitAnd, BitOr, Not};

/// The most pieces told apart at one sample. Twelve planes in general position make at most 134;
/// beyond the limit the remaining pieces are left out.
const MOST_PIECES: usize = 128;

/// The directions that count as one: closer than this, two unit normals are the same plane.
const SAME_DIRECTION: f64 = 1e-9;

/// Direction in which a surface is left, in the space of all axes: world x, y, z first.
pub(crate) type Normal = Vec<f64>;

/// A set of pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pieces(u128);

impl Pieces {
    pub(crate) const NONE: Pieces = Pieces(0);

    pub(crate) fn any(self) -> bool {
        self.0 != 0
    }
}

impl BitAnd for Pieces {
    type Output = Pieces;
    fn bitand(self, other: Pieces) -> Pieces {
        Pieces(self.0 & other.0)
    }
}

impl BitOr for Pieces {
    type Output = Pieces;
    fn bitor(self, other: Pieces) -> Pieces {
        Pieces(self.0 | other.0)
    }
}

/// The pieces that meet at one sample.
#[derive(Clone, Debug)]
pub(crate) struct Neighbourhood {
    /// One unit normal for each plane through the sample.
    planes: Vec<Normal>,
    /// For each piece, bit k: it lies behind plane k.
    pieces: Cow<'static, [u64]>,
    /// Whether a surface was met that is not among the planes.
    unknown_surface: Cell<bool>,
}

impl Neighbourhood {
    /// Away from all surfaces: one piece.
    pub(crate) fn open() -> Self {
        Neighbourhood {
            planes: Vec::new(),
            pieces: Cow::Borrowed(&[0]),
            unknown_surface: Cell::new(false),
        }
    }

    /// The neighbourhood of a sample that lies on surfaces with these outward normals.
    pub(crate) fn of(normals: &[Normal]) -> Self {
        let mut planes: Vec<Normal> = Vec::new();
        for normal in normals.iter().filter_map(unit) {
            if planes.len() < 64 && !planes.iter().any(|p| parallel(p, &normal).is_some()) {
                planes.push(normal);
            }
        }
        let mut pieces = cells(&planes);
        pieces.sort_unstable();
        pieces.dedup();
        pieces.truncate(MOST_PIECES);
        Neighbourhood {
            planes,
            pieces: pieces.into(),
            unknown_surface: Cell::new(false),
        }
    }

    /// Whether the sample turned out to lie on a surface that this neighbourhood does not know,
    /// so that what was found holds for closed sets only.
    pub(crate) fn met_a_surface(&self) -> bool {
        self.unknown_surface.get()
    }

    /// All pieces.
    pub(crate) fn all(&self) -> Pieces {
        Pieces(u128::MAX >> (MOST_PIECES - self.pieces.len()))
    }

    /// All pieces that do not lie in `set`.
    pub(crate) fn complement(&self, set: Pieces) -> Pieces {
        Pieces(self.all().0 & set.0.not())
    }

    /// The pieces on the inner side of a surface, given the sample's signed distance from it.
    /// `normal` is asked for only on the surface itself.
    pub(crate) fn behind(&self, distance: f64, normal: impl FnOnce() -> Normal) -> Pieces {
        if distance < 0.0 {
            return self.all();
        }
        if distance > 0.0 || distance.is_nan() {
            return Pieces::NONE;
        }
        let normal = normal();
        let plane = self.planes.iter().enumerate().find_map(|(k, plane)| {
            let same_side = parallel(plane, &unit(&normal)?)?;
            Some((k, same_side))
        });
        // Without that plane among the pieces the surface is not told apart: a closed set.
        let Some((k, same_side)) = plane else {
            self.unknown_surface.set(true);
            return self.all();
        };
        let mut set = 0;
        for (i, piece) in self.pieces.iter().enumerate() {
            if (piece >> k & 1 == 1) == same_side {
                set |= 1 << i;
            }
        }
        Pieces(set)
    }
}

/// The pieces that planes through the origin cut space into, as bits "behind plane k".
///
/// Every piece has a face on some plane. So: for each plane, find the pieces that the others cut
/// the plane itself into (one dimension less), and step off it to both sides.
fn cells(planes: &[Normal]) -> Vec<u64> {
    if planes.is_empty() {
        return vec![0];
    }
    let mut found = Vec::new();
    for (k, normal) in planes.iter().enumerate() {
        // What is left of the other planes within this one, each under its own number.
        let mut traces: Vec<Normal> = Vec::new();
        let mut trace_of: Vec<Option<(usize, bool)>> = vec![None; planes.len()];
        for (j, other) in planes.iter().enumerate().filter(|(j, _)| *j != k) {
            let along = dot(other, normal);
            let within: Normal = other
                .iter()
                .zip(normal)
                .map(|(o, n)| o - along * n)
                .collect();
            let Some(trace) = unit(&within) else { continue };
            let known = traces
                .iter()
                .enumerate()
                .find_map(|(t, seen)| Some((t, parallel(seen, &trace)?)));
            trace_of[j] = known.or_else(|| {
                traces.push(trace);
                Some((traces.len() - 1, true))
            });
        }
        for face in cells(&traces) {
            let mut piece = 0;
            for (j, trace) in trace_of.iter().enumerate() {
                if let Some((t, same_side)) = trace {
                    piece |= u64::from((face >> t & 1 == 1) == *same_side) << j;
                }
            }
            found.extend([piece, piece | 1 << k]);
        }
    }
    found
}

/// Whether two unit normals span the same plane, and if so whether they point the same way.
fn parallel(a: &Normal, b: &Normal) -> Option<bool> {
    let cosine = dot(a, b);
    (1.0 - cosine.abs() < SAME_DIRECTION).then_some(cosine > 0.0)
}

fn dot(a: &Normal, b: &Normal) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn unit(normal: &Normal) -> Option<Normal> {
    let length = dot(normal, normal).sqrt();
    (length > SAME_DIRECTION).then(|| normal.iter().map(|n| n / length).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(normals: &[[f64; 3]]) -> usize {
        let normals: Vec<Normal> = normals.iter().map(|n| n.to_vec()).collect();
        Neighbourhood::of(&normals).pieces.len()
    }

    /// Planes through a point in general position: 2, 4, 8, 14, 22 pieces (k² − k + 2).
    #[test]
    fn counts_the_pieces_of_planes_through_a_point() {
        assert_eq!(pieces(&[]), 1);
        assert_eq!(pieces(&[[1.0, 0.0, 0.0]]), 2);
        assert_eq!(pieces(&[[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]), 4);
        let mut planes = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(pieces(&planes), 8);
        planes.push([1.0, 2.0, 3.0]);
        assert_eq!(pieces(&planes), 14);
        planes.push([-2.0, 5.0, 7.0]);
        assert_eq!(pieces(&planes), 22);
    }

    #[test]
    fn planes_through_one_line_make_wedges() {
        assert_eq!(
            pieces(&[[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]),
            6
        );
    }

    #[test]
    fn equal_and_opposite_normals_are_one_plane() {
        let normals = [vec![0.0, 0.0, 2.0], vec![0.0, 0.0, -1.0]];
        let here = Neighbourhood::of(&normals);
        let (above, below) = (
            here.behind(0.0, || normals[0].clone()),
            here.behind(0.0, || normals[1].clone()),
        );
        assert!(above.any() && below.any());
        assert!(!(above & below).any(), "two half-spaces that share a face");
        assert_eq!(above | below, here.all());
    }

    #[test]
    fn axes_beyond_space_are_planes_too() {
        let here = Neighbourhood::of(&[vec![1.0, 0.0, 0.0, 0.0], vec![0.0, 0.0, 0.0, 1.0]]);
        assert_eq!(here.pieces.len(), 4);
    }

    /// Closed: the surface belongs to the set on either side. NaN belongs to none.
    #[test]
    fn one_surface() {
        let here = Neighbourhood::of(&[vec![1.0, 0.0, 0.0]]);
        assert!(here.behind(0.0, || vec![1.0, 0.0, 0.0]).any());
        assert!(here.behind(-0.0, || vec![-1.0, 0.0, 0.0]).any());
        assert!(!here.behind(f64::NAN, || vec![1.0, 0.0, 0.0]).any());
    }
}
