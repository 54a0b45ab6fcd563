//! The points at which the shapes of colliders are sampled, and the meshes that are cut at borders. They are
//! computed once for equal shapes, and kept as long as a collider has such a shape.

mod content;
mod kinds;
mod mesh;
mod moments;
mod rule;
mod surface;
mod volume;

use std::sync::Arc;

use super::part_shape::{Mesh, PartSolid};
use crate::field::Points;
use crate::math::{ColliderHandle, Real, SharedShape, Vector, to_f64};
use crate::rapier::data::Coarena;
use crate::rapier::geometry::Collider;
use kinds::{Kinds, Known};
pub(super) use rule::Quadrature;

/// The samples and meshes of all shapes that colliders have had.
#[derive(Debug, Default)]
pub(crate) struct Shapes {
    colliders: Coarena<Option<Met>>,
    kinds: Kinds,
    /// The mesh of a ball of radius one.
    ball_mesh: Option<Arc<Mesh>>,
}

/// The shape of a collider when it was last seen.
#[derive(Clone, Debug)]
struct Met {
    /// Held so that Rapier copies the shape before a change, and the changed shape has another address.
    shape: SharedShape,
    known: Arc<Known>,
}

impl Shapes {
    /// The samples of the shapes that are known so far, for a question between steps.
    pub(super) fn share(&self) -> Self {
        Shapes {
            colliders: self.colliders.clone(),
            kinds: Kinds::default(),
            ball_mesh: self.ball_mesh.clone(),
        }
    }

    /// The volume of a collider; zero if it has none.
    pub(super) fn measure(&mut self, handle: ColliderHandle, collider: &Collider) -> f64 {
        if let Some(ball) = collider.shape().as_ball() {
            return std::f64::consts::PI * 4.0 / 3.0 * to_f64(ball.radius).powi(3);
        }
        let known = self.known(handle, collider);
        known.moments().map_or(0.0, |moments| moments.measure)
    }

    /// The point of a collider's single sample, in the collider's frame, and the radius of that sample.
    pub(super) fn middle(&mut self, handle: ColliderHandle, collider: &Collider) -> (Vector, Real) {
        if let Some(ball) = collider.shape().as_ball() {
            return (Vector::ZERO, ball.radius);
        }
        let ball = self.bounding_ball(handle, collider);
        let bounded = ball.1.is_finite();
        if bounded { ball } else { (Vector::ZERO, 0.0) }
    }

    /// A ball around a collider, in its frame; infinite for shapes without bounds.
    pub(super) fn bounding_ball(
        &mut self,
        handle: ColliderHandle,
        collider: &Collider,
    ) -> (Vector, Real) {
        self.known(handle, collider).ball
    }

    /// The samples of a collider; `middle` alone if its shape has none.
    pub(super) fn rule(
        &mut self,
        handle: ColliderHandle,
        collider: &Collider,
        points: Points,
        middle: Vector,
    ) -> Arc<Quadrature> {
        self.known(handle, collider).rule(points, middle)
    }

    /// The solid of a collider that is cut at borders.
    pub(super) fn solid(&mut self, handle: ColliderHandle, collider: &Collider) -> PartSolid {
        if let Some(ball) = collider.shape().as_ball() {
            let known = self.ball_mesh.take();
            let mesh = known.or_else(|| mesh::of(&SharedShape::ball(1.0)).map(Arc::new));
            self.ball_mesh = mesh.clone();
            let of_radius = |mesh| PartSolid::Ball(to_f64(ball.radius), mesh);
            return mesh.map_or(PartSolid::Point, of_radius);
        }
        let known = self.known(handle, collider);
        let shape = &known.shape;
        let make = || mesh::of(shape).map_or(PartSolid::Point, |mesh| PartSolid::Mesh(mesh.into()));
        known.solid.get_or_init(make).clone()
    }

    fn known(&mut self, handle: ColliderHandle, collider: &Collider) -> Arc<Known> {
        let shape = collider.shared_shape();
        let met = self.colliders.get(handle.0).and_then(Option::as_ref);
        let same = met.filter(|met| std::ptr::addr_eq(&*met.shape.0, &*shape.0));
        if let Some(met) = same {
            return met.known.clone();
        }
        let (shape, known) = (shape.clone(), self.kinds.take(shape));
        let met = Met {
            shape,
            known: known.clone(),
        };
        self.colliders.insert(handle.0, Some(met));
        known
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::ColliderSet;
    use crate::rapier::geometry::ColliderBuilder;

    /// Each question between steps sampled all shapes anew.
    #[test]
    fn shapes_that_are_known_are_not_sampled_again() {
        let (mut shapes, mut colliders) = (Shapes::default(), ColliderSet::new());
        let handle = colliders.insert(ColliderBuilder::cone(0.5, 0.3));
        let collider = &colliders[handle];
        let rule =
            |shapes: &mut Shapes| shapes.rule(handle, collider, Points::Volume, Vector::ZERO);
        let own = rule(&mut shapes);
        assert!(Arc::ptr_eq(&own, &rule(&mut shapes.share())));
        assert!(!Arc::ptr_eq(&own, &rule(&mut Shapes::default())));
    }
}
