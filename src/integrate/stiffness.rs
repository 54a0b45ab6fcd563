//! How fast fields want bodies to move, against the length of a step.

use super::jacobian::Jacobian;
use super::pace::Pace;
use super::plan::Choice;
use crate::math::{ColliderHandle, Real, RigidBodyHandle, Vector, from_f64};
use crate::rapier::na::Matrix6;
use crate::rigid::{Mobility, eigen};

/// How stiff the fields are for a body, from the Jacobian of its wrench, with the bodies that
/// carry the fields held still.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Stiffness {
    /// The step it was measured against.
    pub dt: Real,
    /// dt times the fastest angular frequency at which the body would swing.
    pub dt_omega: Real,
    /// dt times the fastest rate at which drag slows the body down: the damping number.
    pub dt_damping: Real,
    /// dt times the fastest rate at which the fields turn the body's velocity.
    pub dt_gyration: Real,
    /// The longest step for which `KickDriftKick` keeps the energy bounded, 2/ω; infinite if
    /// nothing swings.
    pub largest_stable_dt: Real,
}

/// What a step would get wrong without a word.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepWarning {
    /// The fields are too stiff for the scheme at this step, or nearly so: dt·ω is more than half of
    /// where it explodes, or the scheme gains a percent of energy in a hundred steps.
    #[error(
        "the fields are stiff for {body:?}: dt·ω is {dt_omega}, and the largest stable dt {largest_stable_dt:e}"
    )]
    Stiff {
        /// The body.
        body: RigidBodyHandle,
        /// The step times the fastest frequency; see [`Scheme`](crate::Scheme) for its limit.
        dt_omega: Real,
        /// See [`Stiffness::largest_stable_dt`]; zero under `ExternalForce`, which gains energy at any.
        largest_stable_dt: Real,
    },
    /// [`Auto`](crate::Scheme::Auto) or [`PerBody`](crate::Substeps::PerBody) did not meet its tolerance for
    /// a body: not even its finest substeps do, or it came into a stiff field within a step that it was
    /// not expected to be stiff in.
    #[error("{body:?} was moved with an error of {error}, and the tolerance is {tolerance}")]
    ToleranceMissed {
        /// The body.
        body: RigidBodyHandle,
        /// Of the energy of a vibration, relative.
        error: Real,
        /// What was asked for.
        tolerance: Real,
    },
    /// The fields make a body faster than Rapier lets it be
    /// (`IntegrationParameters::normalized_max_linear_velocity`): Rapier will slow it down.
    #[error("{body:?} is given a speed of {speed}, which Rapier cuts down to {limit}")]
    SpeedCapped {
        /// The body.
        body: RigidBodyHandle,
        /// The speed it is given.
        speed: Real,
        /// The largest that Rapier allows.
        limit: Real,
    },
    /// A body turns by more than Rapier allows in a step, an eighth of a turn, unless
    /// `RigidBody::set_allow_fast_rotation` is on: Rapier will slow it down.
    #[error("{body:?} is given an angular speed of {speed}, which Rapier cuts down to {limit}")]
    RotationCapped {
        /// The body.
        body: RigidBodyHandle,
        /// The angular speed it is given.
        speed: Real,
        /// The largest that Rapier allows.
        limit: Real,
    },
    /// The place, a velocity or the user's force of a body is not finite. Fields leave it alone, and what is
    /// anchored to it is defined nowhere; Rapier will disable it in its step.
    #[error("{body:?} is not finite: fields leave it to Rapier's quarantine")]
    NotFinite {
        /// The body.
        body: RigidBodyHandle,
    },
    /// A field gives a body what cannot be given to Rapier, and it was left out, by
    /// [`FaultPolicy::LeaveOut`](crate::FaultPolicy::LeaveOut). A force that is finite is one that
    /// would make the body too fast.
    #[error("{field} gives {force} on {body:?} at {world_point} (collider {collider:?}): left out")]
    LeftOut {
        /// The field that gives the worst.
        field: String,
        /// The body; of a soft body its root.
        body: RigidBodyHandle,
        /// The collider that was sampled; `None` for a body that was sampled as a whole.
        collider: Option<ColliderHandle>,
        /// Where.
        world_point: Vector,
        /// The field's force there.
        force: Vector,
    },
    /// The same, and the body was disabled, by
    /// [`FaultPolicy::Quarantine`](crate::FaultPolicy::Quarantine).
    #[error(
        "{field} gives {force} on {body:?} at {world_point} (collider {collider:?}): the body is in \
         quarantine"
    )]
    Quarantined {
        /// The field that gives the worst.
        field: String,
        /// The body; of a soft body its root.
        body: RigidBodyHandle,
        /// The collider that was sampled; `None` for a body that was sampled as a whole.
        collider: Option<ColliderHandle>,
        /// Where.
        world_point: Vector,
        /// The field's force there.
        force: Vector,
    },
    /// What a field was anchored to was removed: the field is defined nowhere from now on.
    #[error("{field} is gone, with what it was anchored to")]
    AnchorRemoved {
        /// The field.
        field: String,
    },
    /// Fields answer contacts that Rapier solved as well: its step was not given the
    /// [hooks](crate::OpenStep::hooks) of the open step.
    #[error(
        "Rapier's step was not given the hooks of the open step, and solved contacts of fields"
    )]
    HooksNotGiven,
}

