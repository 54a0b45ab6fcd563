//! The fixed parts: the island with its basin, the planet, the magnet, and the regions of fields.

use rapier3d_fields::math::{DPose3, DVec3, to_dvec3, to_f64};

use super::corner;
use crate::drawing::space::{
    Camera, Canvas, Paint, Rgb, disc, draw_ball, draw_box, lit, mix, round,
};
use crate::single::scenes::playground::{
    ISLAND, MAGNET, MAGNET_REACH, PLANET, PLANET_RADIUS, PLANET_REACH, POOL, POOL_SIZE, WIND,
    WIND_SIZE, magnet_parts,
};

const FLOOR: Rgb = [72.0, 92.0, 122.0];
const TILE: Rgb = [78.0, 99.0, 131.0];
const EARTH: Rgb = [45.0, 58.0, 82.0];
const BASIN: Rgb = [38.0, 96.0, 128.0];
const SEA: Rgb = [52.0, 152.0, 190.0];
const LAND: Rgb = [120.0, 200.0, 124.0];
const RED: Rgb = [226.0, 70.0, 74.0];
const STEEL: Rgb = [226.0, 232.0, 240.0];
const AIR: Rgb = [150.0, 220.0, 255.0];
const GRAVITY: Rgb = [255.0, 224.0, 150.0];
const PULL: Rgb = [255.0, 120.0, 170.0];

/// Draws a face; its corners are counterclockwise as seen from the front.
fn face(canvas: &mut Canvas, camera: &Camera, corners: [DVec3; 4], color: Rgb) {
    let spots = corners.map(|it| camera.spot(it));
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let normal = normal.normalize();
    canvas.polygon(&spots, &Paint::solid(lit(color, normal)));
}

pub fn draw(canvas: &mut Canvas, camera: &Camera) {
    draw_floor(canvas, camera);
    draw_sides(canvas, camera);
    draw_basin(canvas, camera);
    draw_zones(canvas, camera);
    draw_planet(canvas, camera);
    draw_reach(canvas, camera);
    for part in magnet_parts() {
        let color = if part.is_pole { STEEL } else { RED };
        let pose = DPose3::from_translation(to_dvec3(part.middle));
        draw_box(
            canvas,
            camera,
            &pose,
            to_dvec3(part.half_extents),
            [color; 2],
        );
    }
    draw_stand(canvas, camera);
}

/// Draws the stand of the magnet.
fn draw_stand(canvas: &mut Canvas, camera: &Camera) {
    let half = DVec3::new(0.3, 0.5 * (to_f64(MAGNET.y) - 0.4), 0.5);
    let at = to_dvec3(MAGNET) + DVec3::X;
    let pose = DPose3::from_translation(DVec3::new(at.x, half.y, at.z));
    draw_box(canvas, camera, &pose, half, [EARTH; 2]);
}

/// Draws tiles of two shades around the basin.
fn draw_floor(canvas: &mut Canvas, camera: &Camera) {
    let (near, far) = (to_dvec3(POOL - POOL_SIZE), to_dvec3(POOL + POOL_SIZE));
    let island = to_dvec3(ISLAND);
    let cuts = |from: f64, to: f64, pool: [f64; 2]| {
        let count = ((to - from) / 1.0).ceil() as usize;
        let mut cuts: Vec<f64> = (0..=count)
            .map(|k| from + (to - from) * k as f64 / count as f64)
            .collect();
        cuts.extend(pool);
        cuts.sort_by(f64::total_cmp);
        cuts
    };
    let columns = cuts(-island.x, island.x, [near.x, far.x]);
    let rows = cuts(-island.z, island.z, [near.z, far.z]);
    for x in columns.windows(2) {
        for z in rows.windows(2) {
            let [mx, mz] = [0.5 * (x[0] + x[1]), 0.5 * (z[0] + z[1])];
            if near.x < mx && mx < far.x && near.z < mz && mz < far.z {
                continue;
            }
            let odd = (mx.floor() + (mz + 0.4).floor()).rem_euclid(2.0) == 0.0;
            let at = |x: f64, z: f64| DVec3::new(x, 0.0, z);
            let corners = [
                at(x[0], z[1]),
                at(x[1], z[1]),
                at(x[1], z[0]),
                at(x[0], z[0]),
            ];
            face(canvas, camera, corners, if odd { FLOOR } else { TILE });
        }
    }
}

/// Draws the visible sides of the island.
fn draw_sides(canvas: &mut Canvas, camera: &Camera) {
    let island = to_dvec3(ISLAND);
    let at = |x: f64, y: f64, z: f64| DVec3::new(x * island.x, y * island.y, z * island.z);
    let front = [
        at(-1., -1., 1.),
        at(1., -1., 1.),
        at(1., 0., 1.),
        at(-1., 0., 1.),
    ];
    face(canvas, camera, front, EARTH);
    let left = [
        at(-1., -1., -1.),
        at(-1., -1., 1.),
        at(-1., 0., 1.),
        at(-1., 0., -1.),
    ];
    face(canvas, camera, left, EARTH);
}

