//! Decides whether a sample on a boundary belongs to a set made of regions. Regions and trees both use this.
//!
//! Sets are closed and regularised (§3.1.1): a set is the closure of its interior. So whether a
//! sample on a boundary belongs to a composite set depends on the points next to it. The
//! surfaces that pass through the sample cut its neighbourhood into open **pieces**; each set
//! contains a piece as a whole or not at all.
//!
//! - A set is represented by the pieces that lie in it. Union, intersection, difference and
//!   complement act on them piece by piece.
//! - **The sample belongs to a set if at least one piece does.**
//!
//! Two boxes that share only a face therefore have an empty intersection (no piece lies in both), a
//! difference keeps its cut boundary (the piece just outside the cut lies in it), and a point on
//! a common face of two equal boxes lies in their intersection and not in their difference. The
//! apex of a pyramid of any number of sides lies in the pyramid, and in its complement.
//! Away from all surfaces there is one piece, and this is the plain algebra of sets.
//!
//! The vector of a union depends only on membership in each operand. On a face that E and G share from
//! opposite sides, E ∩ G is empty, but a sample belongs to E and to G, so operators on E ∪ G give the
//! vector of a sample in both.
//!
//! A sample lies on a surface when its distance is zero exactly, in `f64`. The surfaces are taken
//! as planes through the sample, which decides the pieces wherever the surfaces cross; at points
//! where curved surfaces touch without crossing (two balls from outside) the planes coincide, and
//! the pieces are the two sides of it. The apex of a cone counts as a point of a plane across its
//! axis. A wedge narrower than about 2e-5 radians does not count as a piece, since the normals are
//! only as exact as the poses that turn them.
//!
//! Any number of surfaces may pass through a sample, and none is left out. Pieces are not listed,
//! since n axes with a border at the sample make 2ⁿ of them: sets are kept as decision diagrams, which
//! are searched for a piece. If each border occurs once in a tree, and the borders are at right
//! angles, the work grows with their number. At other angles it grows at worst with the number of
//! pieces: n² − n + 2 for n planes in space. Only a tree that uses the same borders in many
//! combinations can need more: deciding whether such a set is empty is as hard as Boolean
//! satisfiability.

mod cone;
mod diagram;
mod plane;
mod search;
#[cfg(test)]
mod tests;

use std::cell::RefCell;

use diagram::{Diagram, NOWHERE, Set, SetRule, WHOLE};
pub(crate) use plane::Normal;
use plane::{Hyperplane, parallel, unit};

/// A set of the pieces of one [`Neighbourhood`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pieces(Set);

impl Pieces {
    pub(crate) const NONE: Pieces = Pieces(NOWHERE);
    pub(crate) const ALL: Pieces = Pieces(WHOLE);

    pub(crate) fn any(self) -> bool {
        self != Pieces::NONE
    }
}

/// The pieces that meet at one sample.
#[derive(Debug)]
pub(crate) struct Neighbourhood {
    /// The planes through the sample, each once.
    planes: Vec<Hyperplane>,
    /// All sets made so far.
    sets: RefCell<Diagram>,
}

impl Neighbourhood {
    /// The neighbourhood of a sample away from all surfaces: one piece.
    pub(crate) fn open() -> Self {
        Neighbourhood {
            planes: Vec::new(),
            sets: RefCell::default(),
        }
    }

    /// The neighbourhood of a sample that lies on surfaces with these outward normals.
    pub(crate) fn of(normals: &[Normal]) -> Self {
        Neighbourhood {
            planes: Hyperplane::through(normals),
            ..Neighbourhood::open()
        }
    }

    /// The pieces in either set.
    pub(crate) fn union(&self, a: Pieces, b: Pieces) -> Pieces {
        Pieces(self.sets.borrow_mut().combine(SetRule::Either, a.0, b.0))
    }

    /// The pieces in both sets.
    pub(crate) fn intersection(&self, a: Pieces, b: Pieces) -> Pieces {
        self.combine(SetRule::Both, a, b)
    }

    /// The pieces in `a` and not in `b`.
    pub(crate) fn difference(&self, a: Pieces, b: Pieces) -> Pieces {
        self.combine(SetRule::FirstOnly, a, b)
    }

    /// Combines two sets. A result without a piece becomes the empty set.
    fn combine(&self, rule: SetRule, a: Pieces, b: Pieces) -> Pieces {
        let mut sets = self.sets.borrow_mut();
        let set = sets.combine(rule, a.0, b.0);
        let known = set == NOWHERE || set == WHOLE || set == a.0 || set == b.0;
        if known || search::holds_a_piece(&sets, set, &self.planes) {
            Pieces(set)
        } else {
            Pieces::NONE
        }
    }

    /// The pieces on the inner side of a surface, given the sample's signed distance from it. `normal` is
    /// called only if the sample is on the surface.
    pub(crate) fn behind(&self, distance: f64, normal: impl FnOnce() -> Normal) -> Pieces {
        if distance < 0.0 {
            return Pieces::ALL;
        }
        if distance > 0.0 || distance.is_nan() {
            return Pieces::NONE;
        }
        let normal = normal();
        let plane = self.planes.iter().enumerate().find_map(|(k, plane)| {
            let same_side = parallel(&plane.normal, &unit(&normal)?)?;
            Some((k, same_side))
        });
        // A surface that is not among the planes divides no pieces; as the set is closed, all of them belong to it.
        plane.map_or(Pieces::ALL, |(k, same_side)| {
            Pieces(self.sets.borrow_mut().side(k, same_side))
        })
    }
}
