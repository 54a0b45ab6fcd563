//! At which points the shapes of colliders are sampled: worked out once per shape, and kept.

mod mesh;
mod moments;
mod rule;
mod surface;
mod volume;

use std::sync::Arc;

use super::cells::{Cells, Content};
use super::part_shape::{Mesh, PartSolid};
use crate::math::{ColliderHandle, DVec3, Real, SharedShape, Vector, to_f64};
use crate::rapier::data::Coarena;
use crate::rapier::geometry::Collider;
use moments::Moments;
pub(super) use rule::Rule;

/// The samples of all shapes met so far.
#[derive(Debug, Default)]
pub(crate) struct Shapes {
    known: Coarena<Option<Known>>,
    /// What a grid around a ball holds of it, the same for all balls.
    ball: Option<Arc<Content>>,
    /// That of a ball of radius one.
    ball_mesh: Option<Arc<Mesh>>,
}

/// What is known of the shape of a collider.
#[derive(Clone, Debug)]
struct Known {
    /// Kept, so that whoever changes the shape gets a copy, and the collider another pointer.
    shape: SharedShape,
    ball: (Vector, Real),
    moments: Option<Moments>,
    volume: Option<Arc<Rule>>,
    surface: Option<Arc<Rule>>,
    cells: Option<Cells>,
    /// `None` if it is still to be made.
    solid: Option<PartSolid>,
}

impl Shapes {
    /// The volume of a collider; zero if it has none.
    pub(super) fn measure(&mut self, handle: ColliderHandle, collider: &Collider) -> f64 {
        if let Some(ball) = collider.shape().as_ball() {
            return std::f64::consts::PI * 4.0 / 3.0 * to_f64(ball.radius).powi(3);
        }
        let known = self.known(handle, collider);
        known
            .and_then(|known| known.moments.as_ref())
            .map_or(0.0, |moments| moments.measure)
    }

    /// A ball around a collider, in its frame; infinite around what has no bounds.
    pub(super) fn bounding_ball(
        &mut self,
        handle: ColliderHandle,
        collider: &Collider,
    ) -> (Vector, Real) {
        let known = self.known(handle, collider);
        known.map_or((Vector::ZERO, Real::INFINITY), |known| known.ball)
    }

    /// The samples of a collider's volume, or of its surface; `middle` where it has none.
    pub(super) fn rule(
        &mut self,
        (handle, collider): (ColliderHandle, &Collider),
        of_volume: bool,
        middle: Vector,
    ) -> Option<Arc<Rule>> {
        let known = self.known(handle, collider)?;
        let (shape, moments) = (&known.shape, known.moments.as_ref());
        let rule = match of_volume {
            true => &mut known.volume,
            false => &mut known.surface,
        };
        let make = || match of_volume {
            true => moments.and_then(|moments| volume::rule(shape, moments)),
            false => surface::rule(shape),
        };
        let or_single = || Arc::new(make().unwrap_or_else(|| Rule::single(middle)));
        Some(rule.get_or_insert_with(or_single).clone())
    }

    /// The cells a collider can be cut into, if it has a volume.
    pub(super) fn cells(&mut self, handle: ColliderHandle, collider: &Collider) -> Option<Cells> {
        if let Some(ball) = collider.shape().as_ball() {
            let content = match &self.ball {
                Some(content) => content.clone(),
                None => {
                    let unit = SharedShape::ball(1.0);
                    let content = Arc::new(volume::content(&unit, DVec3::NEG_ONE, DVec3::ONE)?);
                    self.ball.insert(content).clone()
                }
            };
            let extent = DVec3::splat(to_f64(ball.radius));
            return Some(Cells::partly(-extent, extent, content, DVec3::ZERO));
        }
        let known = self.known(handle, collider)?;
        if known.cells.is_none() {
            known.cells = known
                .moments
                .as_ref()
                .and_then(|moments| volume::cells(&known.shape, moments));
        }
        known.cells.clone()
    }

    /// What is cut of a collider.
    pub(super) fn solid(&mut self, handle: ColliderHandle, collider: &Collider) -> PartSolid {
        if let Some(ball) = collider.shape().as_ball() {
            let known = self.ball_mesh.take();
            let mesh = known.or_else(|| mesh::of(&SharedShape::ball(1.0)).map(Arc::new));
            self.ball_mesh = mesh.clone();
            let of_radius = |mesh| PartSolid::Ball(to_f64(ball.radius), mesh);
            return mesh.map_or(PartSolid::Point, of_radius);
        }
        let Some(known) = self.known(handle, collider) else {
            return PartSolid::Point;
        };
        let shape = &known.shape;
        let make = || mesh::of(shape).map_or(PartSolid::Point, |mesh| PartSolid::Mesh(mesh.into()));
        known.solid.get_or_insert_with(make).clone()
    }

    fn known(&mut self, handle: ColliderHandle, collider: &Collider) -> Option<&mut Known> {
        let shape = collider.shared_shape();
        let known = self.known.get(handle.0).and_then(Option::as_ref);
        let same = known.is_some_and(|known| std::ptr::addr_eq(&*known.shape.0, &*shape.0));
        if !same {
            let bounds = shape.compute_local_bounding_sphere();
            let known = Known {
                shape: shape.clone(),
                ball: (bounds.center, bounds.radius),
                moments: Moments::of(shape),
                volume: None,
                surface: None,
                cells: None,
                solid: None,
            };
            self.known.insert(handle.0, Some(known));
        }
        self.known.get_mut(handle.0)?.as_mut()
    }
}
