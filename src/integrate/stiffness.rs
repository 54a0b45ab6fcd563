//! The stiffness of fields for a body, relative to the length of a step, and the warnings of a step.

use super::balance::EnergyBalance;
use super::jacobian::Jacobian;
use super::plan::PlanRules;
use super::rate_estimate::RateEstimate;
use super::stability::{COUPLED, Mode};
use crate::field::FieldRef;
use crate::math::{ColliderHandle, Real, RigidBodyHandle, Vector, from_f64, to_f64};
use crate::rapier::na::Matrix6;
use crate::rigid::{Mobility, eigen};

/// The stiffness of the fields for a body, from the Jacobian of its wrench, with the bodies that carry the fields held
/// still.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Stiffness {
    /// The length of the step that the other values refer to (s).
    pub dt: Real,
    /// dt times the fastest angular frequency at which the body would oscillate.
    pub dt_omega: Real,
    /// dt times the fastest rate at which drag slows the body down: the damping number.
    pub dt_damping: Real,
    /// dt times the fastest rate at which the fields turn the body's velocity.
    pub dt_gyration: Real,
    /// The longest step for which the scheme keeps the energy bounded: 2/ω for `KickDriftKick` and `Kick`, longer with
    /// damping, shorter where a magnetic force turns the body as well. Where fields are anchored to bodies that move,
    /// it allows for the motion of these bodies, too, by a factor of 1/√2. Infinite if nothing oscillates, and for
    /// schemes that damp or divide the step as needed.
    ///
    /// `ExternalForce` gains energy at any step: for it, this is the step from which on it
    /// [warns](StepWarning::Stiff), 0.02/ω, at which the gain is a percent in a hundred steps. Links of multibodies are
    /// moved by such forces under every scheme. Never zero.
    ///
    /// Damping and gyration are taken along each direction in which the body oscillates, which is exact where they do
    /// not mix these directions.
    pub largest_stable_dt: Real,
}

