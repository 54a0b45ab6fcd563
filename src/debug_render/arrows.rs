//! Arrows of the composite field on a plane and in a cube.

use super::arrow::{Arrow, Gauge, Polar};
use super::pen::Pen;
use super::scene::DrawnScene;
use super::style::FieldDebugRenderStyle;
use crate::math::Vector;
use crate::pipeline::FieldValue;
use crate::rapier::pipeline::{DebugColor, DebugRenderBackend};

/// The largest numbers of points along an edge of the slice and of the cube, so that no style can take minutes.
const SLICE_LIMIT: u32 = 512;
const VOLUME_LIMIT: u32 = 64;

/// Draws the arrows of the slice. `by_field` colours their points by the fields that count.
pub(super) fn draw_slice<B: DebugRenderBackend>(
    pen: &mut Pen<'_, B>,
    scene: &DrawnScene<'_>,
    by_field: bool,
) {
    let count = scene.style.slice_points.min(SLICE_LIMIT);
    draw(pen, scene, &scene.view.slice(count), count, by_field);
}

/// Draws the arrows of the cube.
pub(super) fn draw_volume<B: DebugRenderBackend>(
    pen: &mut Pen<'_, B>,
    scene: &DrawnScene<'_>,
    by_field: bool,
) {
    let count = scene.style.volume_points.min(VOLUME_LIMIT);
    draw(pen, scene, &scene.view.volume(count), count, by_field);
}

/// Draws arrows at the points of a grid of this number of points along each edge.
fn draw<B: DebugRenderBackend>(
    pen: &mut Pen<'_, B>,
    scene: &DrawnScene<'_>,
    world_points: &[Vector],
    count: u32,
    by_field: bool,
) {
    if pen.is_full() || !pen.begin(None) {
        return;
    }
    let values = scene.fields.values_at(world_points, scene.world);
    let polar: Vec<_> = values.iter().map(|value| Polar::of(value.force)).collect();
    let magnitudes = polar.iter().flatten().map(|polar| polar.magnitude);
    let gauge = Gauge::new(scene.style.half_magnitude, magnitudes);
    let longest = scene.view.spacing(count) * scene.style.arrow_length;
    for ((start, value), polar) in world_points.iter().zip(&values).zip(polar) {
        if pen.is_full() {
            return;
        }
        let Some(polar) = polar else {
            if !value.force.is_finite() {
                pen.note_not_finite();
            }
            continue;
        };
        let share = gauge.share(polar.magnitude);
        let color = scene.style.strength_color(share);
        let way = polar.direction * (longest * share);
        let mut arrow = Arrow::new(*start, way, scene.view.normal, color);
        if by_field {
            arrow.point_colors = counting_colors(value).unwrap_or(arrow.point_colors);
        }
        arrow.draw(pen);
    }
}

/// The colours of the first and the last field that count.
fn counting_colors(value: &FieldValue) -> Option<[DebugColor; 2]> {
    let ends = [value.fields.first()?.handle?, value.fields.last()?.handle?];
    Some(ends.map(FieldDebugRenderStyle::field_color))
}
