//! Groups equal shapes into kinds, so that moments, samples and meshes are computed once for each kind.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use super::content;
use super::moments::Moments;
use super::rule::Quadrature;
use super::{surface, volume};
use crate::field::Points;
use crate::math::{Real, SharedShape, Vector};
use crate::sample::part_shape::PartSolid;

/// The values computed for shapes of one kind.
#[derive(Debug)]
pub(super) struct Known {
    /// One of the shapes.
    pub shape: SharedShape,
    pub ball: (Vector, Real),
    moments: OnceLock<Option<Moments>>,
    /// The samples for each set of [`Points`]; `None` if not yet computed.
    pub rules: [Option<Arc<Quadrature>>; Points::ALL.len()],
    /// `None` if not yet computed.
    pub solid: Option<PartSolid>,
}

impl Known {
    fn of(shape: &SharedShape) -> Self {
        let bounds = shape.compute_local_bounding_sphere();
        Known {
            shape: shape.clone(),
            ball: (bounds.center, bounds.radius),
            moments: OnceLock::new(),
            rules: Default::default(),
            solid: None,
        }
    }

    /// The samples of a set of points; `middle` alone if the shape has none.
    pub(super) fn rule(&mut self, points: Points, middle: Vector) -> Arc<Quadrature> {
        if let Some(rule) = &self.rules[points as usize] {
            return rule.clone();
        }
        let few = |all: Arc<Quadrature>| all.few().map_or(all, Arc::new);
        let or_middle =
            |rule: Option<Quadrature>| rule.unwrap_or_else(|| Quadrature::single(middle)).into();
        let rule = match points {
            Points::Volume => {
                let moments = self.moments();
                or_middle(moments.and_then(|it| volume::rule(&self.shape, it)))
            }
            Points::Surface => or_middle(surface::rule(&self.shape)),
            Points::FewOfVolume => few(self.rule(Points::Volume, middle)),
            Points::FewOfSurface => few(self.rule(Points::Surface, middle)),
        };
        self.rules[points as usize] = Some(rule.clone());
        rule
    }

    /// The moments of the volume; `None` if the shape has no volume.
    pub(super) fn moments(&self) -> Option<&Moments> {
        let moments = self.moments.get_or_init(|| Moments::of(&self.shape));
        moments.as_ref()
    }
}

/// The kinds of shapes that colliders have.
#[derive(Debug, Default)]
pub(super) struct Kinds {
    list: Vec<Option<ShapeKind>>,
    /// Numbers of vacant entries of the list.
    free: Vec<usize>,
    by_content: HashMap<Arc<[u64]>, usize>,
    /// A buffer.
    words: Vec<u64>,
}

#[derive(Debug)]
struct ShapeKind {
    known: Known,
    /// `None` for shapes that cannot be compared: each is a kind of its own.
    content: Option<Arc<[u64]>>,
    /// The number of colliders that have this kind.
    users: usize,
}

impl Kinds {
    /// The number of the kind of a shape, for one more collider.
    pub(super) fn take(&mut self, shape: &SharedShape) -> usize {
        self.words.clear();
        let is_plain = content::of(shape, &mut self.words).is_some();
        let alike = self.by_content.get(&self.words[..]).filter(|_| is_plain);
        if let Some(number) = alike.copied()
            && let Some(Some(kind)) = self.list.get_mut(number)
        {
            kind.users += 1;
            return number;
        }
        let content = is_plain.then(|| Arc::from(&self.words[..]));
        let kind = Some(ShapeKind {
            known: Known::of(shape),
            content: content.clone(),
            users: 1,
        });
        let number = match self.free.pop() {
            Some(number) => {
                self.list[number] = kind;
                number
            }
            None => {
                self.list.push(kind);
                self.list.len() - 1
            }
        };
        self.by_content.extend(content.map(|it| (it, number)));
        number
    }

    /// Takes one collider off a kind. A kind without colliders is removed.
    pub(super) fn release(&mut self, number: usize) {
        let Some(place) = self.list.get_mut(number) else {
            return;
        };
        let Some(kind) = place else {
            return;
        };
        kind.users -= 1;
        if kind.users == 0 {
            if let Some(content) = &kind.content {
                self.by_content.remove(content);
            }
            *place = None;
            self.free.push(number);
        }
    }

    pub(super) fn get_mut(&mut self, number: usize) -> Option<&mut Known> {
        let kind = self.list.get_mut(number)?.as_mut()?;
        Some(&mut kind.known)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Pose;
    use crate::rapier::parry::shape::TriMeshFlags;

    impl Kinds {
        fn count(&self) -> usize {
            self.list.iter().flatten().count()
        }
    }

    fn hull(x: Real) -> SharedShape {
        let corners = [Vector::ZERO, Vector::X * x, Vector::Y, Vector::Z];
        SharedShape::convex_hull(&corners).expect("a tetrahedron")
    }

    /// Computing each by itself took 0.3 ms for a capsule.
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
        let makes: [&dyn Fn() -> SharedShape; 12] = [
            &|| SharedShape::capsule_y(0.5, 0.2),
            &|| SharedShape::capsule_x(0.5, 0.2),
            &|| SharedShape::cylinder(0.5, 0.2),
            &|| SharedShape::cone(0.5, 0.2),
            &|| SharedShape::cuboid(0.5, 0.2, 0.1),
            &|| SharedShape::round_cuboid(0.5, 0.2, 0.1, 0.05),
            &|| hull(1.0),
            &|| hull(2.0),
            &|| mesh(TriMeshFlags::empty()),
            &|| mesh(TriMeshFlags::ORIENTED),
            &|| heap(0.5),
            &|| heap(0.6),
        ];
        let mut kinds = Kinds::default();
        let taken = makes.map(|make| {
            let first = kinds.take(&make());
            for _ in 1..100 {
                assert_eq!(kinds.take(&make()), first);
            }
            first
        });
        assert_eq!(kinds.count(), makes.len(), "none is like another");
        for number in taken {
            for _ in 0..100 {
                assert!(kinds.get_mut(number).is_some());
                kinds.release(number);
            }
        }
        assert_eq!(kinds.count(), 0, "nothing is kept");
        assert!(kinds.by_content.is_empty());
        kinds.take(&hull(3.0));
        assert_eq!(kinds.list.len(), makes.len(), "places are used again");
    }
}
