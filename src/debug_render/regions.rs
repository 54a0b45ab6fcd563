//! The outlines of the regions of fields.

use super::outline::Outlines;
use super::pen::Pen;
use super::scene::DrawnScene;
use super::signs::signed_solids;
use super::style::FieldDebugRenderStyle;
use crate::rapier::pipeline::DebugRenderBackend;

/// Draws the solids of the region of each field that acts now.
pub(super) fn draw<'a, B: DebugRenderBackend>(
    pen: &mut Pen<'a, B>,
    scene: &DrawnScene<'a>,
    outlines: &mut Outlines,
) {
    for placed in scene.placed() {
        if pen.is_full() {
            return;
        }
        let carrier = placed.frame.body.and_then(|body| scene.body(body));
        if !pen.begin(carrier) {
            continue;
        }
        let own = FieldDebugRenderStyle::field_color(placed.handle);
        let color = scene.style.region_color.unwrap_or(own);
        for solid in signed_solids(&placed.field.region) {
            let pose = placed.frame.pose * solid.local_pose;
            let color = [color, scene.style.cut_color][usize::from(solid.is_cut)];
            outlines.draw(pen, &scene.view, solid.solid, &pose, color);
        }
    }
}
