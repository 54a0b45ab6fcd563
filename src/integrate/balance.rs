//! The energy balance of a body that is moved within steps: the kinetic energy that it gained in excess of the work
//! done on it. It is the error of its energy, however its steps are divided, and adds up from step to step.

use crate::math::{DQuat, DVec3, Real, to_dvec3, to_f64};
use crate::rigid::{RigidState, Wrench};

/// A gain of less than this many rounding errors counts as zero.
const CERTAIN: f64 = 64.0;

/// The number of steps that are not stiff after which a balance ends.
const CALM: u32 = 64;

/// The kinetic energy that a body has gained in excess of the work on it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct EnergyBalance {
    gained: f64,
    /// The largest kinetic energy of the body so far.
    scale: f64,
    /// The number of steps since one was stiff.
    calm: u32,
}

impl EnergyBalance {
    /// The balance over the path of a body, which has shown the frequency √`omega2`, in the frame of its `work`; `None`
    /// if the work is not known, or if Rapier damps the body.
    pub(super) fn of(
        state: &RigidState,
        work: &mut Work,
        omega2: f64,
        tolerance: f64,
    ) -> Option<Self> {
        work.end();
        // `work` does not include that of damping.
        if work.middle.is_none() || state.damping != [0.0; 2] {
            return None;
        }
        let [before, after] = state.kinetic_energies(work.drift);
        let way = work.way;
        let by_rapier = state.acceleration.dot(way) * state.mass;
        let gained = after - before - work.done - by_rapier;
        // Forces have the rounding of `Real`, and an error from that of the positions at which they are evaluated.
        let epsilon = to_f64(Real::EPSILON);
        let misplaced = state.mass * omega2 * state.position.length() * way.length();
        let scale = after.max(before + work.most);
        let may_be_rounding = gained.abs() <= CERTAIN * epsilon * (work.amount + misplaced);
        // Beyond the tolerance, rounding is an error like any other.
        let is_zero = may_be_rounding && gained.abs() <= tolerance * scale;
        Some(EnergyBalance {
            gained: if is_zero { 0.0 } else { gained },
            scale,
            calm: 0,
        })
    }

    /// The balance over this path and the next one together.
    pub(super) fn and(self, next: EnergyBalance) -> Self {
        EnergyBalance {
            gained: self.gained + next.gained,
            scale: self.scale.max(next.scale),
            calm: self.calm,
        }
    }

    /// The balance that the next step continues.
    pub(super) fn after_step(self, is_calm: bool) -> Self {
        let calm = if is_calm {
            self.calm.saturating_add(1)
        } else {
            0
        };
        EnergyBalance { calm, ..self }
    }

    /// Returns true if the balance is still to be kept, although the body is no longer stiff.
    pub(super) fn is_open(self) -> bool {
        self.scale > 0.0 && self.calm < CALM
    }

    /// The relative error of the energy.
    pub(super) fn error(self) -> f64 {
        if self.gained == 0.0 {
            0.0
        } else {
            self.gained.abs() / self.scale
        }
    }

    /// Returns true if a step that adds `next` leaves enough of a tolerance for the steps to come.
    pub(super) fn bears(self, next: EnergyBalance, tolerance: f64) -> bool {
        let most = tolerance * self.scale.max(next.scale);
        let left = most - self.gained.abs();
        // False for NaN.
        next.gained.abs() <= left.max(most / LEAST) / SHARE
    }

    /// Returns false if no step can have left this balance, which may be the case if it was deserialized.
    pub(super) fn is_sound(self) -> bool {
        self.gained.is_finite() && self.scale >= 0.0 && self.scale.is_finite()
    }
}

/// A step may use up one part in this many of the remaining tolerance.
const SHARE: f64 = 4.0;
/// At least one part in this many of the tolerance counts as remaining: a finer step does not undo earlier errors.
const LEAST: f64 = 16.0;

