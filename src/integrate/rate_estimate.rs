//! The stiffness that a body's path shows by the changes of its acceleration.

use super::balance::Work;
use crate::math::{DQuat, DVec3, Real, to_f64};
use crate::rigid::{RigidState, Wrench, of_wrench, pair};

/// Among bodies that act on each other, a motion counts as at least this share of the largest one, because the
/// acceleration of a body that hardly moves changes as the others move.
const STILL: f64 = 0.3;

/// Changes of less than this many rounding errors do not count as stiffness: each change of a plan gains or loses
/// energy, so plans must not change by rounding.
const CERTAIN: f64 = 64.0;

/// The stiffness that a path has shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct RateEstimate {
    /// The square of the fastest angular frequency.
    pub omega2: f64,
    /// The largest change of `omega2` from one piece of the path to the next. Where it is not small, a scheme of higher
    /// order is no better.
    pub jump: f64,
}

impl RateEstimate {
    /// Returns true if a path can have shown this stiffness. Infinite values are valid.
    pub(super) fn is_sound(self) -> bool {
        self.omega2 >= 0.0 && self.jump >= 0.0
    }
}

/// Follows the path of a body from kick to kick.
#[derive(Clone, Default)]
pub(super) struct Track {
    pub path_rate: RateEstimate,
    last: Option<PathPoint>,
    omega2: Option<FrequencyBounds>,
    /// The largest square of a frequency that two consecutive pieces or a Jacobian have shown, and not an edge alone.
    pub sustained: f64,
    /// The last piece of the path.
    piece: PathSegment,
    /// True if the last [`Track::look_aside`] found more than its limit.
    pub is_stiff_aside: bool,
    /// The work that was done along the path.
    pub work: Work,
    /// True if Jacobians show its frequencies, too, because fields move beside it.
    pub is_linearised: bool,
    /// The square of the frequency that the last piece has shown, until its Jacobian is known.
    shown: FrequencyBounds,
}

#[derive(Clone)]
struct PathPoint {
    position: DVec3,
    /// The position in the frame in which the path is looked at.
    seen: DVec3,
    attitude: DQuat,
    acceleration: (DVec3, DVec3),
}

/// Lengths, with angles times the radius of gyration; `root_of_mass` scales them to equal kinetic energy.
#[derive(Clone, Copy, Default)]
struct PathSegment {
    /// Zero if it may be rounding.
    way: f64,
    /// The change of the acceleration.
    change: FrequencyBounds,
    root_of_mass: f64,
}

/// The bounds of a measured value: the value itself, or zero and the largest rounding if it may be rounding.
#[derive(Clone, Copy, Default)]
struct FrequencyBounds {
    least: f64,
    most: f64,
}

impl FrequencyBounds {
    fn exactly(value: f64) -> Self {
        FrequencyBounds {
            least: value,
            most: value,
        }
    }

    /// How far this value and another are apart for certain.
    fn distance(self, other: FrequencyBounds) -> f64 {
        (self.least - other.most)
            .max(other.least - self.most)
            .max(0.0)
    }
}

/// Records the present states of bodies and the wrenches on them. Returns the square of the highest frequency that the
/// last piece of their paths shows. `coupled` if they act on each other. `time` is the time since the start of the
/// path, if the work along the path is wanted.
pub(super) fn track_all<'a>(
    tracks: &mut [Track],
    passing: impl Iterator<Item = (&'a RigidState, &'a Wrench)>,
    coupled: bool,
    time: Option<f64>,
) -> f64 {
    let mut farthest = 0.0_f64;
    for (track, (state, wrench)) in tracks.iter_mut().zip(passing) {
        track.pass(state, *wrench, time);
        farthest = farthest.max(track.piece.way * track.piece.root_of_mass);
    }
    let mut fastest = 0.0_f64;
    for track in tracks {
        let PathSegment {
            way,
            change,
            root_of_mass,
        } = track.piece;
        if way == 0.0 {
            continue;
        }
        let still = if coupled {
            STILL * farthest / root_of_mass
        } else {
            0.0
        };
        let omega2 = |change: f64| match change / way.max(still) {
            omega2 if omega2.is_nan() => f64::INFINITY,
            omega2 => omega2,
        };
        let shown = FrequencyBounds {
            least: omega2(change.least),
            most: omega2(change.most),
        };
        fastest = fastest.max(shown.least);
        if track.is_linearised {
            track.shown = shown;
        } else {
            track.see(shown);
        }
    }
    fastest
}

