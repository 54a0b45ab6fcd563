//! The contacts of the last step, and the disagreements with Rapier about them.

use super::pen::Pen;
use super::scene::DrawnScene;
use crate::math::{Real, Vector};
use crate::rapier::pipeline::{DebugColor, DebugRenderBackend};

/// Draws a cross at each contact, and its normal; and a larger cross at each disagreement.
pub(super) fn draw<'a, B: DebugRenderBackend>(pen: &mut Pen<'a, B>, scene: &DrawnScene<'a>) {
    let style = scene.style;
    let length = style.contact_normal_length;
    for contact in scene.fields.contacts() {
        if pen.is_full() {
            return;
        }
        if pen.begin(scene.collider(contact.colliders[0])) {
            let point = contact.world_point;
            let end = point + contact.world_normal * length;
            pen.line(point, end, style.contact_color);
            draw_cross(pen, point, 0.25 * length, style.contact_color);
        }
    }
    let report = scene.fields.cross_check();
    for found in report.iter().flat_map(|report| &report.disagreements) {
        if pen.is_full() {
            return;
        }
        if pen.begin(scene.collider(found.colliders[0])) {
            draw_cross(
                pen,
                found.world_point,
                0.5 * length,
                style.disagreement_color,
            );
        }
    }
}

/// Draws three lines along the axes of the world.
fn draw_cross<B: DebugRenderBackend>(
    pen: &mut Pen<'_, B>,
    world_point: Vector,
    arm: Real,
    color: DebugColor,
) {
    for axis in [Vector::X, Vector::Y, Vector::Z] {
        pen.line(world_point - axis * arm, world_point + axis * arm, color);
    }
}