/// The work of wrenches along a path, by parabolas in time through three points each: of fourth order for equal time
/// steps, otherwise of third.
#[derive(Clone, Default)]
pub(super) struct Work {
    /// The velocity of the frame in which paths are looked at: energies of a body depend on it, but not their errors.
    drift: DVec3,
    /// The displacement in that frame.
    way: DVec3,
    done: f64,
    /// The largest value of `done` so far, at least zero.
    most: f64,
    /// The sum of the magnitudes, to which the rounding of `done` is proportional.
    amount: f64,
    /// The middle point of the last parabola.
    middle: Option<WorkPoint>,
    /// The end of the last parabola, and the point after it.
    points: [Option<WorkPoint>; 2],
}

/// A point of a path, and the wrench there.
#[derive(Clone, Copy)]
struct WorkPoint {
    time: f64,
    position: DVec3,
    attitude: DQuat,
    force: DVec3,
    torque: DVec3,
}

impl Work {
    /// Work in a frame of this velocity.
    pub(super) fn in_frame(drift: DVec3) -> Self {
        Work {
            drift,
            ..Work::default()
        }
    }

    /// The position of a body in the frame, `time` after the start of the path.
    pub(super) fn seen(&self, state: &RigidState, time: f64) -> DVec3 {
        state.position - self.drift * time
    }

    /// Continues the path to the present pose of a body, where `wrench` acts.
    pub(super) fn pass(&mut self, state: &RigidState, wrench: Wrench, time: f64) {
        let position = self.seen(state, time);
        self.way = position - state.start.0;
        let point = WorkPoint {
            time,
            position,
            attitude: state.attitude,
            force: to_dvec3(wrench.force),
            torque: if state.is_left_alone() {
                DVec3::ZERO
            } else {
                to_dvec3(wrench.torque)
            },
        };
        match self.points {
            [None, _] => self.points[0] = Some(point),
            [Some(_), None] => self.points[1] = Some(point),
            [Some(first), Some(middle)] => {
                self.add(Parabolas::new(&first, &middle, &point), first.time);
                self.middle = Some(middle);
                self.points = [Some(point), None];
            }
        }
    }

    /// Adds the work up to the last point.
    fn end(&mut self) {
        let points = std::mem::take(&mut self.points);
        if let (Some(middle), [Some(first), Some(last)]) = (self.middle, points) {
            self.add(Parabolas::new(&middle, &first, &last), first.time);
        }
    }

    /// Adds the work from a time to the last point of the parabolas.
    fn add(&mut self, parabolas: Parabolas, from: f64) {
        let [from, to] = [from - parabolas.middle, parabolas.last - parabolas.middle];
        self.done += parabolas.work(to) - parabolas.work(from);
        self.amount += parabolas.amount * (to - from);
        self.most = self.most.max(self.done);
    }
}

/// Parabolas in time through three points of a path, around the middle one.
struct Parabolas {
    middle: f64,
    last: f64,
    /// The power as a polynomial in time: its coefficients from the constant term on.
    power: [f64; 4],
    /// |force| |velocity| + |torque| |angular velocity| at the middle point.
    amount: f64,
}

impl Parabolas {
    fn new(first: &WorkPoint, middle: &WorkPoint, last: &WorkPoint) -> Self {
        let (before, after) = (middle.time - first.time, last.time - middle.time);
        // The linear and the quadratic coefficient of a parabola that is zero at the middle point.
        let fit = |first: DVec3, last: DVec3| {
            let second = (last / after + first / before) / (before + after);
            [last / after - second * after, second]
        };
        let turn = |point: &WorkPoint| {
            let turn = point.attitude * middle.attitude.inverse();
            let turn = if turn.w < 0.0 { -turn } else { turn };
            turn.to_scaled_axis()
        };
        let at = middle.position;
        let ways = [
            fit(first.position - at, last.position - at),
            fit(turn(first), turn(last)),
        ];
        let middles = [middle.force, middle.torque];
        let changes = [
            fit(first.force - middle.force, last.force - middle.force),
            fit(first.torque - middle.torque, last.torque - middle.torque),
        ];
        let mut power = [0.0; 4];
        for ((at, [one, two]), [speed, bend]) in middles.into_iter().zip(changes).zip(ways) {
            power[0] += at.dot(speed);
            power[1] += one.dot(speed) + 2.0 * at.dot(bend);
            power[2] += two.dot(speed) + 2.0 * one.dot(bend);
            power[3] += 2.0 * two.dot(bend);
        }
        // To this order the angular velocity is θ' + ½ θ × θ', with the rotation vector θ.
        let [speed, bend] = ways[1];
        power[2] += 0.5 * middle.torque.dot(speed.cross(bend));
        let amounts = middles.into_iter().zip(ways);
        let amounts = amounts.map(|(at, [speed, _])| at.length() * speed.length());
        Parabolas {
            middle: middle.time,
            last: last.time,
            power,
            amount: amounts.sum(),
        }
    }