impl StepWarning {
    pub(super) fn missed(choice: Choice, body: RigidBodyHandle, error: f64) -> Self {
        StepWarning::ToleranceMissed {
            body,
            error: from_f64(error),
            tolerance: from_f64(choice.tolerance),
        }
    }
}

/// Rates of a body in fields, per unit of time.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) struct Rates {
    omega: f64,
    damping: f64,
    gyration: f64,
}

impl Rates {
    pub(super) fn new(jacobian: &Jacobian, mobility: &Mobility) -> Self {
        let (root, _) = mobility.roots();
        let motion = root * jacobian.by_motion * root;
        let velocity = root * jacobian.by_velocity * root;
        let skew = (velocity - velocity.transpose()) * 0.5;
        Rates {
            omega: (-least(&motion).min(0.0)).sqrt(),
            damping: -least(&velocity).min(0.0),
            // The square of an antisymmetric matrix is symmetric, with eigenvalues −Ω².
            gyration: (-least(&(skew * skew)).min(0.0)).sqrt(),
        }
    }

    pub(super) fn report(&self, dt: Real) -> Stiffness {
        let times = |rate: f64| from_f64(rate * crate::math::to_f64(dt));
        Stiffness {
            dt,
            dt_omega: times(self.omega),
            dt_damping: times(self.damping),
            dt_gyration: times(self.gyration),
            largest_stable_dt: if self.omega > 0.0 {
                from_f64(2.0 / self.omega)
            } else {
                Real::INFINITY
            },
        }
    }

    /// The square of the frequency at which a vibration would be as hard to follow.
    pub(super) fn pace(&self, choice: Choice, dt: f64) -> Pace {
        let most = f64::from(MOST_BY_VELOCITY.min(choice.most));
        let limit = 4.0 * choice.tolerance * (most / dt).powi(2);
        // The rate of a decay or a gyration is off by no more than (dt·γ)²/24.
        let by_velocity = (self.damping.max(self.gyration).powi(2) / 6.0).min(limit);
        Pace {
            omega2: self.omega2().max(by_velocity),
            jump: 0.0,
        }
    }

    /// That of vibrations alone.
    pub(super) fn omega2(&self) -> f64 {
        self.omega.powi(2)
    }
}

/// Kicks follow drag and gyration at any rate; more substeps than these are not worth the ways between
/// them.
const MOST_BY_VELOCITY: u32 = 32;

/// The least eigenvalue of the symmetric part; minus infinity if that is not finite.
fn least(matrix: &Matrix6<f64>) -> f64 {
    let eigen = eigen((matrix + matrix.transpose()) * 0.5);
    eigen.map_or(f64::NEG_INFINITY, |eigen| eigen.eigenvalues.min())
}

/// What is done with a body in a step, by schemes that choose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) enum Treatment {
    /// Moved within, as finely as this pace asks for.
    Resolve(Pace),
    /// A step went so far that the energy is wrong: it is damped.
    Damp,
}

/// What was found out about a body.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) struct Estimate {
    pub place: usize,
    pub jacobian: Jacobian,
    pub rates: Rates,
}
