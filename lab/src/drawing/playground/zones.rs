//! Water and an explosion.

use rapier3d_fields::math::{DVec3, to_dvec3, to_f64};

use super::corner;
use crate::drawing::space::{Camera, Canvas, Paint, Rgb, disc, round};
use crate::single::scenes::playground::{
    BLAST, BLAST_REACH, BLAST_STEP, POOL, POOL_SIZE, STEPS_PER_SECOND,
};

const WATER: Rgb = [56.0, 176.0, 222.0];
const SHORE: Rgb = [190.0, 240.0, 255.0];
const CORE: Rgb = [255.0, 244.0, 200.0];
const FIRE: Rgb = [255.0, 196.0, 66.0];
const EMBER: Rgb = [255.0, 122.0, 48.0];
/// Time for which the explosion is visible, s.
const BLAST_TIME: f64 = 0.54;

/// Draws the transparent surface.
pub fn draw_water(canvas: &mut Canvas, camera: &Camera) {
    let signs = [
        [-1.0, 0.0, -1.0],
        [1.0, 0.0, -1.0],
        [1.0, 0.0, 1.0],
        [-1.0, 0.0, 1.0],
    ];
    let spots = signs.map(|it| camera.spot(corner(POOL, POOL_SIZE, it)));
    canvas.polygon(&spots, &Paint::clear(WATER, 0.5));
    for ends in [[spots[0], spots[1]], [spots[1], spots[2]]] {
        canvas.line(ends, [1.6, 1.6], &Paint::clear(SHORE, 0.7));
    }
}

/// Draws a ball of fire that grows and fades, sparks, and a ring that expands over the floor.
pub fn draw_blast(canvas: &mut Canvas, camera: &Camera, step: usize) {
    let since = step as f64 - BLAST_STEP as f64;
    let share = since / (BLAST_TIME * STEPS_PER_SECOND as f64);
    if !(0.0..1.0).contains(&share) {
        return;
    }
    let fading = 1.0 - share;
    let reach = to_f64(BLAST_REACH) * (1.0 - fading * fading * fading);
    let center = to_dvec3(BLAST) * DVec3::new(1.0, 0.0, 1.0);
    draw_shock(canvas, camera, center, reach, fading);
    for (size, color, opacity) in [(0.5, EMBER, 0.45), (0.41, FIRE, 0.6), (0.28, CORE, 0.9)] {
        let middle = center + DVec3::new(0.0, 0.4 + 0.25 * reach, 1.3);
        let spots = round(camera, middle, size * reach * 0.8);
        let opacity = opacity * fading;
        canvas.polygon(&spots, &Paint::clear(color, opacity));
    }
    for spark in 0..26 {
        let turn = f64::from(spark) * 2.4;
        let rise = 0.2 + 0.7 * (f64::from(spark) * 0.618).fract();
        let flat = (1.0 - rise * rise).sqrt();
        let towards = DVec3::new(flat * turn.cos(), rise, flat * turn.sin());
        let ends = [0.7, 1.0].map(|it| camera.spot(center + towards * (reach * it)));
        canvas.line(ends, [0.8, 4.0 * fading], &Paint::clear(FIRE, fading));
    }
}

/// Draws a ring on the floor.
fn draw_shock(canvas: &mut Canvas, camera: &Camera, center: DVec3, radius: f64, fading: f64) {
    let spots = disc(camera, center, radius);
    canvas.polygon(&spots, &Paint::clear(FIRE, 0.15 * fading).on_face());
    for k in 0..spots.len() {
        let ends = [spots[k], spots[(k + 1) % spots.len()]];
        let paint = Paint::clear(CORE, 0.8 * fading).on_face();
        canvas.line(ends, [3.0 * fading; 2], &paint);
    }
}
