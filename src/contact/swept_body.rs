//! A body of a step for swept detection: its start, and its path.

use super::contact_body::{ContactBody, Resistance};
use super::near_pairs::Place;
use super::starts::{BodyStart, FreeTurn, Starts};
use super::trajectory::{Bend, BodyPath, Turn};
use crate::math::{
    DPose3, DQuat, DVec3, Real, RigidBodyHandle, from_dvec3, from_f64, to_dpose3, to_dvec3, to_f64,
};
use crate::rapier::dynamics::RigidBody;
use crate::rapier::geometry::Aabb;
use crate::rigid::Lookup;

/// Tolerance, in roundings, between the path computed from a body's start and the place where Rapier put it: one for
/// each substep, and a few for the frame.
const ROUNDINGS: f64 = 32.0;

/// The world after Rapier's step of length `dt`, and its bodies before.
pub(super) struct SweptWorld<'a, W> {
    pub world: &'a W,
    pub starts: &'a Starts,
    pub dt: f64,
}

/// A body, or a collider without one, on its path through a step.
#[derive(Debug)]
pub(super) struct SweptBody {
    pub body: Option<RigidBodyHandle>,
    pub dynamic: bool,
    pub path: BodyPath,
    /// The range of its parts in `SweptBodies::parts`.
    pub parts: std::ops::Range<usize>,
    /// An upper bound of the distance of its parts' points from the centre of mass.
    pub reach: f64,
    /// True if a part has a detection field.
    pub detects: bool,
    /// True if all parts are balls about its centre of mass, so that no touch depends on its rotation.
    pub round: bool,
    /// Set, with the rotation of the path, by [`SweptBody::prepare`].
    pub resistance: Option<Resistance>,
    /// The acceleration that is not due to fields, for a body that is moved within the step. Others get the rest of
    /// their kick after Rapier's step.
    spread: Option<DVec3>,
    /// The pose of its frame, and its velocity, after Rapier's step.
    end: DPose3,
    end_linvel: DVec3,
    /// Its angular momentum after Rapier's step, if a torque bends its rotation.
    end_momentum: Option<DVec3>,
    local_com: DVec3,
    /// The larger one of its angular speeds before and after Rapier's step.
    pub spin: f64,
    /// The time of its last impact.
    pub hit_at: Option<f64>,
    /// The acceleration and torque by fields that are assumed from then on, if it is moved within the step.
    pub presumed: Option<[DVec3; 2]>,
    /// The velocity of the path minus that with which the body answers impacts: substeps arrive at a place that does
    /// not follow from their velocities.
    ahead: DVec3,
    /// The angular velocity with which it ends, if it was stopped for the rest of the step.
    stopped: Option<DVec3>,
    /// Its bounds, if it stood still during Rapier's step.
    pub still: Option<Aabb>,
    /// The number of impacts so far; events predicted before the last are void.
    pub generation: u32,
}

impl SweptBody {
    pub(super) fn of_body(start: &BodyStart, body: &RigidBody, local_com: DVec3, dt: f64) -> Self {
        let (begin, end) = (to_dpose3(&start.pose), to_dpose3(body.position()));
        let [from, to] = [begin, end].map(|pose| pose.transform_point(local_com));
        let [linvel, acceleration, jerk, ahead] = way([from, to], start, body, dt);
        SweptBody {
            body: Some(start.body),
            dynamic: body.is_dynamic(),
            path: BodyPath {
                linvel,
                acceleration,
                jerk,
                ..BodyPath::still(0.0, from, begin.rotation)
            },
            spread: start.spread_within(),
            end,
            end_linvel: to_dvec3(body.linvel()),
            local_com,
            spin: to_f64(start.angvel.length().max(body.angvel().length())),
            ahead,
            ..SweptBody::free()
        }
    }

    /// The path of a collider without a body, which does not move.
    pub(super) fn free() -> Self {
        SweptBody {
            body: None,
            dynamic: false,
            path: BodyPath::still(0.0, DVec3::ZERO, DQuat::IDENTITY),
            parts: 0..0,
            reach: 0.0,
            detects: false,
            round: false,
            resistance: None,
            spread: None,
            end: DPose3::IDENTITY,
            end_linvel: DVec3::ZERO,
            end_momentum: None,
            local_com: DVec3::ZERO,
            spin: 0.0,
            hit_at: None,
            presumed: None,
            ahead: DVec3::ZERO,
            stopped: None,
            still: None,
            generation: 0,
        }
    }

    /// Returns true if it stood still and has not been hit.
    pub(super) fn is_still(&self) -> bool {
        self.still.is_some() && self.generation == 0
    }