    /// The work from the middle point until `time` after it.
    fn work(&self, time: f64) -> f64 {
        let [p0, p1, p2, p3] = self.power;
        time * (p0 + time * (p1 / 2.0 + time * (p2 / 3.0 + time * p3 / 4.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{ColliderSet, RigidBodyHandle, Vector, from_dvec3};
    use crate::rapier::dynamics::{MassProperties, RigidBodyBuilder};
    use crate::rigid::Body;

    const FIELD: DVec3 = DVec3::new(0.3, -2.0, 1.1);
    const DIPOLE: DVec3 = DVec3::new(1.0, 0.4, -0.7);

    fn body() -> RigidState {
        let moments = Vector::new(1.0, 2.0, 2.5);
        let properties = MassProperties::new(Vector::ZERO, 2.0, moments);
        let builder = RigidBodyBuilder::dynamic().additional_mass_properties(properties);
        let mut body = builder.build();
        body.recompute_mass_properties_from_colliders(&ColliderSet::new());
        let handle = RigidBodyHandle::from_raw_parts(0, 0);
        RigidState::new(&Body::of(handle, &body), true)
    }

    /// The potential energy of a dipole in a uniform field, on a spring.
    fn potential(state: &RigidState) -> f64 {
        0.5 * state.position.length_squared() - (state.attitude * DIPOLE).dot(FIELD)
    }

    /// The error of the work along a path of one second, in pieces that are longer and shorter in turn by the share
    /// `uneven`.
    fn error(pieces: usize, uneven: f64) -> f64 {
        let (mut state, mut work) = (body(), Work::default());
        let mut first = None;
        for piece in 0..=pieces {
            let time = (piece as f64 - uneven * (piece % 2) as f64) / pieces as f64;
            let at = |rate: f64| (rate * time).sin();
            state.position = DVec3::new(at(1.3), at(2.0) - 0.4, 0.5 * at(0.7));
            let tilt = DQuat::from_scaled_axis(DVec3::new(at(1.1), -at(0.6), 0.2));
            state.attitude = tilt * DQuat::from_scaled_axis(DVec3::new(0.3, 1.0, 0.1) * time);
            first.get_or_insert_with(|| potential(&state));
            let wrench = Wrench {
                force: from_dvec3(-state.position),
                torque: from_dvec3((state.attitude * DIPOLE).cross(FIELD)),
            };
            work.pass(&state, wrench, time);
        }
        work.end();
        (work.done - (first.unwrap_or(f64::NAN) - potential(&state))).abs()
    }

    #[test]
    fn work_is_of_fourth_order_and_needs_three_points() {
        // Even and odd numbers; uneven pieces are of third order.
        for (pieces, uneven, least) in [
            ([8, 16], 0.0, 13.0),
            ([9, 18], 0.0, 9.0),
            ([8, 16], 0.2, 6.0),
        ] {
            let errors = pieces.map(|pieces| error(pieces, uneven));
            assert!(errors[0] / errors[1] > least, "{pieces:?}: {errors:?}");
            assert!(errors[0] < 1e-3, "{pieces:?}: {errors:?}");
        }
        let mut work = Work::default();
        work.pass(&body(), Wrench::ZERO, 0.0);
        work.pass(&body(), Wrench::ZERO, 1.0);
        assert!(EnergyBalance::of(&body(), &mut work, 0.0, 1.0).is_none());
    }
}
