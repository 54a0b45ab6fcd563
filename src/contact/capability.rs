//! The precision with which detection fields find contacts, by the two shapes.

use std::collections::BTreeMap;
use std::fmt;

use super::modes::Detection;
use crate::rapier::parry::shape::ShapeType;

/// The method by which detection fields find contacts between colliders of two shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Capability {
    /// Exact to rounding: two balls, or a ball and a half-space. Swept detection computes them in 64 bits, but uses
    /// Parry's distance if the half-space turns.
    Exact,
    /// By Parry, to a few roundings of the size of the parts (in [`Real`](crate::math::Real)): a ball on a convex shape
    /// by projection, all others by the contact manifolds that Rapier uses too. Swept detection finds the time of
    /// impact to those roundings divided by the speed of approach; corners whose gaps differ by less than a thousandth
    /// of the size touch at once.
    ByParry,
    /// Not found: Parry has no contacts between the two shapes, so Rapier finds none either.
    None,
}

impl Capability {
    /// The capability for two shapes, in any order.
    ///
    /// | | ball | half-space | mesh | height field | voxels | all else |
    /// |---|---|---|---|---|---|---|
    /// | ball | exact | exact | by Parry | by Parry | by Parry | by Parry |
    /// | half-space | exact | none | by Parry | by Parry | none | by Parry |
    /// | mesh | by Parry | by Parry | by Parry | none | none | by Parry |
    /// | height field | by Parry | by Parry | none | none | none | by Parry |
    /// | voxels | by Parry | none | none | none | by Parry | by Parry |
    /// | all else | by Parry | by Parry | by Parry | by Parry | by Parry | by Parry |
    ///
    /// "All else" is cuboid, capsule, cylinder, cone, convex hull, triangle, segment, the rounded variants of these,
    /// and compounds. Two segments have no thickness and never overlap. The table holds for both kinds of
    /// [`Detection`]. Between a half-space and voxels Parry panics in Rapier's own step; between a ball and voxels
    /// Rapier 0.36.1 may.
    pub fn of(one: ShapeType, two: ShapeType) -> Self {
        use ShapeType::{Ball, HalfSpace, HeightField, TriMesh, Voxels};
        match (one, two) {
            (Ball, Ball | HalfSpace) | (HalfSpace, Ball) => Capability::Exact,
            (HalfSpace, HalfSpace | Voxels)
            | (Voxels, HalfSpace | HeightField | TriMesh)
            | (TriMesh, HeightField | Voxels)
            | (HeightField, TriMesh | HeightField | Voxels) => Capability::None,
            _ => Capability::ByParry,
        }
    }
}

impl fmt::Display for Capability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Capability::Exact => "exact",
            Capability::ByParry => "by Parry, within roundings of the size",
            Capability::None => "not found by anybody",
        })
    }
}

/// The contacts that detection fields can find in a world, by pairs of shape kinds. Its `Display` is a short report.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ContactPlan {
    /// Pairs of shape kinds, as Parry names them, in alphabetical order, of which at least one side has a detection
    /// field.
    pub pairs: BTreeMap<(String, String), Capability>,
    /// True if contacts are searched for over the whole of each step, false if only at its end.
    pub swept: bool,
}

impl ContactPlan {
    /// `kinds` are the shapes in the world, each with true if a collider of it has a detection field.
    pub(crate) fn new(kinds: &[(ShapeType, bool)], detection: Detection) -> Self {
        let mut pairs = BTreeMap::new();
        for (one, watched) in kinds {
            for (two, also) in kinds {
                let names = [one, two].map(|kind| format!("{kind:?}"));
                let [a, b] = names;
                if (*watched || *also) && a <= b {
                    pairs.insert((a, b), Capability::of(*one, *two));
                }
            }
        }
        ContactPlan {
            pairs,
            swept: detection == Detection::Swept,
        }
    }
}

impl fmt::Display for ContactPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let when = if self.swept {
            "over the whole of each step"
        } else {
            "at the end of each step"
        };
        writeln!(f, "contacts, {when}:")?;
        for ((one, two), capability) in &self.pairs {
            writeln!(f, "  {one} and {two}: {capability}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::overlap::manifold_points;
    use crate::math::{Pose, Real, SharedShape, Vector};
    use crate::rapier::parry::utils::Array2;

    fn shapes() -> Vec<SharedShape> {
        let square = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
        let corners: Vec<Vector> = square
            .iter()
            .map(|(x, z)| Vector::new(*x, 0.0, *z))
            .collect();
        let faces = vec![[0, 1, 2], [0, 2, 3]];
        let [a, b, c, d] = [Vector::X, Vector::Y, Vector::Z, -Vector::ONE];
        let piece = (Pose::IDENTITY, SharedShape::cuboid(0.5, 0.5, 0.5));
        vec![
            SharedShape::ball(0.5),
            SharedShape::cuboid(0.5, 0.5, 0.5),
            SharedShape::capsule_y(0.4, 0.4),
            SharedShape::cylinder(0.5, 0.5),
            SharedShape::cone(0.5, 0.5),
            SharedShape::convex_hull(&[a, b, c, d]).expect("a hull"),
            SharedShape::triangle(a, b, c),
            SharedShape::segment(-Vector::Y, Vector::Y),
            SharedShape::round_cuboid(0.4, 0.4, 0.4, 0.1),
            SharedShape::round_cylinder(0.4, 0.4, 0.1),
            SharedShape::round_cone(0.4, 0.4, 0.1),
            SharedShape::compound(vec![piece]),
            SharedShape::trimesh(corners, faces).expect("a mesh"),
            SharedShape::heightfield(Array2::zeros(3, 3), Vector::splat(2.0)),
            SharedShape::voxels_from_points(Vector::splat(0.5), &[Vector::ZERO, Vector::X]),
            SharedShape::halfspace(Vector::Y),
        ]
    }

    /// Returns true if Parry finds the overlap of two shapes in at least one of many poses.
    fn is_found(one: &SharedShape, two: &SharedShape) -> bool {
        (0..60_u8).any(|number| {
            let turn = Vector::new(0.3, 0.7, 0.2) * Real::from(number);
            let place = Vector::new(0.1, -0.1 + 0.01 * Real::from(number % 7), 0.15);
            let relative = Pose::new(place, turn);
            !manifold_points([one, two], &relative, 0.0).is_empty()
        })
    }

    #[test]
    fn the_table_agrees_with_parry() {
        let mut wrong = Vec::new();
        for one in shapes() {
            for two in shapes() {
                let kinds = [one.shape_type(), two.shape_type()];
                let said = Capability::of(kinds[0], kinds[1]) != Capability::None;
                if kinds == [ShapeType::Segment; 2] {
                    continue;
                }
                if said != is_found(&one, &two) {
                    wrong.push((kinds, said));
                }
            }
        }
        assert!(wrong.is_empty(), "{wrong:?}");
    }
}