    /// The way of its centre of mass in Rapier's step.
    pub(super) fn way(&self, dt: f64) -> DVec3 {
        self.path.com(dt) - self.path.com(0.0)
    }

    /// Computes the resistance, and the rotation of the path. Only bodies that may meet another need them, and
    /// [round](Self::round) ones only once they do.
    pub(super) fn prepare(&mut self, world: &SweptWorld<'_, impl Lookup>) {
        let (None, Some(handle)) = (self.resistance, self.body) else {
            return;
        };
        let Some(body) = world.world.body(handle) else {
            return;
        };
        let (start, dt) = (world.starts.of(handle, body), world.dt);
        let resistance = Resistance::of(body);
        self.resistance = Some(resistance);
        let begin = self.path.attitude(0.0);
        let rotor = resistance.rotor;
        // The body made the free rotation of this crate unless something pushed it.
        let free = start.turn.filter(|turn| {
            let expected = rotor.angvel(self.end.rotation, turn.momentum);
            let off = (expected - to_dvec3(body.angvel())).length();
            off <= ROUNDINGS * to_f64(Real::EPSILON) * expected.length()
        });
        let turn = free.and_then(|turn| {
            let freely = |momentum| Turn::freely(&rotor, begin, momentum, [0.0, dt]);
            let end = self.end.rotation;
            // Rapier's solver also separates overlapping bodies without changing their velocities.
            let arrives = |turn: &Turn| {
                let off = turn.attitude(dt, 0.0).angle_between(end);
                off <= ROUNDINGS * to_f64(Real::EPSILON)
            };
            let own = || freely(turn.mean).filter(arrives);
            let own = (turn.mean == turn.momentum).then(own).flatten();
            let fitted = || freely(rotor.momentum_between([begin, end], turn.mean, dt)?);
            // Many turns in a step are not fitted; Rapier's body is then off the free rotation by the error of a splitting.
            own.or_else(fitted).or_else(|| freely(turn.mean))
        });
        self.path.turn = turn.unwrap_or_else(|| Turn::Steady {
            attitude: begin,
            angvel: steady(begin, self.end.rotation, to_dvec3(start.angvel), dt),
        });
        let bent = free.filter(|turn| turn.torque != DVec3::ZERO && rotor.is_free());
        if let (Some(turn), Turn::Free(top)) = (bent, &self.path.turn) {
            let midway = self.path.attitude(0.5 * dt);
            self.path.bend = Some(Bend {
                acceleration: rotor.angvel(midway, turn.torque),
                jerk: rotor.angvel(midway, torque_rate(&turn, top.momentum, dt)),
                span: [0.0, dt],
            });
            self.end_momentum = Some(turn.momentum);
        }
    }

    /// The body at a moment, for the contact laws; `None` before [`Self::prepare`].
    pub(super) fn contact_body(&self, time: f64) -> Option<ContactBody> {
        let attitude = self.path.attitude(time);
        Some(ContactBody {
            resistance: self.resistance?,
            com: self.path.com(time),
            attitude,
            linvel: self.velocity(time),
            angvel: self.path.angvel(time, attitude),
            acceleration: self.path.acceleration(time),
            pushed: false,
        })
    }

    /// The velocity of the centre of mass with which the body answers.
    fn velocity(&self, time: f64) -> DVec3 {
        self.path.velocity(time) - self.ahead
    }

    /// The velocity at a moment of the point of the body that is at `world_point` then.
    pub(super) fn point_velocity(&self, time: f64, world_point: DVec3) -> DVec3 {
        let angvel = self.path.angvel(time, self.path.attitude(time));
        self.path.velocity(time) + angvel.cross(world_point - self.path.com(time))
    }

    /// Puts the body on a new path from a moment on, with the velocities and acceleration of `contact_body`.
    pub(super) fn redirect(
        &mut self,
        contact_body: &ContactBody,
        free: bool,
        [time, end]: [f64; 2],
    ) {
        let rotor = contact_body.resistance.rotor;
        let free = free && contact_body.resistance.may_turn == DVec3::ONE;
        let left = end - time;
        let by_fields = self
            .spread
            .map(|spread| self.path.acceleration(time) - spread);
        let spin_up = self.path.bend.map(|bend| bend.acceleration(time));
        let twisted = spin_up.map(|it| rotor.momentum(contact_body.attitude, it));
        self.presumed = by_fields.map(|it| [it, twisted.unwrap_or(DVec3::ZERO)]);
        self.hit_at = Some(time);
        // From now on its acceleration is assumed constant.
        let gain = contact_body.linvel + contact_body.acceleration * left;
        self.end_linvel += gain - self.velocity(end);
        self.ahead = DVec3::ZERO;
        if let Some(momentum) = &mut self.end_momentum {
            let change = contact_body.angvel - self.path.angvel(time, contact_body.attitude);
            let jerk = self.path.bend.map_or(DVec3::ZERO, |it| it.jerk);
            let change = change - jerk * (0.5 * left * left);
            *momentum += rotor.momentum(contact_body.attitude, change);
        }
        let span = [time, end];
        let bend = self.path.bend.filter(|_| free);
        let bend = bend.map(|bend| Bend {
            acceleration: bend.acceleration(time),
            jerk: DVec3::ZERO,
            span,
        });
        let unbent = contact_body.angvel - bend.map_or(DVec3::ZERO, |bend| bend.angvel(time));
        self.path = BodyPath {
            from: time,
            com: contact_body.com,
            linvel: contact_body.linvel,
            acceleration: contact_body.acceleration,
            jerk: DVec3::ZERO,
            turn: Turn::new(&rotor, contact_body.attitude, unbent, span, free),
            bend,
        };
        self.generation += 1;
    }

