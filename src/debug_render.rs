//! Drawing of fields for debugging, through the backends of Rapier's debug-renderer.

mod arrow;
mod arrows;
mod bodies;
mod contacts;
mod mode;
mod outline;
mod pen;
mod placed;
mod plane;
mod regions;
mod scene;
mod signs;
mod streams;
mod style;
mod view;

pub use mode::FieldDebugRenderMode;
pub use pen::FieldDebugRenderOutcome;
pub use style::FieldDebugRenderStyle;

use crate::bridge::WorldRef;
use crate::fields::Fields;
use crate::rapier::dynamics::{RigidBody, RigidBodyBuilder};
use crate::rapier::pipeline::DebugRenderBackend;
use outline::Outlines;
use pen::Pen;
use scene::DrawnScene;

/// Draws fields by coloured lines, as Rapier's `DebugRenderPipeline` draws bodies: through the same backends, in world
/// space, with one call a frame.
///
/// The [mode](FieldDebugRenderMode) switches its parts, and the [style](FieldDebugRenderStyle) has the colours, the
/// numbers of points and the sizes.
///
/// Lines of a field on a body, and of the wrench on a body, have this body as their `DebugRenderObject`, and lines of a
/// contact have its first collider, so that a backend may filter them. All other lines have a fixed body that is in no
/// world, under `RigidBodyHandle::invalid()`.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// use rapier3d_fields::debug_render::{FieldDebugRenderMode, FieldDebugRenderPipeline};
///
/// #[derive(Default)]
/// struct Lines(Vec<[Vector; 2]>);
///
/// impl DebugRenderBackend for Lines {
///     fn draw_line(&mut self, _: DebugRenderObject, a: Vector, b: Vector, _: DebugColor) {
///         self.0.push([a, b]);
///     }
/// }
///
/// let mut world = PhysicsWorld::new();
/// let start = RigidBodyBuilder::dynamic().translation(Vector::X * 3.0);
/// world.insert(start, ColliderBuilder::ball(0.5));
/// let planet = Field::point_gravity(4.0).within(Region::ball(9.0));
/// let mut fields = Fields::new(planet)?;
/// fields.step(&mut world)?;
///
/// let mut lines = Lines::default();
/// let mut pipeline = FieldDebugRenderPipeline::default();
/// pipeline.mode = FieldDebugRenderMode::REGIONS | FieldDebugRenderMode::WRENCHES;
/// let outcome = pipeline.render(&mut lines, &fields, &world);
/// assert_eq!(lines.0.len(), outcome.lines);
/// assert!(!outcome.limit_reached);
/// # Ok::<(), StepError>(())
/// ```
pub struct FieldDebugRenderPipeline {
    /// The colours, numbers of points and sizes.
    pub style: FieldDebugRenderStyle,
    /// The parts that are drawn.
    pub mode: FieldDebugRenderMode,
    outlines: Outlines,
    /// The object of lines that belong to no body.
    no_body: RigidBody,
}

impl Default for FieldDebugRenderPipeline {
    fn default() -> Self {
        Self::new(Default::default(), Default::default())
    }
}

impl FieldDebugRenderPipeline {
    /// A pipeline with a style and a mode.
    pub fn new(style: FieldDebugRenderStyle, mode: FieldDebugRenderMode) -> Self {
        FieldDebugRenderPipeline {
            outlines: Outlines::new(&style),
            style,
            mode,
            no_body: RigidBodyBuilder::fixed().build(),
        }
    }

    /// A pipeline that draws all parts.
    pub fn render_all(style: FieldDebugRenderStyle) -> Self {
        Self::new(style, FieldDebugRenderMode::all())
    }

    /// Draws the fields in the present world, and the wrenches and contacts of their last step. Lengths and points are
    /// in world space.
    ///
    /// The parts are drawn in the order of their flags. Drawing stops at
    /// [`max_lines`](FieldDebugRenderStyle::max_lines) lines, which the outcome reports. A line with an end that is
    /// infinite or NaN is left out and counted, and a field whose anchor is gone is left out.
    ///
    /// Arrows and stream lines evaluate the fields by [`Fields::values_at`] at each of their points.
    pub fn render<'a>(
        &mut self,
        backend: &mut impl DebugRenderBackend,
        fields: &Fields,
        world: impl Into<WorldRef<'a>>,
    ) -> FieldDebugRenderOutcome {
        self.outlines.follow(&self.style);
        let scene = DrawnScene::new(fields, world.into(), &self.style);
        let mut pen = Pen::new(backend, &self.no_body, self.style.max_lines);
        let draws = |part| self.mode.contains(part);
        if draws(FieldDebugRenderMode::REGIONS) {
            regions::draw(&mut pen, &scene, &mut self.outlines);
        }
        if draws(FieldDebugRenderMode::WRENCHES) {
            bodies::draw(&mut pen, &scene);
        }
        if draws(FieldDebugRenderMode::CONTACTS) {
            contacts::draw(&mut pen, &scene);
        }
        let by_field = draws(FieldDebugRenderMode::COUNTING_FIELDS);
        if draws(FieldDebugRenderMode::SLICE_ARROWS) {
            arrows::draw_slice(&mut pen, &scene, by_field);
        }
        if draws(FieldDebugRenderMode::VOLUME_ARROWS) {
            arrows::draw_volume(&mut pen, &scene, by_field);
        }
        if draws(FieldDebugRenderMode::STREAM_LINES) {
            streams::draw(&mut pen, &scene);
        }
        pen.outcome()
    }
}
