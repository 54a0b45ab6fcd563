//! A part of a body on the body's path, and the approach of two of them.

use super::swept_body::SweptBody;
use super::swept_parts::{Form, SweptPart};
use crate::math::{DPose3, DVec3};
use crate::rapier::geometry::Aabb;
use crate::rapier::parry::bounding_volume::BoundingVolume;

/// A part of a body, on the body's path.
#[derive(Clone, Copy)]
pub(super) struct MovingShape<'a> {
    pub track: &'a SweptBody,
    pub member: &'a SweptPart,
}

/// Two parts that may touch.
pub(super) type SweptPair<'a> = [MovingShape<'a>; 2];

impl MovingShape<'_> {
    /// The pose of the collider's frame, in world space.
    pub(super) fn frame(&self, time: f64) -> DPose3 {
        let (arm, own) = (self.member.arm, self.member.rotation);
        self.track.path.frame(time, arm, own)
    }

    /// The vector from the centre of mass to the collider's frame, and its velocity relative to the centre.
    pub(super) fn arm(&self, time: f64) -> [DVec3; 2] {
        if self.member.arm == DVec3::ZERO {
            return [DVec3::ZERO; 2];
        }
        let attitude = self.track.path.attitude(time);
        let arm = attitude * self.member.arm;
        [arm, self.track.path.angvel(time, attitude).cross(arm)]
    }

    /// The origin of the collider's frame, in world space.
    pub(super) fn place(&self, time: f64) -> DVec3 {
        self.track.path.com(time) + self.arm(time)[0]
    }

    /// Returns true if it stands still outside of `bounds`, for example a wall of a body that has several.
    pub(super) fn stands_clear_of(&self, bounds: &Aabb) -> bool {
        let own = self.member.bounds.filter(|_| self.track.is_still());
        // A half-space has no bounds.
        own.is_some_and(|own| self.member.reach.is_finite() && !own.intersects(bounds))
    }

    pub(super) fn turns(&self) -> bool {
        self.track.path.bounds().angvel > 0.0
    }

    pub(super) fn is_plane(&self) -> bool {
        matches!(self.member.form, Form::Plane { .. })
    }

    pub(super) fn is_solid(&self) -> bool {
        matches!(self.member.form, Form::Other)
    }

    /// An upper bound of the distance of its points from the centre of mass; of the distance of its frame for a
    /// half-space.
    pub(super) fn size(&self) -> f64 {
        self.member.arm.length() + self.member.finite_reach()
    }

    /// An upper bound of the distance from the centre of mass at which rotation moves its surface.
    pub(super) fn swinging(&self) -> f64 {
        match self.member.form {
            Form::Ball { .. } => self.member.arm.length(),
            Form::Plane { .. } | Form::Other => self.size(),
        }
    }

    /// An upper bound of the way of its surface by rotation in Rapier's step, from the angular speeds before and after.
    pub(super) fn swing_in(&self, dt: f64) -> f64 {
        self.track.spin * self.swinging() * dt
    }
}

/// The relative motion of two centres of mass over a span, with velocity and acceleration at its start. `pull` is an
/// upper bound of the acceleration.
pub(super) struct Approach {
    from: f64,
    pub to: f64,
    velocity: DVec3,
    acceleration: DVec3,
    jerk: DVec3,
    pub pull: f64,
}

impl Approach {
    pub(super) fn new([a, b]: SweptPair<'_>, [from, to]: [f64; 2]) -> Self {
        let (one, two) = (&a.track.path, &b.track.path);
        let acceleration = two.acceleration(from) - one.acceleration(from);
        let jerk = two.jerk - one.jerk;
        let last = acceleration + jerk * (to - from);
        Approach {
            from,
            to,
            velocity: two.velocity(from) - one.velocity(from),
            acceleration,
            jerk,
            pull: acceleration.length().max(last.length()),
        }
    }

    pub(super) fn velocity(&self, time: f64) -> DVec3 {
        let since = time - self.from;
        self.velocity + (self.acceleration + self.jerk * (0.5 * since)) * since
    }

    /// An upper bound of the speed over a duration.
    pub(super) fn fastest(&self, duration: f64) -> f64 {
        self.velocity.length() + self.pull * duration
    }

    /// The largest acceleration along a unit vector; zero if it is always against it.
    pub(super) fn acceleration_along(&self, axis: DVec3) -> f64 {
        let last = self.acceleration + self.jerk * (self.to - self.from);
        self.acceleration.dot(axis).max(last.dot(axis)).max(0.0)
    }
}

/// An upper bound of the speed at which two points of the parts approach in `span`.
pub(super) fn fastest_approach([a, b]: SweptPair<'_>, span: [f64; 2]) -> f64 {
    let swing = |part: MovingShape<'_>| part.track.path.bounds().angvel * part.swinging();
    let approach = Approach::new([a, b], span);
    approach.fastest(span[1] - span[0]) + swing(a) + swing(b)
}

/// The sum of the skins of two parts.
pub(super) fn skins([a, b]: SweptPair<'_>) -> f64 {
    a.member.skin + b.member.skin
}