    pub(super) fn is_stopped(&self) -> bool {
        self.stopped.is_some()
    }

    /// Keeps the body at its pose at a moment; it ends the step with the velocity that it would have had.
    pub(super) fn stop(&mut self, time: f64) {
        let attitude = self.path.attitude(time);
        let angvel = self.path.angvel(time, attitude);
        self.stopped = self.stopped.or(Some(angvel));
        self.path = BodyPath::still(time, self.path.com(time), attitude);
        self.generation += 1;
    }

    /// The pose, velocity and angular velocity of the body at the end of the step.
    pub(super) fn finish(&self, dt: f64) -> (DPose3, DVec3, DVec3) {
        let attitude = self.path.attitude(dt);
        let origin = self.path.com(dt) - attitude * self.local_com;
        let pose = DPose3::from_parts(origin, attitude);
        let at_end = |momentum| {
            self.resistance
                .map(|it| it.rotor.angvel(attitude, momentum))
        };
        let angvel = self.end_momentum.and_then(at_end).or(self.stopped);
        let angvel = angvel.unwrap_or_else(|| self.path.angvel(dt, attitude));
        (pose, self.end_linvel, angvel)
    }

    /// The world point to which a point fixed to the body at a moment is carried by the end of Rapier's step.
    pub(super) fn carried_to_end(&self, point: DVec3, time: f64) -> DVec3 {
        let attitude = self.path.attitude(time);
        let local = attitude.inverse() * (point - self.path.com(time)) + self.local_com;
        self.end.transform_point(local)
    }

    /// World bounds that contain the body from one moment to another.
    pub(super) fn bounds(&self, from: f64, to: f64) -> Aabb {
        if let Some(bounds) = self.still.filter(|_| self.generation == 0) {
            return bounds;
        }
        let (a, b) = (self.path.com(from), self.path.com(to));
        let rounding = 4.0 * to_f64(Real::EPSILON) * (a.length() + b.length() + self.reach);
        let bent = self.path.acceleration(from).abs();
        let bent = bent.max(self.path.acceleration(to).abs());
        // An upper bound of the distance of the path from its chord.
        let sagitta = bent * ((to - from) * (to - from) / 8.0);
        let margin = DVec3::splat(self.reach + rounding) + sagitta;
        Aabb {
            mins: from_dvec3(a.min(b) - margin),
            maxs: from_dvec3(a.max(b) + margin),
        }
    }

    /// Its bounds over the whole step, before any impact.
    pub(super) fn place(&self, dt: f64) -> Place {
        Place {
            bounds: self.bounds(0.0, dt),
            way: from_dvec3(self.way(dt)),
            dynamic: self.dynamic,
            bounded: self.reach.is_finite(),
        }
    }
}

/// The part of a span in which the bounding spheres of two bodies overlap; `None` if they do not.
pub(super) fn near_each_other(tracks: [&SweptBody; 2], [from, to]: [f64; 2]) -> Option<[f64; 2]> {
    let [a, b] = tracks;
    let reach = a.reach + b.reach;
    if !reach.is_finite() {
        return Some([from, to]);
    }
    let apart = b.path.com(from) - a.path.com(from);
    let closing = b.path.velocity(from) - a.path.velocity(from);
    // An upper bound of the distance of the relative path from a straight line.
    let pull = |time| (b.path.acceleration(time) - a.path.acceleration(time)).length();
    let pull = f64::max(pull(from), pull(to));
    let off = 0.5 * pull * (to - from) * (to - from);
    // Widened a little against rounding.
    let reach = reach * (1.0 + 1e-9) + 1e-12 * (a.path.com.length() + b.path.com.length()) + off;
    let (square, half, rest) = (
        closing.length_squared(),
        apart.dot(closing),
        apart.length_squared() - reach * reach,
    );
    if square == 0.0 {
        return (rest <= 0.0).then_some([from, to]);
    }
    let inside = half * half - square * rest;
    if inside < 0.0 {
        return None;
    }
    let root = inside.sqrt();
    let slack = 1e-9 * (root / square);
    let enter = if rest <= 0.0 {
        0.0
    } else {
        (-half - root) / square - slack
    };
    let leave = (-half + root) / square + slack;
    let span = [(from + enter).max(from), (from + leave).min(to)];
    (span[0] <= span[1]).then_some(span)
}

