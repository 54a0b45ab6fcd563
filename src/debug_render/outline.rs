//! Outlines of solids, by Rapier's debug-renderer.

use super::pen::Pen;
use super::plane::OutlinePlane;
use super::style::FieldDebugRenderStyle;
use super::view::View;
use crate::field::visit::Solid;
use crate::math::{ColliderSet, Pose, Real, RigidBodySet, SharedShape, Vector};
use crate::rapier::geometry::ColliderBuilder;
use crate::rapier::pipeline::{
    DebugColor, DebugRenderBackend, DebugRenderMode, DebugRenderObject, DebugRenderPipeline,
    DebugRenderStyle,
};

/// Draws outlines of solids.
pub(super) struct Outlines {
    rapier: DebugRenderPipeline,
}

impl Outlines {
    pub fn new(style: &FieldDebugRenderStyle) -> Self {
        let subdivisions = style.subdivisions.clamp(3, 512);
        let style = DebugRenderStyle {
            subdivisions,
            border_subdivisions: (subdivisions / 4).max(2),
            ..DebugRenderStyle::default()
        };
        let mode = DebugRenderMode::COLLIDER_SHAPES;
        Outlines {
            rapier: DebugRenderPipeline::new(style, mode),
        }
    }

    /// Updates the number of subdivisions.
    pub fn follow(&mut self, style: &FieldDebugRenderStyle) {
        if self.rapier.style.subdivisions != style.subdivisions.clamp(3, 512) {
            *self = Outlines::new(style);
        }
    }

    /// Draws the outline of a solid at a pose in the world.
    pub fn draw<B: DebugRenderBackend>(
        &mut self,
        pen: &mut Pen<'_, B>,
        view: &View,
        solid: &Solid,
        pose: &Pose,
        color: DebugColor,
    ) {
        for plane in planes(solid) {
            plane.moved(pose).draw(pen, view, color);
        }
        if let Some(shape) = shape_of(solid) {
            self.draw_shape(pen, shape, pose, color);
        }
    }

    /// Draws the shape of a collider that is in no world, because Rapier draws colliders only.
    fn draw_shape<B: DebugRenderBackend>(
        &mut self,
        pen: &mut Pen<'_, B>,
        shape: SharedShape,
        pose: &Pose,
        color: DebugColor,
    ) {
        let mut colliders = ColliderSet::new();
        colliders.insert(ColliderBuilder::new(shape).position(*pose));
        let mut tinted = Tinted { pen, color };
        self.rapier
            .render_colliders(&mut tinted, &RigidBodySet::new(), &colliders);
    }
}

/// Gives all lines one colour, and the object of the pen.
struct Tinted<'p, 'a, B> {
    pen: &'p mut Pen<'a, B>,
    color: DebugColor,
}

impl<B: DebugRenderBackend> DebugRenderBackend for Tinted<'_, '_, B> {
    fn draw_line(&mut self, _: DebugRenderObject<'_>, a: Vector, b: Vector, _: DebugColor) {
        self.pen.line(a, b, self.color);
    }
}

/// The planes that bound a half-space or a slab, in its own frame; none for other solids.
fn planes(solid: &Solid) -> Vec<OutlinePlane> {
    match solid {
        Solid::HalfSpace { outward } => vec![OutlinePlane {
            point: Vector::ZERO,
            outward: *outward,
        }],
        Solid::Slab { axis, min, max } => {
            let across = Vector::AXES.get(*axis).copied().unwrap_or_default();
            let ends = [*min, *max].into_iter().filter(|end| end.is_finite());
            let plane = |end: Real| OutlinePlane {
                point: across * end,
                outward: across,
            };
            ends.map(plane).collect()
        }
        Solid::Shape(shape) => {
            let half_space = shape.shape().as_halfspace();
            let plane = half_space.map(|half_space| OutlinePlane {
                point: Vector::ZERO,
                outward: half_space.normal,
            });
            plane.into_iter().collect()
        }
        _ => Vec::new(),
    }
}

/// The Parry shape with the outline of a solid. `None` if there is none, or if a size is not positive, which an edit
/// may have left and at which Parry panics.
fn shape_of(solid: &Solid) -> Option<SharedShape> {
    let are_sizes = |sizes: &[Real]| sizes.iter().all(|size| *size > 0.0 && size.is_finite());
    Some(match solid {
        Solid::Ball { radius } if are_sizes(&[*radius]) => SharedShape::ball(*radius),
        Solid::Cuboid { half_extents } if are_sizes(&half_extents.to_array()) => {
            SharedShape::cuboid(half_extents.x, half_extents.y, half_extents.z)
        }
        Solid::Cylinder {
            half_height,
            radius,
        } if are_sizes(&[*half_height, *radius]) => SharedShape::cylinder(*half_height, *radius),
        Solid::Cone {
            half_height,
            radius,
        } if are_sizes(&[*half_height, *radius]) => SharedShape::cone(*half_height, *radius),
        Solid::Capsule {
            half_height,
            radius,
        } if are_sizes(&[*half_height, *radius]) => SharedShape::capsule_y(*half_height, *radius),
        Solid::Shape(shape) if shape.shape().as_halfspace().is_none() => shape.shape().clone(),
        _ => return None,
    })
}
