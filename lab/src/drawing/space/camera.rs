//! The projection from space to the page.

use rapier3d_fields::math::DVec3;

/// An eye and its directions; +y is up on the page.
pub struct Camera {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// The middle of the page.
    middle: [f64; 2],
    /// Pixels per unit of length at a unit of distance.
    scale: f64,
}

/// A point on the page, in pixels from the upper left, and its nearness, the inverse of its depth.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    pub x: f64,
    pub y: f64,
    pub near: f64,
}

impl Camera {
    /// Looks from `eye` to `target`, which is in the middle of a page of some pixels. The page is `width` units of
    /// length wide at the distance of the target.
    pub fn new(eye: DVec3, target: DVec3, width: f64, page: [usize; 2]) -> Self {
        let forward = (target - eye).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let [across, down] = page.map(|pixels| pixels as f64);
        Self {
            eye,
            right,
            up: right.cross(forward),
            forward,
            middle: [across / 2.0, down / 2.0],
            scale: across * (target - eye).length() / width,
        }
    }

    /// The place on the page of a point in front of the eye.
    pub fn spot(&self, point: DVec3) -> Spot {
        let arm = point - self.eye;
        let near = 1.0 / arm.dot(self.forward);
        Spot {
            x: self.middle[0] + self.scale * near * arm.dot(self.right),
            y: self.middle[1] - self.scale * near * arm.dot(self.up),
            near,
        }
    }

    /// Pixels per unit of length at a point.
    pub fn scale_at(&self, point: DVec3) -> f64 {
        self.scale * self.spot(point).near
    }

    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// The vector from the eye to the point of depth one behind a place on the page.
    pub fn ray(&self, x: f64, y: f64) -> DVec3 {
        let across = (x - self.middle[0]) / self.scale;
        let down = (y - self.middle[1]) / self.scale;
        self.forward + self.right * across - self.up * down
    }
}
