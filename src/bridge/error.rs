//! The reasons for which a step is refused.

use crate::field::{Anchor, BuildError, FieldRef};
use crate::integrate::Scheme;
use crate::math::{ColliderHandle, Real, RigidBodyHandle, Vector};

/// The reason why a step was refused. The world is as it was before the step: bodies of all kinds with the next
/// positions of kinematic ones, joints, soft bodies, and all flags. Exceptions are [`Unfinished`](Self::Unfinished) and
/// [`NotTheirs`](Self::NotTheirs). Faults of single bodies ([`NonFinite`](Self::NonFinite),
/// [`TooFast`](Self::TooFast)) refuse a step only by [`FieldSettings::on_fault`](crate::pipeline::FieldSettings::on_fault).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The time step is negative, infinite or NaN.
    #[error("the time step must be zero or more, and finite, but is {dt}")]
    TimeStep {
        /// The time step.
        dt: Real,
    },
    /// A field gives a force or torque that is infinite or NaN, and
    /// [`FaultPolicy::Refuse`](crate::FaultPolicy::Refuse) is on.
    #[error("{field} gives {force} on {body:?} at {world_point} (collider {collider:?})")]
    NonFinite {
        /// The field.
        field: FieldRef,
        /// The body.
        body: RigidBodyHandle,
        /// The collider that was sampled; `None` for a body without any.
        collider: Option<ColliderHandle>,
        /// The sample point, in world space.
        world_point: Vector,
        /// The field's force there, in world axes.
        force: Vector,
    },
    /// The fields would give a body a speed whose square overflows the scalar type, which Rapier turns into a velocity
    /// of zero without an error; or they give it a force that overflows together with the user's own.
    /// [`FaultPolicy::Refuse`](crate::FaultPolicy::Refuse) is on.
    #[error("{field} pushes {body:?} to a speed of {speed:e}; at most {limit:e} can be simulated")]
    TooFast {
        /// The field that pushes the most.
        field: FieldRef,
        /// The body.
        body: RigidBodyHandle,
        /// The speed it would have.
        speed: Real,
        /// The largest speed whose square is finite.
        limit: Real,
    },
    /// A field is anchored to a body or collider that is not in the world.
    #[error("{field} is anchored to {anchor}, which is not in the world")]
    MissingAnchor {
        /// The field.
        field: FieldRef,
        /// The body or collider that is missing.
        anchor: Anchor,
    },
    /// A field answers contacts, other than by springs, under a scheme that does not keep the energy of bodies that are
    /// hit in a field: `Kick`, `ExternalForce` and `LinearlyImplicit`, unless all fields are constant.
    #[error(
        "{field} answers contacts, but {scheme:?} does not keep the energy of what is hit in a field: choose KickDriftKick, or Responder::Rapier"
    )]
    SchemeAtHits {
        /// The first such field.
        field: FieldRef,
        /// The scheme.
        scheme: Scheme,
    },
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] BuildError),
    /// The state of the fields is not one that a step leaves behind: it was read from elsewhere.
    #[error("the state of the fields is not one that a step leaves behind: {value}")]
    State {
        /// The quantity that is wrong, with its value.
        value: String,
    },
    /// The state of the fields belongs to another world: none of the bodies that it refers to is at its recorded pose.
    #[error(
        "the state of the fields belongs to another world: {body:?} is not there as it left it"
    )]
    OtherWorld {
        /// The first of these bodies.
        body: RigidBodyHandle,
    },
    /// The last step was begun and never finished, because its `OpenStep` was dropped. The forces that stood in place
    /// of the user's have now been taken back, but not what was written to velocities; the next call begins a step.
    #[error("the last step was begun but never finished: its OpenStep was dropped")]
    Unfinished,
    /// Rapier made no step between [`begin`](crate::Fields::begin) and [`finish`](crate::Fields::finish). Programs that
    /// draw between two steps may make none in some frames, or several. Call both around each of Rapier's steps.
    #[error("Rapier made no step between begin and finish: call both around each of its steps")]
    NotStepped,
    /// The open step is not the last one that these fields began. The world stays as it was given.
    #[error("this OpenStep is not the last one that these fields began")]
    NotTheirs,
}
