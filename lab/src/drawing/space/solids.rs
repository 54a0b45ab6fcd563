//! Boxes, balls and discs, lit from one side.

use rapier3d_fields::math::{DPose3, DVec3};

use super::camera::{Camera, Spot};
use super::canvas::{Canvas, Paint, Rgb};

/// The direction to the light.
const LIGHT: DVec3 = DVec3::new(-0.42, 0.8, 0.43);
/// Brightness of faces away from the light, as a share of that of faces towards it.
const SHADE: f64 = 0.5;
/// Number of brightness steps on a ball, which make it look flat like the boxes.
const STEPS: f64 = 6.0;

/// A colour between two: `a` at a share of 0, `b` at 1.
pub fn mix(a: Rgb, b: Rgb, share: f64) -> Rgb {
    std::array::from_fn(|k| a[k] + share as f32 * (b[k] - a[k]))
}

/// A colour on a lit face with this normal.
pub fn lit(color: Rgb, normal: DVec3) -> Rgb {
    let light = 0.5 + 0.5 * normal.dot(LIGHT.normalize());
    let share = SHADE + (1.0 - SHADE) * light;
    let bright = color.map(|it| it * share as f32);
    mix(bright, [255.0; 3], 0.16 * (light - 0.75).max(0.0) / 0.25)
}

/// Draws a box, each face with a panel of the second colour in it.
pub fn draw_box(
    canvas: &mut Canvas,
    camera: &Camera,
    pose: &DPose3,
    half_extents: DVec3,
    [frame, panel]: [Rgb; 2],
) {
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let normal = side * DVec3::AXES[axis];
            let [u, v] = [1, 2].map(|k| DVec3::AXES[(axis + k) % 3]);
            let world_normal = pose.rotation * normal;
            let middle = pose.transform_point(normal * half_extents);
            if world_normal.dot(camera.eye() - middle) <= 0.0 {
                continue;
            }
            let face = |inset: f64| {
                let size = half_extents - DVec3::splat(inset);
                [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| {
                    let local = normal * half_extents + (a * u + b * v) * size;
                    camera.spot(pose.transform_point(local))
                })
            };
            canvas.polygon(&face(0.0), &Paint::solid(lit(frame, world_normal)));
            let inset = 0.22 * half_extents.min_element();
            let inner = Paint::solid(lit(panel, world_normal)).on_face();
            canvas.polygon(&face(inset), &inner);
        }
    }
}

/// Draws a ball; `look` returns its colour by the direction from its centre, in its own axes.
pub fn draw_ball(
    canvas: &mut Canvas,
    camera: &Camera,
    pose: &DPose3,
    radius: f64,
    look: impl Fn(DVec3) -> Rgb,
) {
    let center = pose.translation;
    let to_local = pose.rotation.inverse();
    let arm = camera.eye() - center;
    let reach = 1.1 * radius * camera.scale_at(center) + 1.0;
    canvas.rays(camera.spot(center), reach, |x, y| {
        let ray = camera.ray(x, y);
        let (a, b) = (ray.length_squared(), arm.dot(ray));
        let root = b * b - a * (arm.length_squared() - radius * radius);
        if root < 0.0 {
            return None;
        }
        let distance = (-b - root.sqrt()) / a;
        let normal = (arm + distance * ray) / radius;
        let light = (STEPS * normal.dot(LIGHT.normalize())).round() / STEPS;
        let stepped = LIGHT.normalize() * light;
        let color = lit(look(to_local * normal), stepped);
        Some((1.0 / distance, Paint::solid(color)))
    });
}

/// The corners of a horizontal disc.
pub fn disc(camera: &Camera, center: DVec3, radius: f64) -> Vec<Spot> {
    let corner = |k: u32| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 28.0).sin_cos();
        camera.spot(center + radius * DVec3::new(cos, 0.0, sin))
    };
    (0..28).map(corner).collect()
}

/// The corners of a disc that faces the eye.
pub fn round(camera: &Camera, center: DVec3, radius: f64) -> Vec<Spot> {
    let (spot, radius) = (camera.spot(center), radius * camera.scale_at(center));
    let corner = |k: u32| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 40.0).sin_cos();
        Spot {
            x: spot.x + radius * cos,
            y: spot.y + radius * sin,
            ..spot
        }
    };
    (0..40).map(corner).collect()
}