/// A possible error of a step that is made nevertheless.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepWarning {
    /// The fields are too stiff for the scheme at this step, or nearly so: dt·ω is more than half of the limit of
    /// stability (1/√2 of that where fields are anchored to bodies that move), or the scheme gains a percent of energy
    /// in a hundred steps. Springs of contacts ([`Penalty`](crate::ContactLaw::Penalty)) warn from a quarter of the
    /// limit on, under every scheme.
    ///
    /// [`LinearlyImplicit`](crate::Scheme::LinearlyImplicit) damps oscillations, and warns instead of the motions that
    /// it leaves out: from 0.25 on of dt times the rate at which a motion grows, for example near an attracting centre;
    /// and where fields are anchored to bodies that move, of dt·ω from 1 on.
    #[error(
        "the fields are too stiff for {body:?} at this time step: dt·ω is {dt_omega}, and the largest stable time step is {largest_stable_dt:e}"
    )]
    Stiff {
        /// The body.
        body: RigidBodyHandle,
        /// The step times the fastest frequency; see [`Scheme`](crate::Scheme) for its limit.
        dt_omega: Real,
        /// See [`Stiffness::largest_stable_dt`]. Under `LinearlyImplicit`, and for forces given to Rapier
        /// (`ExternalForce`, links of multibodies), which gain energy at any step, the step from which on they warn.
        /// Never zero.
        largest_stable_dt: Real,
    },
    /// [`Auto`](crate::Scheme::Auto) or [`PerBody`](crate::Substeps::PerBody) did not meet its tolerance for a body:
    /// even its finest substeps exceed it; or the errors of the steps since the body was found stiff, or since the last
    /// such warning, add up to more; or so do those of [forces that jump](Self::AbruptForce); or the body entered a stiff
    /// field within a step that was not expected to be stiff.
    #[error("the step of {body:?} has a relative error of {error}; the tolerance is {tolerance}")]
    ToleranceMissed {
        /// The body.
        body: RigidBodyHandle,
        /// The relative error of its energy.
        error: Real,
        /// The tolerance of the scheme.
        tolerance: Real,
    },
    /// The force on a body jumps or bends where the body passes again and again: at the border of a region, where an
    /// operator changes over to another operand, or near the anchor of a spring with a rest length. A step changes the
    /// energy by more or less than the work of the force there. From three such steps on, the warning comes when these
    /// errors add up to more than a twentieth of the largest kinetic energy that the body had since its force first
    /// changed that much; then, and after 256 steps without such a change, they are added up anew. Shorter steps or more
    /// substeps make them smaller. Under `KickDriftKick`, steps of ever other lengths change the energy of bodies in stiff
    /// fields, too, and count.
    ///
    /// Up to 16 bodies are followed at once. Bodies that drag, wind, Rapier's damping, contacts or joints slow down are
    /// not followed, nor are those that are moved within steps in fields on dynamic bodies. Schemes with a tolerance
    /// [warn](Self::ToleranceMissed) beyond it instead.
    #[error(
        "forces change so abruptly along the path of {body:?} that the steps have changed its energy by {error} of its \
         largest kinetic energy; shorter steps or more substeps change it less"
    )]
    AbruptForce {
        /// The body.
        body: RigidBodyHandle,
        /// The error of its energy, as a share of its largest kinetic energy.
        error: Real,
    },
    /// A body that is moved within the step was hit in it, in fields that change much over the rest of the step, so its
    /// speed is inaccurate. Schemes with a tolerance warn beyond it, others beyond one percent. See
    /// [`Scheme`](crate::Scheme).
    #[error(
        "{body:?} was hit where fields are stiff for the time step; its speed has a relative error of {error}"
    )]
    HitInStiffField {
        /// The body.
        body: RigidBodyHandle,
        /// The error of its speed, as a share of it.
        error: Real,
    },
    /// The fields make a body faster than Rapier allows (`IntegrationParameters::normalized_max_linear_velocity`);
    /// Rapier will slow it down.
    #[error("{body:?} is given a speed of {speed}, which Rapier cuts down to {limit}")]
    SpeedCapped {
        /// The body.
        body: RigidBodyHandle,
        /// The speed it is given.
        speed: Real,
        /// The largest that Rapier allows.
        limit: Real,
    },
    /// A body rotates by more than Rapier allows in a step, an eighth of a turn, unless
    /// `RigidBody::set_allow_fast_rotation` is on; Rapier will slow it down.
    #[error("{body:?} is given an angular speed of {speed}, which Rapier cuts down to {limit}")]
    RotationCapped {
        /// The body.
        body: RigidBodyHandle,
        /// The angular speed it is given.
        speed: Real,
        /// The largest that Rapier allows.
        limit: Real,
    },
    /// The mass of a body was changed since the last step, by a change of a shape, a density or a mass. Rapier
    /// recomputes it only within its step, so a force that fields applied there was that on the mass before. The forces
    /// of later steps are right; what the push has moved stays moved. Only bodies are looked at to which fields apply
    /// a force: those that Rapier's solver holds, and all under schemes that do so. Call
    /// `RigidBody::recompute_mass_properties_from_colliders` with each such change to avoid this.
    #[error(
        "fields applied the force on a mass of {before} to {body:?}, which has one of {after} since this step; recompute its mass when you change it"
    )]
    MassChanged {
        /// The body.
        body: RigidBodyHandle,
        /// The mass for which its force was computed.
        before: Real,
        /// The mass in Rapier's step.
        after: Real,
    },
    /// A body is so far from the origin of the world that rounding changes its energy noticeably: neighbouring numbers
    /// are `spacing` apart there, a body at the speed below which Rapier lets bodies sleep would move by less in a step,
    /// and this one moves by less than ten of them. Fields that act on it work along the rounded path. Bodies
    /// that Rapier's solver holds are not looked at. Move the origin, or use `rapier3d-fields-f64`.
    #[error(
        "{body:?} is so far from the origin that positions are {spacing} apart; at a speed of {speed} its energy changes by rounding"
    )]
    FarFromOrigin {
        /// The body.
        body: RigidBodyHandle,
        /// The distance of neighbouring numbers at its largest coordinate.
        spacing: Real,
        /// Its speed.
        speed: Real,
    },
    /// The pose, a velocity or the user's force of a body is not finite. No field acts on it, fields that are anchored
    /// to it are defined nowhere, and Rapier will disable it in its step.
    #[error(
        "the pose or velocity of {body:?} is not finite; fields leave it to Rapier's quarantine"
    )]
    NotFinite {
        /// The body.
        body: RigidBodyHandle,
    },
    /// A field gives a body a force that Rapier cannot take, and it was left out by
    /// [`FaultPolicy::LeaveOut`](crate::FaultPolicy::LeaveOut). If `force` is finite, it would make the body too fast.
    #[error(
        "{field} gives {force} on {body:?} at {world_point} (collider {collider:?}); it is left out"
    )]
    LeftOut {
        /// The field with the worst force; "one of the fields" if there are too many faults at once to look for it.
        field: FieldRef,
        /// The body; of a soft body its root.
        body: RigidBodyHandle,
        /// The collider that was sampled; `None` for a body that was sampled as a whole.
        collider: Option<ColliderHandle>,
        /// The sample point, in world space.
        world_point: Vector,
        /// The field's force there.
        force: Vector,
    },
    /// A field gives a body a force that Rapier cannot take, and the body was disabled by
    /// [`FaultPolicy::Quarantine`](crate::FaultPolicy::Quarantine). If `force` is finite, it would make the body too
    /// fast.
    #[error(
        "{field} gives {force} on {body:?} at {world_point} (collider {collider:?}); the body is in \
         quarantine"
    )]
    Quarantined {
        /// The field with the worst force; "one of the fields" if there are too many faults at once to look for it.
        field: FieldRef,
        /// The body; of a soft body its root.
        body: RigidBodyHandle,
        /// The collider that was sampled; `None` for a body that was sampled as a whole.
        collider: Option<ColliderHandle>,
        /// The sample point, in world space.
        world_point: Vector,
        /// The field's force there.
        force: Vector,
    },
    /// The answers to contacts make a body so fast that the square of its speed overflows, which [the paper's
    /// law](crate::ContactLaw::Paper) can cause because it may double the speed at each touch. The answers were left
    /// out, and the body keeps the motion that Rapier gave it.
    #[error(
        "contacts would make {body:?} too fast for the number type; their impulses are left out"
    )]
    AnswerLeftOut {
        /// The body.
        body: RigidBodyHandle,
    },
    /// Swept detection reached its limit of work,
    /// [`FieldSettings::swept_work`](crate::pipeline::FieldSettings::swept_work). Bodies that touch after that stay where
    /// they touch until the step ends, and keep their velocity. Bodies that cannot come to rest reach the limit, and
    /// bodies that turn many times in a step and meet others.
    #[error(
        "swept detection reached its limit of work: {bodies} bodies stay where they touched until the step ends"
    )]
    SweptWork {
        /// The number of these bodies.
        bodies: usize,
    },
    /// The impulse that would answer a contact is not finite, for example by mass properties that are not finite. It
    /// was left out, and Rapier answers the contact from the next step on, until the two separate.
    #[error(
        "the impulse at the contact of {colliders:?} is not finite; the contact is left to Rapier"
    )]
    AnswerNotFinite {
        /// The two colliders, in the order of their handles.
        colliders: [ColliderHandle; 2],
    },
    /// The overlap of two colliders grew in each of three steps, although fields answer their contact, to more than
    /// four times the allowed error of Rapier's solver (0.02 length units). Rapier answers the contact from the next
    /// step on, if it does not already, until the two separate.
    #[error("{colliders:?} overlap by {depth}, more in each step; their contact is left to Rapier")]
    ContactDeepens {
        /// The two colliders, in the order of their handles.
        colliders: [ColliderHandle; 2],
        /// The depth of the overlap.
        depth: Real,
    },
    /// One of two colliders was given another shape by `set_shape`, and Rapier keeps contacts of the former shape,
    /// which had several parts (a compound, a mesh, a height field, voxels): where these parts were, the colliders
    /// still touch. Remove such a collider and insert another one instead of setting its shape.
    ///
    /// Rapier 0.36 alone may then end the program (with `contact_clustering`, its default): its solver reads beyond its
    /// contacts once the two separate. A step of fields makes Rapier sort its contacts anew, which avoids this unless
    /// Rapier makes several passes of continuous detection (`max_ccd_substeps` above 1).
    #[error(
        "Rapier keeps contacts of a former shape of one of {colliders:?}: instead of set_shape, remove the collider and insert another one"
    )]
    ContactsOutliveShape {
        /// The two colliders, in Rapier's order.
        colliders: [ColliderHandle; 2],
    },
    /// The body or collider to which a field was anchored was removed; the field is defined nowhere from now on.
    #[error("{field} was removed with the body or collider that it was anchored to")]
    AnchorRemoved {
        /// The field.
        field: FieldRef,
    },
    /// A soft body that encloses no volume, a sheet or a rope, is within the reach of a field that acts on volumes,
    /// such as [buoyancy](crate::Field::buoyancy). It displaces nothing, so the field does not act on it.
    #[error("{body:?} is a soft body without a volume, so it displaces no fluid")]
    NoVolume {
        /// The root of the soft body.
        body: RigidBodyHandle,
    },
    /// A soft body with pinned particles is in a drag or wind that is strong for the step, or another force that reads
    /// velocities. Its particles get the mean of the force along the path of a free particle, so for those that a pin
    /// or their neighbours hold, this force and their weight are too small: by a share of 1 − (1 − e⁻ˣ)/x for a drag of
    /// rate k, where x = k·dt. Make the step shorter, or the force weaker.
    #[error(
        "{body:?} is a soft body with pins: particles that are held lack up to a share of {share} of a force that reads velocities, and of their weight; make the step shorter"
    )]
    PinnedParticles {
        /// The root of the soft body.
        body: RigidBodyHandle,
        /// The largest share of the force that a held particle lacks; more than 0.01.
        share: Real,
    },
    /// Fields answer contacts that Rapier solved as well, because the [hooks](crate::pipeline::OpenStep::hooks) of the open step
    /// were not passed to Rapier's step.
    #[error(
        "Rapier's step was not given the hooks of the open step, so Rapier solved contacts that fields also answer"
    )]
    HooksNotGiven,
    /// Rapier made several steps between [`begin`](crate::Fields::begin) and [`finish`](crate::Fields::finish), or one
    /// that was longer than the one begun: fields acted for `dt` only. Call begin and finish around each of Rapier's
    /// steps.
    #[error(
        "Rapier advanced bodies by {advanced} between begin and finish, but the step that was begun is {dt}"
    )]
    OtherSteps {
        /// The time by which Rapier advanced bodies, as far as they show it.
        advanced: Real,
        /// The length of the step that was begun.
        dt: Real,
    },
}

