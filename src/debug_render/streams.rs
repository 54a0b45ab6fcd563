//! Stream lines: curves that follow the direction of the composite field.

use super::arrow::Polar;
use super::pen::Pen;
use super::scene::DrawnScene;
use crate::math::{Real, Vector};
use crate::rapier::pipeline::DebugRenderBackend;

/// The largest number of stream lines along an edge of the slice.
const EDGE_LIMIT: u32 = 64;

/// The number of steps over which a stream line becomes opaque.
const FADE: u32 = 25;

/// Draws all stream lines together, step by step, so that `max_lines` ends all at about the same length.
pub(super) fn draw<B: DebugRenderBackend>(pen: &mut Pen<'_, B>, scene: &DrawnScene<'_>) {
    if !pen.begin(None) {
        return;
    }
    let style = scene.style;
    let length = style.stream_step.unwrap_or(scene.view.half_size / 50.0);
    let mut ends = style.stream_seeds.clone();
    if ends.is_empty() {
        ends = scene.view.slice(style.stream_points.min(EDGE_LIMIT));
    }
    for step in 0..style.stream_steps {
        let mut color = style.stream_color;
        color[3] *= (step + 1).min(FADE) as f32 / FADE as f32;
        let next = step_all(scene, &ends, length);
        let mut left = Vec::with_capacity(ends.len());
        for (from, to) in ends.iter().zip(next) {
            if let Some(to) = to {
                pen.line(*from, to, color);
                left.push(to);
            }
        }
        if left.is_empty() || pen.is_full() {
            return;
        }
        ends = left;
    }
}

/// For each point, the end of one step of the classical Runge–Kutta method on the field's direction; `None` where a
/// stream line ends.
fn step_all(scene: &DrawnScene<'_>, points: &[Vector], length: Real) -> Vec<Option<Vector>> {
    let slopes = |ahead: Real, before: Option<&[Option<Vector>]>| {
        let moved = points.iter().enumerate().map(|(at, point)| {
            let way = before.and_then(|before| before[at]).unwrap_or_default();
            *point + way * ahead
        });
        directions(scene, &moved.collect::<Vec<_>>())
    };
    let first = slopes(0.0, None);
    let second = slopes(0.5 * length, Some(&first));
    let third = slopes(0.5 * length, Some(&second));
    let fourth = slopes(length, Some(&third));
    let next = points.iter().enumerate().map(|(at, point)| {
        let (a, b, c, d) = (first[at]?, second[at]?, third[at]?, fourth[at]?);
        let way = (a + (b + c) * 2.0 + d) * (length / 6.0);
        let end = *point + way;
        (a.dot(d) > 0.0 && end.is_finite()).then_some(end)
    });
    next.collect()
}

/// The direction of the composite field at each point; `None` where it is not defined, zero, infinite or NaN.
fn directions(scene: &DrawnScene<'_>, world_points: &[Vector]) -> Vec<Option<Vector>> {
    let values = scene
        .fields
        .values_at(world_points, scene.world)
        .into_iter();
    let polar = values.map(|value| Polar::of(value.force));
    polar.map(|polar| Some(polar?.direction)).collect()
}
