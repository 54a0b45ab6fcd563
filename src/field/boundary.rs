//! Decides whether a sample on a boundary belongs to a set made of regions. Regions and trees both use this.
//!
//! Sets are closed and regularised (§3.1.1): a set is the closure of its interior. So whether a
//! sample on a boundary belongs to a composite set is decided by what lies right beside it. The
//! surfaces that pass through the sample cut its neighbourhood into open **pieces**; within a
//! piece every set is either everywhere or nowhere.
//!
//! - A set is known at the sample by the pieces that lie in it, and pieces combine like sets:
//!   union, intersection, difference and complement act on them piece by piece.
//! - **The sample belongs to a set if at least one piece does.**
//!
//! Two boxes that share only a face therefore intersect in nothing (no piece lies in both), a
//! difference keeps its cut boundary (the piece just outside the cut lies in it), and a point on
//! a common face of two equal boxes lies in their intersection and not in their difference. The
//! apex of a pyramid of any number of sides lies in the pyramid, and in its complement.
//! Away from all surfaces there is one piece, and this is the plain algebra of sets.
//!
//! Where two operands meet, membership in each of them decides on the vector, as everywhere else: on a face
//! that E and G share from opposite sides, E ∩ G is empty, and the operators on their union give the same as
//! for a sample in both.
//!
//! A sample lies on a surface when its distance is zero exactly, in `f64`. The surfaces are taken
//! as planes through the sample, which decides the pieces wherever the surfaces cross; at points
//! where curved surfaces touch without crossing (two balls from outside) the planes coincide, and
//! the pieces are the two sides of it. The apex of a cone counts as a point of a plane across its
//! axis. What is narrower than some 2e-5 radians is no piece: normals are no more exact than the
//! poses that turn them.
//!
//! Any number of surfaces may pass through a sample, and none is left out. Pieces are not listed,
//! since there are 2ⁿ of them where n axes end: sets are kept as decision diagrams, and a piece
//! is searched for. Where each border stands once in a tree, and the borders are at right
//! angles, the work grows with their number. Where they are not, it grows at worst with the pieces
//! that they cut space into: n² − n + 2 of n planes in space. Only a tree that names the same many
//! borders in many combinations can need more: to say whether such a set is empty is as hard as any
//! riddle of logic.

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

    /// Combines two sets. A result that has sides of planes, but no piece, becomes the empty set.
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
        // A surface that is not among the planes divides no pieces, and a closed set has its surface: so all
        // belong to it.
        plane.map_or(Pieces::ALL, |(k, same_side)| {
            Pieces(self.sets.borrow_mut().side(k, same_side))
        })
    }
}
