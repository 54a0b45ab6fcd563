//! How parts came to touch within a step, for whoever checks it.

use std::collections::HashSet;

use super::swept_body::Form;
use super::time_of_impact::MovingShape;
use super::trajectory::Turn;
use crate::math::{ColliderHandle, DPose3, DQuat, DVec3, Vector};

/// A touch, and the ways that led to it. Times are since the step began.
#[derive(Clone, Debug)]
pub(crate) struct TouchRecord {
    /// In the order of the ways.
    pub colliders: [ColliderHandle; 2],
    pub world_point: Vector,
    pub time: f64,
    /// When the ways began.
    pub from: f64,
    pub approach_speed: f64,
    pub ways: [Way; 2],
    /// Whether the two have touched before in the same step.
    pub again: bool,
}

/// How a part moved until it touched, and would have moved on.
#[derive(Clone, Debug)]
pub(crate) struct Way {
    /// The collider's frame where the way began.
    pub start: DPose3,
    /// The collider's frame at the end of the step, had nothing been answered.
    pub end: DPose3,
    /// The centre of mass of its body at the start, how it moves, and the most that accelerates it along
    /// any axis.
    pub centre: DVec3,
    pub linvel: DVec3,
    pub acceleration: DVec3,
    /// If the rotation is steady, or does not show.
    pub angvel: Option<DVec3>,
}

/// The touches of a step.
#[derive(Debug, Default)]
pub(super) struct TouchLog {
    pub records: Vec<TouchRecord>,
    met: HashSet<[ColliderHandle; 2]>,
}

impl TouchRecord {
    /// The colliders in the order of their handles.
    pub(crate) fn pair(&self) -> [ColliderHandle; 2] {
        let mut pair = self.colliders;
        pair.sort_unstable_by_key(|handle| handle.into_raw_parts());
        pair
    }
}

impl TouchLog {
    pub(super) fn clear(&mut self) {
        self.records.clear();
        self.met.clear();
    }

    /// Notes that two parts touch at a moment of a step of length `dt`.
    pub(super) fn note(
        &mut self,
        parts: [MovingShape<'_>; 2],
        (world_point, approach_speed): (Vector, f64),
        [time, dt]: [f64; 2],
    ) {
        let from = parts.map(|part| part.track.path.from);
        let from = from[0].max(from[1]);
        let mut record = TouchRecord {
            colliders: parts.map(|part| part.member.part.collider),
            world_point,
            time,
            from,
            approach_speed,
            ways: parts.map(|part| Way::of(part, [from, dt])),
            again: false,
        };
        record.again = !self.met.insert(record.pair());
        self.records.push(record);
    }
}

impl Way {
    fn of(part: MovingShape<'_>, [from, dt]: [f64; 2]) -> Self {
        let path = &part.track.path;
        let (own, is_ball) = match &part.member.shape {
            Form::Ball { .. } => (DQuat::IDENTITY, true),
            Form::Plane { shape, .. } | Form::Other(shape) => (shape.rotation, false),
        };
        let frame = |time: f64| {
            let attitude = path.attitude(time);
            let place = path.com(time) + attitude * part.member.arm;
            DPose3::from_parts(place, attitude * own)
        };
        let angvel = match &path.turn {
            // How a ball turns about its own centre does not show.
            _ if is_ball && part.member.arm == DVec3::ZERO => Some(DVec3::ZERO),
            _ if path.bend.is_some() => None,
            Turn::Steady { angvel, .. } => Some(*angvel),
            Turn::Free(top) => {
                let [_, spin_up] = top.bounds();
                (spin_up == 0.0).then(|| path.angvel(from, path.attitude(from)))
            }
        };
        Way {
            start: frame(from),
            end: frame(dt),
            centre: path.com(from),
            linvel: path.velocity(from),
            acceleration: path
                .acceleration(from)
                .abs()
                .max(path.acceleration(dt).abs()),
            angvel,
        }
    }
}
