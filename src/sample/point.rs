//! A point of a body at which fields are sampled, with the properties they may ask for.

use std::sync::Arc;

use crate::field::{Points, Span};
use crate::math::{ColliderHandle, InteractionGroups, Real, RigidBodyHandle, Vector};

/// Values of the user's axes, by name.
pub(crate) type UserValues = Arc<[(Arc<str>, f64)]>;

/// A point of a body at which fields are sampled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SamplePoint {
    pub world_point: Vector,
    /// From the centre of mass to the point, world axes.
    pub arm: Vector,
    /// The same in the body's axes.
    pub local_arm: Vector,
    /// Of the body's material at the point, world axes.
    pub velocity: Vector,
    /// The body's number among the sampled ones.
    pub body: u32,
    /// See [`owner`].
    pub owner: Real,
    /// Of the part: all of it, whichever fraction the sample stands for.
    pub radius: Real,
    pub mass: Real,
    pub share: Real,
    pub charge: Real,
    pub volume: Real,
    /// Which fraction of its part it stands for.
    pub fraction: Real,
    /// Number of the second moments of what it stands for.
    pub spread: u32,
    pub kind: Kind,
    /// Whether one sample is as good as many: the part is a ball, or has no shape.
    pub is_ball: bool,
    /// Collision groups of the collider.
    pub groups: InteractionGroups,
    /// Number of its [`UserValues`].
    pub user: u32,
    /// The collider it stands for.
    pub collider: Option<ColliderHandle>,
    /// Whether the point is the origin of that collider's frame, where fields anchored to it are.
    pub at_origin: bool,
}

impl SamplePoint {
    /// The centre of mass of a body of no mass and no size, its place still to come.
    pub(crate) fn at_rest(body: u32, owner: Real) -> Self {
        SamplePoint {
            world_point: Vector::ZERO,
            arm: Vector::ZERO,
            local_arm: Vector::ZERO,
            velocity: Vector::ZERO,
            body,
            owner,
            radius: 0.0,
            mass: 0.0,
            share: 1.0,
            charge: 0.0,
            volume: 0.0,
            fraction: 1.0,
            spread: 0,
            kind: Kind::Centre,
            is_ball: true,
            groups: InteractionGroups::all(),
            user: 0,
            collider: None,
            at_origin: false,
        }
    }
}

/// What samples a sample is one of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Centre,
    Site,
    /// Of a soft body: one sample, of whatever kind.
    Particle,
    Several(Points),
}

/// The moment of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    pub time: f64,
    pub dt: Real,
    /// The step whose mean is asked for, or the moment alone.
    pub span: Span,
}

impl Moment {
    /// Before any step.
    pub(crate) const NEVER: Moment = Moment {
        time: 0.0,
        dt: 1.0,
        span: Span {
            start: 0.0,
            end: 0.0,
        },
    };
}

/// Whom a sample or source belongs to, as a number that fits into SIMD lanes: a body's index, or
/// −1. Exact up to 2²⁴ bodies in `f32`.
pub(crate) fn owner(body: Option<RigidBodyHandle>) -> Real {
    body.map_or(-1.0, |handle| handle.into_raw_parts().0 as Real)
}
