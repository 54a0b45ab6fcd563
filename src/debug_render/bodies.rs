//! The wrenches of the last step on bodies.

use super::arrow::{Arrow, Gauge, Polar};
use super::pen::Pen;
use super::scene::DrawnScene;
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::rapier::pipeline::{DebugColor, DebugRenderBackend};
use crate::rigid::Wrench;

/// The length of the longest arrow as a share of half the edge of the view, unless the style sets a length.
const LONGEST: Real = 0.4;

/// The wrench on a body, and its centre of mass in world space.
struct PushedBody {
    handle: RigidBodyHandle,
    world_centre: Vector,
    wrench: Wrench,
}

/// Draws an arrow for the force and one for the torque on each body.
pub(super) fn draw<'a, B: DebugRenderBackend>(pen: &mut Pen<'a, B>, scene: &DrawnScene<'a>) {
    let bodies = scene.world.bodies.iter().filter_map(|(handle, body)| {
        Some(PushedBody {
            handle,
            world_centre: body.center_of_mass(),
            wrench: scene.fields.wrench(handle)?,
        })
    });
    let bodies: Vec<_> = bodies.collect();
    let (force, torque) = (scene.style.force_color, scene.style.torque_color);
    draw_each(pen, scene, &bodies, |wrench| wrench.force, force);
    draw_each(pen, scene, &bodies, |wrench| wrench.torque, torque);
}

/// Draws one vector of each wrench.
fn draw_each<'a, B: DebugRenderBackend>(
    pen: &mut Pen<'a, B>,
    scene: &DrawnScene<'a>,
    bodies: &[PushedBody],
    part: impl Fn(&Wrench) -> Vector,
    color: DebugColor,
) {
    let polar = bodies.iter().map(|body| Polar::of(part(&body.wrench)));
    let polar: Vec<_> = polar.collect();
    let magnitudes = polar.iter().flatten().map(|polar| polar.magnitude);
    let gauge = Gauge::new(None, magnitudes);
    let of_view = scene.view.half_size * LONGEST;
    let longest = scene.style.wrench_length.unwrap_or(of_view);
    for (body, polar) in bodies.iter().zip(polar) {
        if pen.is_full() {
            return;
        }
        let Some(polar) = polar else {
            if !part(&body.wrench).is_finite() {
                pen.note_not_finite();
            }
            continue;
        };
        if pen.begin(scene.body(body.handle)) {
            let way = polar.direction * (longest * gauge.share(polar.magnitude));
            Arrow::new(body.world_centre, way, scene.view.normal, color).draw(pen);
        }
    }
}