/// Draws the visible walls and the bottom of the pool, without water.
fn draw_basin(canvas: &mut Canvas, camera: &Camera) {
    let (near, far) = (to_dvec3(POOL - POOL_SIZE), to_dvec3(POOL + POOL_SIZE));
    let bottom = to_f64(POOL.y - 2.0 * POOL_SIZE.y);
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let floor = [
        at(near.x, bottom, far.z),
        at(far.x, bottom, far.z),
        at(far.x, bottom, near.z),
        at(near.x, bottom, near.z),
    ];
    face(canvas, camera, floor, BASIN);
    let back = [
        at(near.x, bottom, near.z),
        at(far.x, bottom, near.z),
        at(far.x, 0.0, near.z),
        at(near.x, 0.0, near.z),
    ];
    face(canvas, camera, back, mix(BASIN, FLOOR, 0.3));
    let right = [
        at(far.x, bottom, near.z),
        at(far.x, bottom, far.z),
        at(far.x, 0.0, far.z),
        at(far.x, 0.0, near.z),
    ];
    face(canvas, camera, right, mix(BASIN, FLOOR, 0.3));
}

/// Draws the regions of wind and magnet on the floor.
fn draw_zones(canvas: &mut Canvas, camera: &Camera) {
    let signs = [
        [-1.0, -1.0, 1.0],
        [1.0, -1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, -1.0, -1.0],
    ];
    let spots = signs.map(|it| camera.spot(corner(WIND, WIND_SIZE, it)));
    canvas.polygon(&spots, &Paint::clear(AIR, 0.13).on_face());
    for k in 0..4 {
        let ends = [spots[k], spots[(k + 1) % 4]];
        canvas.line(ends, [1.2, 1.2], &Paint::clear(AIR, 0.45).on_face());
    }
    let middle = to_dvec3(MAGNET) * DVec3::new(1.0, 0.0, 1.0);
    let radius = to_f64((MAGNET_REACH * MAGNET_REACH - MAGNET.y * MAGNET.y).sqrt());
    draw_ring(canvas, camera, middle, radius, PULL);
}

/// Draws a disc with a rim on the floor, clamped to the island.
fn draw_ring(canvas: &mut Canvas, camera: &Camera, middle: DVec3, radius: f64, color: Rgb) {
    let island = to_dvec3(ISLAND);
    let point = |k: usize| {
        let (sin, cos) = (k as f64 * std::f64::consts::TAU / 96.0).sin_cos();
        (middle + radius * DVec3::new(cos, 0.0, sin)).clamp(-island, island)
    };
    let spots: Vec<_> = (0..96).map(|k| camera.spot(point(k))).collect();
    // Over the basin there is no floor.
    let paint = Paint::clear(color, 0.1).on_face();
    canvas.polygon(&spots, &paint);
    for k in 0..96 {
        let ends = [spots[k], spots[(k + 1) % 96]];
        canvas.line(ends, [1.2, 1.2], &Paint::clear(color, 0.45).on_face());
    }
}

/// Draws the reach of the planet's gravity as a circle that faces the eye.
fn draw_reach(canvas: &mut Canvas, camera: &Camera) {
    let spots = round(camera, to_dvec3(PLANET), to_f64(PLANET_REACH));
    canvas.polygon(&spots, &Paint::clear(GRAVITY, 0.05));
    for k in 0..spots.len() {
        let ends = [spots[k], spots[(k + 1) % spots.len()]];
        canvas.line(ends, [1.2, 1.2], &Paint::clear(GRAVITY, 0.4));
    }
}

/// Draws the planet with land and sea, and its shadow.
fn draw_planet(canvas: &mut Canvas, camera: &Camera) {
    let center = to_dvec3(PLANET);
    let below = DVec3::new(center.x, 0.0, center.z);
    for (share, opacity) in [(1.25, 0.07), (1.0, 0.09), (0.75, 0.1)] {
        let spots = disc(camera, below, share * to_f64(PLANET_RADIUS));
        canvas.polygon(&spots, &Paint::clear([0.0, 5.0, 20.0], opacity).on_face());
    }
    let pose = DPose3::from_translation(center);
    draw_ball(canvas, camera, &pose, to_f64(PLANET_RADIUS), |normal| {
        let waves = (3.1 * normal.x + 0.7).sin() * (2.7 * normal.y - 0.4).cos()
            + (4.3 * normal.z - 1.1 * normal.x).sin() * 0.6;
        match normal.y.abs() > 0.88 {
            true => STEEL,
            false if waves > 0.35 => LAND,
            false => SEA,
        }
    });
}
