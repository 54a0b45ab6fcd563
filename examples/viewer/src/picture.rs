//! A picture of a scene, drawn without a window.

use std::path::Path;

use kiss3d::camera::OrbitCamera3d;
use kiss3d::color::Color;
use kiss3d::glamx::Vec3;
use kiss3d::window::OffscreenSurface;
use rapier_testbed3d::egui::Visuals;
use rapier_testbed3d::{GraphicsManager, TestbedStateFlags};
use rapier3d_fields::debug_render::FieldDebugRenderMode;
use rapier3d_fields::prelude::*;

use crate::catalogue::Catalogue;
use crate::drawing::Lines;
use crate::panel;
use crate::session::Session;
use crate::walls;

/// The width and height of pictures, in pixels.
const SIZE: [u32; 2] = [1280, 720];

/// Draws the first scene of a catalogue after some steps.
///
/// # Errors
/// The scene cannot be read, a step is refused, or the picture cannot be written.
pub async fn draw(
    catalogue: &Catalogue,
    path: &Path,
    steps: usize,
    mode: FieldDebugRenderMode,
) -> Result<(), String> {
    let mut session = Session::open(&catalogue.first().path, mode)?;
    for _ in 0..steps {
        session.step();
        if let Some(refused) = session.refused_step {
            return Err(refused);
        }
    }
    let mut surface = OffscreenSurface::new(SIZE[0], SIZE[1]).await;
    surface.set_background_color(Color::new(0.96, 0.96, 0.92, 1.0));
    surface.set_ambient(0.1);
    surface.window_mut().set_shadows_enabled(false);
    let mut graphics = GraphicsManager::new();
    // Which also sets up the lights.
    graphics.clear();
    let world = &session.scene.world;
    for wall in walls::hiding(world) {
        graphics.set_initial_body_color(wall, walls::GLASS);
    }
    for (body, _) in world.bodies.iter() {
        let window = surface.window_mut();
        graphics.add_body_colliders(window, body, &world.bodies, &world.colliders);
    }
    graphics.draw(
        TestbedStateFlags::default(),
        &world.bodies,
        &world.colliders,
        &world.soft_bodies,
    );
    let mut camera = camera(world);
    // The panel takes one frame to find its size.
    for _ in 0..2 {
        let window = surface.window_mut();
        session.draw(&mut Lines { window, width: 2.0 });
        surface.draw_ui(|context| {
            context.set_visuals(Visuals::light());
            panel::show(context, &mut session);
        });
        surface.render_3d(graphics.scene_mut(), &mut camera).await;
    }
    let image = surface.snap_image();
    image
        .save(path)
        .map_err(|error| format!("{}: {error}", path.display()))
}

/// A camera that sees all dynamic bodies.
fn camera(world: &PhysicsWorld) -> OrbitCamera3d {
    let scene = walls::around_dynamic(world);
    let (middle, size) = scene.map_or((Vector::ZERO, 4.0), |it| {
        (it.center(), it.extents().length())
    });
    let eye = middle + Vector::new(0.35, 0.4, 1.0).normalize() * (1.25 * size);
    let [at, eye] = [middle, eye].map(|place| Vec3::new(place.x, place.y, place.z));
    OrbitCamera3d::new(eye, at)
}