impl Track {
    /// A path that is looked at in a frame of this velocity; `is_linearised` if Jacobians show its frequencies, too.
    pub(super) fn new(drift: DVec3, is_linearised: bool) -> Self {
        Track {
            work: Work::in_frame(drift),
            is_linearised,
            ..Track::default()
        }
    }

    fn pass(&mut self, state: &RigidState, wrench: Wrench, time: Option<f64>) {
        let mut mark = PathPoint::of(state, wrench);
        if let Some(time) = time {
            mark.seen = self.work.seen(state, time);
            self.work.pass(state, wrench, time);
        }
        self.piece = PathSegment::default();
        if let Some(last) = &self.last {
            self.piece = piece(last, &mark, radius2(state));
            self.piece.root_of_mass = state.mass.sqrt();
        }
        self.last = Some(mark);
    }

    /// Records the square of the frequency between the path and a pose beside it, if it is more than `most`.
    pub(super) fn look_aside(&mut self, aside: &RigidState, wrench: Wrench, most: f64) {
        let beside = |last: &PathPoint| {
            let mut mark = PathPoint::of(aside, wrench);
            mark.seen += last.seen - last.position;
            piece(last, &mark, radius2(aside))
        };
        let omega2 = self
            .last
            .as_ref()
            .map(beside)
            .map(|it| it.change.least / it.way);
        // False for NaN, if neither the acceleration nor the pose changes.
        let found = omega2.filter(|omega2| *omega2 > most);
        self.is_stiff_aside = found.is_some();
        self.path_rate.omega2 =
            found.map_or(self.path_rate.omega2, |it| it.max(self.path_rate.omega2));
    }

    /// Returns true if the last piece has shown more than `most`, and no second piece or Jacobian has confirmed it.
    pub(super) fn is_unsure(&self, most: f64) -> bool {
        self.sustained <= most && self.omega2.is_some_and(|it| it.least > most)
    }

    /// Records the square of a frequency that a Jacobian has shown.
    pub(super) fn see_exactly(&mut self, omega2: f64) {
        self.sustained = self.sustained.max(omega2);
        let FrequencyBounds { least, most } = std::mem::take(&mut self.shown);
        self.see(FrequencyBounds {
            least: least.max(omega2),
            most: most.max(omega2),
        });
    }

    /// Records the square of a frequency.
    fn see(&mut self, now: FrequencyBounds) {
        let before = self.omega2.replace(now);
        self.path_rate.omega2 = self.path_rate.omega2.max(now.least);
        if let Some(before) = before {
            self.sustained = self.sustained.max(before.least.min(now.least));
            self.path_rate.jump = self.path_rate.jump.max(now.distance(before));
        }
    }
}

impl PathPoint {
    fn of(state: &RigidState, wrench: Wrench) -> Self {
        PathPoint {
            position: state.position,
            seen: state.position,
            attitude: state.attitude,
            acceleration: pair(&state.mobility().apply(&of_wrench(wrench))),
        }
    }
}

/// The square of the radius of gyration, which turns angles into lengths.
fn radius2(state: &RigidState) -> f64 {
    let mobility = state.mobility();
    let trace = mobility.inv_inertia.trace();
    if trace > 0.0 {
        mobility.inv_mass.max_element() * 3.0 / trace
    } else {
        0.0
    }
}

fn piece(last: &PathPoint, mark: &PathPoint, radius2: f64) -> PathSegment {
    let size = |v: DVec3, w: DVec3| (v.length_squared() + radius2 * w.length_squared()).sqrt();
    let [from, to] = [last.acceleration, mark.acceleration];
    let change = size(to.0 - from.0, to.1 - from.1);
    let turn = mark.attitude * last.attitude.inverse();
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let way = size(mark.seen - last.seen, turn.to_scaled_axis());
    // Forces and positions have the rounding of the world's number type.
    let epsilon = to_f64(Real::EPSILON);
    let lost = epsilon * (size(from.0, from.1) + size(to.0, to.1));
    let misplaced = epsilon * mark.position.length();
    if way <= CERTAIN * misplaced {
        return PathSegment::default();
    }
    let rounding = CERTAIN * lost;
    let change = if change <= rounding {
        FrequencyBounds {
            least: 0.0,
            most: rounding,
        }
    } else {
        FrequencyBounds::exactly(change)
    };
    PathSegment {
        way: way + misplaced,
        change,
        root_of_mass: 0.0,
    }
}