impl StepWarning {
    pub(super) fn missed(plan_rules: PlanRules, body: RigidBodyHandle, error: f64) -> Self {
        StepWarning::ToleranceMissed {
            body,
            error: from_f64(error),
            tolerance: from_f64(plan_rules.tolerance),
        }
    }
}

/// Rates of a body in fields, per unit of time.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Rates {
    pub omega: f64,
    /// The rate at which a motion away from equilibrium grows.
    pub divergence: f64,
    pub damping: f64,
    gyration: f64,
}

impl Rates {
    pub(super) fn new(jacobian: &Jacobian, mobility: &Mobility) -> Self {
        let (root, _) = mobility.roots();
        let motion = root * jacobian.by_motion * root;
        let velocity = root * jacobian.by_velocity * root;
        let skew = (velocity - velocity.transpose()) * 0.5;
        let [least, greatest] = extremes(&motion);
        Rates {
            omega: (-least.min(0.0)).sqrt(),
            divergence: greatest.max(0.0).sqrt(),
            damping: -extremes(&velocity)[0].min(0.0),
            // The square of an antisymmetric matrix is symmetric, with eigenvalues −Ω².
            gyration: (-extremes(&(skew * skew))[0].min(0.0)).sqrt(),
        }
    }

    /// The angle by which fields turn the velocity in a step.
    pub(super) fn turns_by(&self, dt: f64) -> f64 {
        self.gyration * dt
    }

