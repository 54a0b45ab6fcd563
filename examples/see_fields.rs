//! A picture of fields without a window: the lines of both debug-renderers, as an SVG file.
//!
//! `cargo run --example see_fields --features debug-render -- picture.svg`

use std::fmt::Write;

use rapier3d_fields::debug_render::FieldDebugRenderMode as Mode;
use rapier3d_fields::debug_render::{FieldDebugRenderPipeline, FieldDebugRenderStyle};
use rapier3d_fields::prelude::*;

/// The width and height of the picture, in pixels, and the length of a unit of the world in it.
const SIZE: [Real; 2] = [1000.0, 620.0];
const SCALE: Real = 44.0;

/// Projects lines onto the picture, seen a little from the right and from above.
struct Picture {
    eye: Rotation,
    svg: String,
    width: f32,
}

impl Picture {
    fn new() -> Self {
        let [width, height] = SIZE;
        let mut svg =
            format!("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}'>");
        svg += "<rect width='100%' height='100%' fill='white'/><g stroke-linecap='round'>";
        let eye = Rotation::from_rotation_x(0.3) * Rotation::from_rotation_y(-0.25);
        Picture {
            eye,
            svg,
            width: 1.0,
        }
    }

    fn project(&self, point: Vector) -> [Real; 2] {
        let seen = self.eye * point * SCALE;
        [SIZE[0] / 2.0 + seen.x, SIZE[1] / 2.0 - seen.y]
    }

    /// Writes an entry of the legend, below the picture.
    fn legend(&mut self, column: usize, name: &str, color: DebugColor) {
        let (x, paint) = (40 + 160 * column, css(color));
        let _ = writeln!(
            self.svg,
            "<path d='M{x} 602h26' stroke='{paint}' stroke-width='4'/>\
             <text x='{}' y='607' font-family='sans-serif' font-size='15'>{name}</text>",
            x + 36
        );
    }

    fn finish(mut self) -> String {
        self.svg += "</g></svg>";
        self.svg
    }
}

impl DebugRenderBackend for Picture {
    fn draw_line(&mut self, _: DebugRenderObject<'_>, a: Vector, b: Vector, color: DebugColor) {
        let ([x1, y1], [x2, y2]) = (self.project(a), self.project(b));
        let (width, paint) = (self.width, css(color));
        let _ = writeln!(
            self.svg,
            "<path d='M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}' stroke='{paint}' stroke-width='{width}'/>"
        );
    }
}

/// A colour of Rapier in the notation of CSS.
fn css([hue, saturation, lightness, alpha]: DebugColor) -> String {
    let [saturation, lightness] = [saturation, lightness].map(|share| share * 100.0);
    format!("hsla({hue:.0},{saturation:.0}%,{lightness:.0}%,{alpha:.2})")
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1);
    let path = path.unwrap_or_else(|| "see_fields.svg".to_owned());
    let (mut world, moon) = world();
    let mut fields = Fields::new(tree(moon))?;
    for _ in 0..45 {
        fields.step(&mut world)?;
    }

    let mut picture = Picture::new();
    let mut pipeline = FieldDebugRenderPipeline::default();
    pipeline.style.centre = Some(Vector::ZERO);
    pipeline.style.half_size = Some(10.0);
    pipeline.style.slice_points = 34;
    pipeline.style.stream_seeds = seeds();
    pipeline.style.stream_step = Some(0.1);
    pipeline.style.stream_steps = 150;
    // Thin lines first, so that bodies and forces lie above them.
    for (mode, width) in [
        (Mode::REGIONS, 0.8),
        (Mode::STREAM_LINES, 1.4),
        (Mode::SLICE_ARROWS | Mode::COUNTING_FIELDS, 1.2),
    ] {
        (pipeline.mode, picture.width) = (mode, width);
        let outcome = pipeline.render(&mut picture, &fields, &world);
        println!("{mode:?}: {} lines", outcome.lines);
    }
    let mut bodies = DebugRenderPipeline::default();
    bodies.style.rigid_body_axes_length = 0.0;
    bodies.render_colliders(&mut picture, &world.bodies, &world.colliders);
    (pipeline.mode, picture.width) = (Mode::WRENCHES, 3.0);
    pipeline.render(&mut picture, &fields, &world);
    for (column, (handle, field)) in fields.set.iter().enumerate() {
        let color = FieldDebugRenderStyle::field_color(handle);
        picture.legend(column, field.name().unwrap_or("field"), color);
    }
    picture.legend(4, "stream lines", pipeline.style.stream_color);
    picture.legend(5, "force on a body", pipeline.style.force_color);
    std::fs::write(&path, picture.finish())?;
    println!("written to {path}");
    Ok(())
}

/// A planet, a moon around it, and some bodies in the wind and in the vortex.
fn world() -> (PhysicsWorld, RigidBodyHandle) {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let planet = RigidBodyBuilder::fixed().translation(Vector::new(-5.0, 0.0, 0.0));
    world.insert(planet, ColliderBuilder::ball(1.2));
    let mut ball = |x: Real, y: Real, velocity: Vector| {
        let start = RigidBodyBuilder::dynamic().translation(Vector::new(x, y, 0.0));
        let start = start.linvel(velocity);
        world.insert(start, ColliderBuilder::ball(0.3).mass(1.0)).0
    };
    let moon = ball(-2.0, 0.0, Vector::Y * 3.0);
    ball(2.6, 3.4, Vector::ZERO);
    ball(6.5, -3.0, Vector::Y);
    (world, moon)
}

/// Gravity, in which a shield around the moon replaces it; a wind zone; and a vortex around an axis of its own.
fn tree(moon: RigidBodyHandle) -> Tree {
    let planet = Field::point_gravity(27.0)
        .within(Region::ball(4.5).difference(Region::ball(1.2)))
        .at(Vector::new(-5.0, 0.0, 0.0))
        .named("planet");
    let shield = Field::radial(4.0, 0.0)
        .within(Region::ball(1.2))
        .at(moon)
        .named("shield");
    let wind = Field::wind_zone(
        Vector::new(6.0, 1.5, 0.0),
        0.5,
        0.0,
        Region::cuboid(Vector::new(3.8, 1.4, 1.4)),
    )
    .at(Vector::new(4.6, 3.5, 0.0))
    .named("wind");
    let upright = Rotation::from_rotation_x(std::f64::consts::FRAC_PI_2 as Real);
    let vortex = Field::vortex(5.0, -1.0)
        .smoothed(0.6)
        .within(Region::cylinder(1.0, 3.2))
        .at(Pose::from_parts(Vector::new(4.6, -2.6, 0.0), upright))
        .named("vortex");
    planet.replace_union(shield) + wind + vortex
}

/// The beginnings of stream lines: around the planet, at the windward side of the wind zone, and in the vortex.
fn seeds() -> Vec<Vector> {
    let around = (0..10).map(|number| {
        let angle = number as Real * 0.628;
        Vector::new(-5.0 + 4.4 * angle.cos(), 4.4 * angle.sin(), 0.0)
    });
    let windward = (0..4).map(|row| Vector::new(0.9, 2.3 + 0.5 * row as Real, 0.0));
    let inside = (1..5).map(|ring| Vector::new(4.6 + 0.7 * ring as Real, -2.6, 0.0));
    around.chain(windward).chain(inside).collect()
}
