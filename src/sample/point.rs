//! A sample: a point of a body with the properties that fields may read, and the moment at which it is
//! evaluated.

use std::sync::Arc;

use crate::field::{Points, Span};
use crate::math::{ColliderHandle, InteractionGroups, Real, RigidBodyHandle, Vector};

/// Values of the user's axes, with their names.
pub(crate) type UserValues = Arc<[(Arc<str>, f64)]>;

/// A point of a body at which fields are sampled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SamplePoint {
    pub world_point: Vector,
    /// From the centre of mass to the point, in world axes.
    pub arm: Vector,
    /// `arm` in the body's axes.
    pub local_arm: Vector,
    /// Velocity of the body's material at the point, in world axes.
    pub velocity: Vector,
    /// The body's number among the sampled ones.
    pub body: u32,
    /// The body as a number; see [`owner`].
    pub owner: Real,
    /// This and the next four are of the whole part, whatever fraction of it the sample stands for.
    pub radius: Real,
    pub mass: Real,
    pub share: Real,
    pub charge: Real,
    pub volume: Real,
    /// The fraction of its part that the sample stands for.
    pub fraction: Real,
    /// The number, in [`Samples::spreads`](super::Samples::spreads), of the second moments of that fraction.
    pub spread: u32,
    pub kind: Kind,
    /// True if one sample is enough for the part: the part is a ball, or has no shape.
    pub is_ball: bool,
    /// Collision groups of the collider.
    pub groups: InteractionGroups,
    /// The number of its [`UserValues`].
    pub user: u32,
    /// The collider of the part.
    pub collider: Option<ColliderHandle>,
    /// True if the point is the origin of the collider's frame, where fields anchored to it are.
    pub at_origin: bool,
}

impl SamplePoint {
    /// A sample at the centre of mass of a body without mass or size. Its place has to be set.
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

/// The set of samples that a sample belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Centre,
    Site,
    /// A particle of a soft body: one sample for all kinds of sampling but that at centres of mass.
    Particle,
    Several(Points),
}

/// A moment of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    pub time: f64,
    pub dt: Real,
    /// The step over which lifetimes are averaged, or the moment alone.
    pub span: Span,
}

impl Moment {
    /// A moment before any step.
    pub(crate) const NEVER: Moment = Moment {
        time: 0.0,
        dt: 1.0,
        span: Span {
            start: 0.0,
            end: 0.0,
        },
    };
}

/// The carrier of a sample or source as a number that fits into SIMD lanes: the body's index, or −1 without a
/// body. Exact up to 2²⁴ bodies in `f32`.
pub(crate) fn owner(body: Option<RigidBodyHandle>) -> Real {
    body.map_or(-1.0, |handle| handle.into_raw_parts().0 as Real)
}