    pub(super) fn report(&self, dt: Real, largest_stable_dt: Real) -> Stiffness {
        let times = |rate: f64| from_f64(rate * crate::math::to_f64(dt));
        Stiffness {
            dt,
            dt_omega: times(self.omega),
            dt_damping: times(self.damping),
            dt_gyration: times(self.gyration),
            largest_stable_dt,
        }
    }

    /// The stiffness to plan for: the square of the highest frequency, where drag and gyration count as the frequency
    /// that would need the same substeps.
    pub(super) fn path_rate(&self, plan_rules: PlanRules, dt: f64) -> RateEstimate {
        let most = f64::from(MOST_BY_VELOCITY.min(plan_rules.most));
        let limit = 4.0 * plan_rules.tolerance * (most / dt).powi(2);
        // The rate of a decay or a gyration is off by no more than (dt·γ)²/24.
        let by_velocity = (self.damping.max(self.gyration).powi(2) / 6.0).min(limit);
        RateEstimate {
            omega2: self.omega2().max(by_velocity),
            jump: 0.0,
        }
    }

    /// The square of the highest frequency of vibrations alone.
    pub(super) fn omega2(&self) -> f64 {
        self.omega.powi(2)
    }
}

/// The largest number of substeps for drag and gyration. Kicks follow these at any rate, so more substeps, which
/// improve the path between kicks only, do not pay.
const MOST_BY_VELOCITY: u32 = 32;

