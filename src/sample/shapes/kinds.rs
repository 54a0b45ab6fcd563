//! Groups equal shapes into kinds, so that moments, samples and meshes are computed once for each kind.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::sync::{Arc, OnceLock, Weak};

use super::content;
use super::moments::Moments;
use super::rule::Quadrature;
use super::{surface, volume};
use crate::field::{Fingerprint, Points};
use crate::math::{Real, SharedShape, Vector};
use crate::sample::part_shape::PartSolid;

/// The values computed for shapes of one kind.
#[derive(Debug)]
pub(super) struct Known {
    /// One of the shapes.
    pub shape: SharedShape,
    pub ball: (Vector, Real),
    moments: OnceLock<Option<Moments>>,
    /// The samples for each set of [`Points`].
    rules: [OnceLock<Arc<Quadrature>>; Points::ALL.len()],
    pub solid: OnceLock<PartSolid>,
}

impl Known {
    fn of(shape: &SharedShape) -> Self {
        let bounds = shape.compute_local_bounding_sphere();
        Known {
            shape: shape.clone(),
            ball: (bounds.center, bounds.radius),
            moments: OnceLock::new(),
            rules: Default::default(),
            solid: OnceLock::new(),
        }
    }

    /// The samples at a set of points; `middle` alone if the shape has no such points.
    pub(super) fn rule(&self, points: Points, middle: Vector) -> Arc<Quadrature> {
        let few = |all: Arc<Quadrature>| all.few().map_or(all, Arc::new);
        let or_middle =
            |rule: Option<Quadrature>| rule.unwrap_or_else(|| Quadrature::single(middle)).into();
        let make = || match points {
            Points::Volume => {
                let moments = self.moments();
                or_middle(moments.and_then(|it| volume::rule(&self.shape, it)))
            }
            Points::Surface => or_middle(surface::rule(&self.shape)),
            Points::FewOfVolume => few(self.rule(Points::Volume, middle)),
            Points::FewOfSurface => few(self.rule(Points::Surface, middle)),
        };
        self.rules[points as usize].get_or_init(make).clone()
    }

    /// The moments of the volume; `None` if the shape has no volume.
    pub(super) fn moments(&self) -> Option<&Moments> {
        let moments = self.moments.get_or_init(|| Moments::of(&self.shape));
        moments.as_ref()
    }
}

/// The kinds of shapes that colliders have. Each is kept as long as a collider has such a shape.
#[derive(Debug, Default)]
pub(super) struct Kinds {
    by_content: HashMap<Vec<u64>, Weak<Known>, BuildHasherDefault<Fingerprint>>,
    /// A buffer for the content of a shape.
    words: Vec<u64>,
}

impl Kinds {
    /// The kind of a shape.
    pub(super) fn take(&mut self, shape: &SharedShape) -> Arc<Known> {
        self.words.clear();
        if content::of(shape, &mut self.words).is_none() {
            // A shape that cannot be compared is a kind of its own.
            return Arc::new(Known::of(shape));
        }
        let alike = self.by_content.get(&self.words[..]);
        if let Some(known) = alike.and_then(Weak::upgrade) {
            return known;
        }
        let known = Arc::new(Known::of(shape));
        if self.by_content.len() == self.by_content.capacity() {
            self.by_content.retain(|_, kind| kind.strong_count() > 0);
        }
        let kind = Arc::downgrade(&known);
        self.by_content.insert(self.words.clone(), kind);
        known
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Pose;
    use crate::rapier::parry::shape::TriMeshFlags;

    impl Kinds {
        fn count(&self) -> usize {
            let kinds = self.by_content.values();
            kinds.filter(|kind| kind.strong_count() > 0).count()
        }
    }

    fn hull(x: Real) -> SharedShape {
        let corners = [Vector::ZERO, Vector::X * x, Vector::Y, Vector::Z];
        SharedShape::convex_hull(&corners).expect("a tetrahedron")
    }

    /// Without kinds each capsule took 0.3 ms.
    #[test]
    fn equal_shapes_are_one_kind() {
        let mesh = |flags| {
            let (points, corners) = (vec![Vector::ZERO, Vector::X, Vector::Y], vec![[0, 1, 2]]);
            SharedShape::trimesh_with_flags(points, corners, flags).expect("a triangle")
        };
        let heap = |x| {
            let part = (
                Pose::from_translation(Vector::Y),
                SharedShape::capsule_y(x, 0.2),
            );
            SharedShape::compound(vec![part])
        };
        let round_hull = |border| {
            let corners = [Vector::ZERO, Vector::X, Vector::Y, Vector::Z];
            SharedShape::round_convex_hull(&corners, border).expect("a tetrahedron")
        };
        let makes: [&dyn Fn() -> SharedShape; 25] = [
            &|| SharedShape::capsule_y(0.5, 0.2),
            &|| SharedShape::capsule_y(0.5, 0.3),
            &|| SharedShape::capsule_y(0.6, 0.2),
            &|| SharedShape::capsule_x(0.5, 0.2),
            &|| SharedShape::cylinder(0.5, 0.2),
            &|| SharedShape::cylinder(0.5, 0.3),
            &|| SharedShape::cone(0.5, 0.2),
            &|| SharedShape::cone(0.6, 0.2),
            &|| SharedShape::cuboid(0.5, 0.2, 0.1),
            &|| SharedShape::cuboid(0.5, 0.2, 0.2),
            &|| SharedShape::round_cuboid(0.5, 0.2, 0.1, 0.05),
            &|| SharedShape::round_cuboid(0.5, 0.2, 0.1, 0.06),
            &|| SharedShape::round_cylinder(0.5, 0.2, 0.05),
            &|| SharedShape::round_cylinder(0.5, 0.2, 0.06),
            &|| SharedShape::round_cylinder(0.5, 0.3, 0.05),
            &|| SharedShape::round_cone(0.5, 0.2, 0.05),
            &|| SharedShape::round_cone(0.5, 0.2, 0.06),
            &|| hull(1.0),
            &|| hull(2.0),
            &|| round_hull(0.05),
            &|| round_hull(0.06),
            &|| mesh(TriMeshFlags::empty()),
            &|| mesh(TriMeshFlags::ORIENTED),
            &|| heap(0.5),
            &|| heap(0.6),
        ];
        let mut kinds = Kinds::default();
        let taken = makes.map(|make| {
            let first = kinds.take(&make());
            for _ in 1..100 {
                assert!(Arc::ptr_eq(&kinds.take(&make()), &first));
            }
            first
        });
        assert_eq!(kinds.count(), makes.len(), "none is like another");
        drop(taken);
        assert_eq!(kinds.count(), 0, "nothing is kept");
        let room = kinds.by_content.capacity();
        for k in 0..10 * room {
            kinds.take(&SharedShape::cuboid(k as Real, 1.0, 1.0));
        }
        assert!(kinds.by_content.capacity() <= room, "places are used again");
    }
}
