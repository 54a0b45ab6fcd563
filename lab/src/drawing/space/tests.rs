//! Nearer shapes hide farther ones, and shapes have the given size.

use rapier3d_fields::math::{DPose3, DVec3};

use super::*;

const PAGE: [usize; 2] = [60, 40];
const BLACK: Rgb = [0.0; 3];
const RED: Rgb = [200.0, 0.0, 0.0];
const BLUE: Rgb = [0.0, 0.0, 200.0];

/// Ten units in front of the origin, where the page is six units of ten pixels wide.
fn camera() -> Camera {
    Camera::new(DVec3::Z * 10.0, DVec3::ZERO, 6.0, PAGE)
}

fn square(at: DVec3) -> [Spot; 4] {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    corners.map(|(x, y)| camera().spot(at + DVec3::new(x, y, 0.0)))
}

fn count(canvas: &Canvas, color: [u8; 3]) -> usize {
    let pixels = canvas.pixels();
    pixels.iter().filter(|it| **it == color).count()
}

#[test]
fn nearer_shapes_hide_farther_ones_in_either_order() {
    let [near, far] = [square(DVec3::ZERO), square(DVec3::Z * -2.0)];
    let mut first = Canvas::new(PAGE, BLACK);
    first.polygon(&near, &Paint::solid(RED));
    first.polygon(&far, &Paint::solid(BLUE));
    let mut last = Canvas::new(PAGE, BLACK);
    last.polygon(&far, &Paint::solid(BLUE));
    last.polygon(&near, &Paint::solid(RED));
    assert_eq!(count(&first, [200, 0, 0]), 400, "twenty pixels to a side");
    assert_eq!(count(&first, [0, 0, 200]), 0);
    assert_eq!(first.pixels(), last.pixels());
}

#[test]
fn a_clear_shape_of_half_opacity_hides_nothing_behind_it() {
    let mut canvas = Canvas::new(PAGE, BLACK);
    canvas.polygon(&square(DVec3::Z), &Paint::clear(RED, 0.5));
    assert_eq!(count(&canvas, [100, 0, 0]), 22 * 22);
    canvas.polygon(&square(DVec3::ZERO), &Paint::solid(BLUE));
    assert_eq!(count(&canvas, [0, 0, 200]), 400);
}

#[test]
fn neighbouring_faces_leave_no_gap_and_do_not_overlap() {
    let mut canvas = Canvas::new(PAGE, BLACK);
    let [a, b, c, d] = square(DVec3::ZERO);
    for half in [[a, b, c], [a, c, d]] {
        canvas.polygon(&half, &Paint::clear(RED, 0.5));
    }
    assert_eq!(count(&canvas, [100, 0, 0]), 400);
}

#[test]
fn a_floor_hides_the_part_of_a_ball_below_it() {
    let camera = Camera::new(DVec3::Y * 20.0 + DVec3::Z * 1e-3, DVec3::ZERO, 6.0, PAGE);
    let mut canvas = Canvas::new(PAGE, BLACK);
    let floor = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
    let floor = floor.map(|(x, z)| camera.spot(DVec3::new(x, 0.0, z)));
    canvas.polygon(&floor, &Paint::solid(BLUE));
    let pose = DPose3::from_translation(DVec3::Y * -0.8);
    draw_ball(&mut canvas, &camera, &pose, 1.0, |_| RED);
    let seen = canvas.pixels().iter().filter(|it| it[0] > it[2]).count();
    // A cap of radius 0.6 in pixels of 0.1.
    let area = std::f64::consts::PI * 36.0;
    assert!(
        (seen as f64 - area).abs() < 0.12 * area,
        "{seen} for {area}"
    );
}

#[test]
fn a_box_shows_only_the_faces_towards_the_eye() {
    let mut canvas = Canvas::new(PAGE, BLACK);
    let pose = DPose3::from_translation(DVec3::Z * -1.0);
    draw_box(&mut canvas, &camera(), &pose, DVec3::ONE, [RED, RED]);
    let drawn = canvas.pixels().iter().filter(|it| it[0] > 0).count();
    assert_eq!(drawn, 400, "the front, and nothing beside it");
}
