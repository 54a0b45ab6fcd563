//! What fields report of a world, as numbers.

use std::fmt::{Debug, Write};

use rapier3d_fields::debug_render::{
    FieldDebugRenderMode, FieldDebugRenderPipeline, FieldDebugRenderStyle,
};
use rapier3d_fields::math::to_f64;
use rapier3d_fields::pipeline::StepOutcome;
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::pipeline::{DebugColor, DebugRenderBackend, DebugRenderObject};

use crate::draw::Draw;

/// FNV-1a.
pub struct Hash(pub u64);

impl Default for Hash {
    fn default() -> Self {
        Hash(0xcbf2_9ce4_8422_2325)
    }
}

impl Hash {
    pub fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Adds a value as it is printed: all NaNs are alike.
    fn print(&mut self, value: &dyn Debug) {
        write!(self, "{value:?}").expect("hashes take any text");
    }
}

impl Write for Hash {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.add(text.as_bytes());
        Ok(())
    }
}

impl DebugRenderBackend for Hash {
    fn draw_line(&mut self, _: DebugRenderObject<'_>, a: Vector, b: Vector, color: DebugColor) {
        assert!(a.is_finite() && b.is_finite(), "a line from {a} to {b}");
        let ends = a.to_array().into_iter().chain(b.to_array());
        ends.for_each(|it| self.add(&to_f64(it).to_bits().to_le_bytes()));
        self.print(&color);
    }
}

/// What is reported of the last step without being asked for.
pub fn of_step(fields: &Fields, outcome: &StepOutcome) -> u64 {
    let mut hash = Hash::default();
    hash.print(outcome);
    hash.print(&fields.warnings());
    hash.print(&fields.contacts());
    hash.0
}

/// The answers to all questions.
pub fn answers(fields: &Fields, world: &PhysicsWorld, draw: &mut Draw) -> u64 {
    let mut hash = Hash::default();
    let dt = world.integration_parameters.dt;
    hash.print(&fields.potential_energy(world));
    hash.print(&fields.sample_all(dt, world).ok());
    hash.print(&fields.contact_plan(world));
    hash.print(&fields.removed_anchors(world));
    let points = [draw.vector(8.0), draw.vector(2.0), draw.numbers()];
    hash.print(&fields.values_at(&points, world));
    for (handle, _) in world.bodies.iter() {
        hash.print(&fields.explain(handle, world));
        hash.print(&fields.sample(handle, world).ok());
        hash.print(&fields.samples(handle, world));
        hash.print(&fields.stiffness(handle, dt, world).ok());
    }
    let style = FieldDebugRenderStyle {
        max_lines: 2000,
        subdivisions: 6,
        slice_points: 4,
        volume_points: 3,
        stream_points: 3,
        stream_steps: 10,
        ..FieldDebugRenderStyle::default()
    };
    let mut drawing = FieldDebugRenderPipeline::new(style, FieldDebugRenderMode::all());
    let drawn = drawing.render(&mut hash, fields, world);
    hash.print(&drawn);
    hash.0
}