/// The initial velocity, acceleration and jerk of a centre of mass that moved along a path within a step, and the part
/// of the velocity that is [ahead](SweptBody::ahead). If something else pushed the body, only the chord is known.
fn way([from, to]: [DVec3; 2], start: &BodyStart, body: &RigidBody, dt: f64) -> [DVec3; 4] {
    let straight = |linvel| [linvel, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO];
    let [linvel, acceleration, arrival] = start.way(from_f64(dt)).map(to_dvec3);
    if dt <= 0.0 {
        return straight(linvel);
    }
    let mean = (to - from) / dt;
    if !body.is_dynamic() {
        return straight(mean);
    }
    let rounding = ROUNDINGS * 0.5 * to_f64(Real::EPSILON);
    let gained = to_dvec3(start.spread) * dt;
    let damped = to_f64(body.linear_damping()) * dt * to_dvec3(start.linvel).length();
    let pushed = (to_dvec3(body.linvel()) - arrival).length();
    let scale = to_dvec3(start.linvel).length() + gained.length() + arrival.length();
    if pushed > rounding * scale + damped {
        return straight(mean);
    }
    let expected = (linvel + acceleration * (0.5 * dt)) * dt;
    let off = from + expected - to;
    // If the force is far from linear in time within the step, the cubic misses the place where the body went.
    let jerk = to_dvec3(start.jerk);
    let bent = jerk * (dt * dt * dt / 12.0);
    if jerk != DVec3::ZERO && (off - bent).length() < off.length() {
        let ahead = (bent - off) / dt;
        let first = acceleration - jerk * (0.5 * dt);
        return [linvel + ahead, first, jerk, ahead];
    }
    let begin = if off.length() <= rounding * (from.length() + to.length()) {
        linvel
    } else {
        mean - acceleration * (0.5 * dt)
    };
    [begin, acceleration, DVec3::ZERO, DVec3::ZERO]
}

/// The rate of change of the torque that bends the rotation, if with it the rotation ends nearer to the known angular
/// momentum; else zero. `unbent` is the angular momentum of the free rotation.
fn torque_rate(turn: &FreeTurn, unbent: DVec3, dt: f64) -> DVec3 {
    let off = unbent + turn.torque * (0.5 * dt) - turn.momentum;
    let bent = turn.torque_rate * (dt * dt / 12.0);
    if (off + bent).length() < off.length() {
        turn.torque_rate
    } else {
        DVec3::ZERO
    }
}

/// The constant angular velocity that turns a body from one attitude to another in `dt`; of the possible ones, the
/// nearest to `angvel`.
fn steady(from: DQuat, to: DQuat, angvel: DVec3, dt: f64) -> DVec3 {
    if from == to && angvel == DVec3::ZERO || dt <= 0.0 {
        return if dt > 0.0 { DVec3::ZERO } else { angvel };
    }
    let turn = to * from.inverse();
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let sine = turn.xyz().length();
    let Some(axis) = turn.xyz().try_normalize() else {
        return DVec3::ZERO;
    };
    let angle = 2.0 * sine.atan2(turn.w);
    let whole = (axis.dot(angvel) * dt - angle) / std::f64::consts::TAU;
    axis * ((angle + whole.round() * std::f64::consts::TAU) / dt)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Between two attitudes lie rotations by whole turns more or less; the velocity tells which.
    #[test]
    fn steady_rotations_keep_their_whole_turns() {
        let (axis, dt) = (DVec3::new(0.48, -0.6, 0.64), 0.25);
        let from = DQuat::from_scaled_axis(DVec3::new(0.3, 1.1, -0.4));
        for angle in [0.3, 2.0, 3.5, 6.0, 6.8, 13.0, 40.0] {
            let to = DQuat::from_scaled_axis(axis * angle) * from;
            // The velocity at the end need not be that of the whole step.
            for off in [-2.5, 0.0, 2.5] {
                let found = steady(from, to, axis * ((angle + off) / dt), dt) * dt;
                assert!((found - axis * angle).length() < 1e-12, "{angle}: {found}");
            }
        }
    }
}
