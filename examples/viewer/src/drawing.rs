//! The lines of fields, drawn into a window of kiss3d.

use clap::ValueEnum;
use kiss3d::color::Color;
use kiss3d::glamx::Vec3;
use kiss3d::window::Window;
use rapier3d_fields::debug_render::FieldDebugRenderMode as Mode;
use rapier3d_fields::prelude::*;

/// A part of fields that can be drawn.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// The outlines of regions.
    Regions,
    /// The forces and torques on bodies.
    Wrenches,
    /// The contacts that fields found, and where Rapier disagrees.
    Contacts,
    /// Arrows on a plane.
    Slice,
    /// Arrows in a cube.
    Volume,
    /// Stream lines.
    Streams,
    /// The fields that count, as colours of the arrows' points.
    Counting,
}

impl Part {
    /// The parts that are drawn at first.
    pub fn usual() -> Vec<Part> {
        vec![Part::Regions, Part::Wrenches, Part::Contacts]
    }

    pub fn label(self) -> &'static str {
        match self {
            Part::Regions => "regions",
            Part::Wrenches => "forces on bodies",
            Part::Contacts => "contacts, disagreements",
            Part::Slice => "arrows on a plane",
            Part::Volume => "arrows in a cube",
            Part::Streams => "stream lines",
            Part::Counting => "points show the fields that count",
        }
    }

    pub fn flag(self) -> Mode {
        match self {
            Part::Regions => Mode::REGIONS,
            Part::Wrenches => Mode::WRENCHES,
            Part::Contacts => Mode::CONTACTS,
            Part::Slice => Mode::SLICE_ARROWS,
            Part::Volume => Mode::VOLUME_ARROWS,
            Part::Streams => Mode::STREAM_LINES,
            Part::Counting => Mode::COUNTING_FIELDS,
        }
    }
}

pub fn mode(parts: &[Part]) -> Mode {
    let flags = parts.iter().map(|part| part.flag());
    flags.fold(Mode::empty(), |all, flag| all | flag)
}

/// Draws each line into a window, for its next frame.
pub struct Lines<'a> {
    pub window: &'a mut Window,
    /// The width of lines, in pixels.
    pub width: f32,
}

impl DebugRenderBackend for Lines<'_> {
    fn draw_line(&mut self, _: DebugRenderObject<'_>, a: Vector, b: Vector, color: DebugColor) {
        let [a, b] = [a, b].map(|end| Vec3::new(end.x, end.y, end.z));
        self.window.draw_line(a, b, paint(color), self.width, false);
    }
}

/// A colour of Rapier (hue in degrees, saturation, lightness, alpha) in red, green, blue and alpha.
pub fn paint([hue, saturation, lightness, alpha]: DebugColor) -> Color {
    let strength = saturation * lightness.min(1.0 - lightness);
    let channel = |offset: f32| {
        let turn = (offset + hue / 30.0).rem_euclid(12.0);
        lightness - strength * (turn - 3.0).min(9.0 - turn).clamp(-1.0, 1.0)
    };
    Color::new(channel(0.0), channel(8.0), channel(4.0), alpha)
}