/// The least and the greatest eigenvalue of the symmetric part; infinite if it is not finite.
fn extremes(matrix: &Matrix6<f64>) -> [f64; 2] {
    let eigen = eigen((matrix + matrix.transpose()) * 0.5);
    eigen.map_or([f64::NEG_INFINITY, f64::INFINITY], |eigen| {
        [eigen.eigenvalues.min(), eigen.eigenvalues.max()]
    })
}

/// The method for a stiff body in a step, by schemes that choose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) enum StiffMethod {
    /// Moved within the step, as finely as this stiffness and the balance of earlier steps need.
    Resolve {
        path_rate: RateEstimate,
        balance: EnergyBalance,
    },
    /// Damped, because its last step was so coarse that its energy may be wrong, or no plan is fine enough.
    Damp,
}

impl StiffMethod {
    /// Returns false if no step can have left this method, which may be the case if it was deserialized.
    pub(super) fn is_sound(&self) -> bool {
        match self {
            StiffMethod::Resolve { path_rate, balance } => {
                path_rate.is_sound() && balance.is_sound()
            }
            StiffMethod::Damp => true,
        }
    }
}

/// The linearisation of a body.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Estimate {
    pub place: usize,
    pub jacobian: Jacobian,
    pub rates: Rates,
}

impl Estimate {
    /// Returns false if no linearisation can have given these values, which may be the case if they were deserialized.
    /// Rates of derivatives that are not finite are infinite.
    pub(super) fn is_sound(&self) -> bool {
        let Rates {
            omega,
            divergence,
            damping,
            gyration,
        } = self.rates;
        let Jacobian {
            wrench,
            by_motion,
            by_velocity,
        } = &self.jacobian;
        let finite = |entries: &[f64]| entries.iter().all(|entry| entry.is_finite());
        let (motion, velocity) = (omega.max(divergence), damping.max(gyration));
        let is_bounded = motion.max(velocity).is_finite();
        let rates = [omega, divergence, damping, gyration];
        rates.iter().all(|rate| *rate >= 0.0)
            && (finite(by_motion.as_slice()) || motion.is_infinite())
            && (finite(by_velocity.as_slice()) || velocity.is_infinite())
            && (finite(wrench.as_slice()) || !is_bounded)
    }

    /// The modes of oscillation of the body, with Rapier's own `damping`; `coupled` if it oscillates with others.
    pub(super) fn modes(
        &self,
        mobility: &Mobility,
        damping: [Real; 2],
        coupled: bool,
    ) -> [Mode; 6] {
        let (root, _) = mobility.roots();
        let motion = root * self.jacobian.by_motion * root;
        let mut slows = -(root * self.jacobian.by_velocity * root);
        for axis in 0..6 {
            slows[(axis, axis)] += to_f64(damping[axis / 3]);
        }
        let stiff = Mode {
            omega2: f64::INFINITY,
            damping: 0.0,
            gyration: 0.0,
        };
        let Some(eigen) = eigen((motion + motion.transpose()) * 0.5) else {
            return [stiff; 6];
        };
        let share = if coupled { COUPLED } else { 1.0 };
        std::array::from_fn(|number| {
            let way = eigen.eigenvectors.column(number);
            Mode {
                omega2: share * -eigen.eigenvalues[number].min(0.0),
                damping: way.dot(&(slows * way)).max(0.0),
                gyration: self.rates.gyration,
            }
        })
    }
}
