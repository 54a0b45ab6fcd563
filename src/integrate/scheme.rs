//! Schemes: the rules by which wrenches become motion.

use super::plan::PlanRules;
use crate::field::BuildError;
use crate::math::{Real, to_f64};

/// The rule by which the wrench of the fields becomes motion in a Rapier step.
///
/// ω is the fastest frequency of a body in the fields, from the Jacobian of its wrench; see
/// [`Fields::stiffness`](crate::Fields::stiffness).
///
/// | scheme | order | evaluations per step | force that depends on position |
/// |---|---|---|---|
/// | [`KickDriftKick`](Scheme::KickDriftKick) | 2 | 1 | symplectic: energy bounded while dt·ω < 2 |
/// | [`Kick`](Scheme::Kick) | 1 | 1 | symplectic: energy bounded while dt·ω < 2 |
/// | [`Substep`](Scheme::Substep) | 2 | 1 + n | symplectic: energy bounded while dt·ω < 2 n |
/// | [`Forward4`](Scheme::Forward4) | 4 | 4 | symplectic: energy bounded while dt·ω < 3.46 (2.72 where forces read velocities); for fields that are smooth |
/// | [`LinearlyImplicit`](Scheme::LinearlyImplicit) | 1 | 1 and Jacobians | damped: in a well that stands still energy falls at any dt·ω |
/// | [`Auto`](Scheme::Auto) | 2 or 4 | 1, more where stiff | as fine as its tolerance asks for, body by body |
/// | [`ExternalForce`](Scheme::ExternalForce) | 1 | 1 | gains energy at any dt·ω with Rapier's default of 4 solver iterations |
///
/// The bounds of dt·ω hold for steps of equal length.
///
/// Contacts, joints, locked axes, dominance and continuous collision detection stay Rapier's under every
/// scheme. `Substep`, `Forward4` and `Auto` compute the motion in the fields alone in smaller steps, give
/// the body the mean velocity of that motion before Rapier's step, and the velocity at the end of that motion
/// after it. If Rapier changes the velocity in the meantime, the result counts as the velocity of the middle
/// of the step, and half a kick follows.
///
/// Bodies that Rapier's solver holds by contacts or joints are loaded as by gravity (not under `ExternalForce`,
/// and under `Kick` only where forces read velocities): the force is spread over the iterations of Rapier's
/// step, so that a body held by friction stays in place, and a resting body shows no velocity. The shown
/// velocity lags behind that of `KickDriftKick` by half an iteration of the force; the map is the same.
///
/// The kicks of a free body in fields include Rapier's gravity, the user's force and Rapier's damping, so the order
/// holds with all of them on. `Kick`, `ExternalForce` and `LinearlyImplicit` leave damping to Rapier; the first two,
/// which are for comparison, also leave gravity and the user's force to it, unless forces read velocities. The user's
/// torque is always Rapier's, at first order. Rapier moves bodies on which no field acts; but wherever any field can
/// rotate bodies (see [`Fields`](crate::Fields)), this crate computes the free rotation of bodies of unequal inertia,
/// whether a field reaches them or not. Without contact fields, balls, and bodies that do not spin, move as in Rapier
/// bit for bit where no field acts.
///
/// Forces that read velocities: kicks follow their linear part exactly (with gravity and damping), so a drag of any
/// strength stops a body without reversing it, a falling body reaches its terminal velocity, and a magnetic force turns
/// a velocity without changing its length. For such forces `Forward4` makes Suzuki's composition of five
/// kick-drift-kick steps (M. Suzuki, Phys. Lett. A 146 (1990) 319), with kicks by the implicit midpoint rule; in a step
/// in which drag or damping stops any body (its rate times dt is more than 1) it makes five equal steps of second
/// order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Scheme {
    /// Half the impulse before Rapier's step, half of the next one after it (velocity Verlet).
    /// One evaluation per step: that of the second half is also the next step's first, unless something
    /// moved in between. Free rotation is split off and computed by this crate (see
    /// [`Fields`](crate::Fields)).
    #[default]
    KickDriftKick,
    /// The whole impulse before Rapier's step (symplectic Euler).
    Kick,
    /// `add_force` and `add_torque` before Rapier's step; after it the user's own forces are restored bit for bit. This
    /// is the documented way to apply forces in Rapier. Links of multibodies, which ignore impulses, are moved this way
    /// under every scheme.
    ExternalForce,
    /// Kick-drift-kick in steps smaller than Rapier's.
    Substep(Substeps),
    /// Linearly implicit (Rosenbrock) Euler, body by body: (M − dt ∂F/∂v − dt² ∂F/∂x) Δv = dt (F + dt ∂F/∂x v). Stable
    /// at any step; motions that it cannot follow are damped. Of ∂F/∂x only the restoring part is used, so that no
    /// direction in which a field pushes away is amplified; the order stays one with any such matrix.
    ///
    /// Each body is solved for as if the carriers of the fields stood still: bodies that act on each other may gain
    /// energy, and a body that passes close to an attracting centre is thrown out at a coarse step.
    /// [`StepWarning::Stiff`](crate::StepWarning::Stiff) warns before; use [`Auto`](Scheme::Auto) for such bodies.
    LinearlyImplicit,
    /// A step of fourth order, without a step back in time where no force reads velocities: kicks of a sixth, two
    /// thirds and a sixth of the step, with drifts of half a step between them. The middle wrench is taken at poses
    /// that are shifted by h²/24 times the accelerations, linear and angular (S. A. Chin, Phys. Lett. A 226 (1997)
    /// 344). All bodies pass through its stages together, so that fields of bodies on bodies are of fourth order, too;
    /// damping is part of the drifts. Not for fields with jumps. See [`Scheme`] for forces that read velocities.
    Forward4,
    /// For each body the cheapest of `KickDriftKick`, `Substep` and steps like those of `Forward4` that meets the
    /// tolerance; in parts of unequal lengths where the motion is stiff for a moment only, like a close pass.
    ///
    /// Bodies are monitored by the change of their wrench along their path, which costs next to nothing. Jacobians are
    /// computed for all bodies after fields were edited or bodies came or went, and otherwise only for bodies that
    /// looked stiff, that are in strong drag, or whose velocities were changed by hand. A motion that was too coarse is
    /// repeated more finely before it is given to Rapier. A body that entered a stiff field in a step that was not
    /// expected to be stiff is placed at the end of the finer motion, after Rapier's step, if nothing else touched it,
    /// no field reads velocities, and no field detects contacts. Otherwise, and where even the finest plan does not
    /// meet the tolerance, the step warns with [`StepWarning::ToleranceMissed`](crate::StepWarning::ToleranceMissed).
    /// A body alone in a well that is too stiff for every plan is damped, as by `LinearlyImplicit`; the first of its
    /// steps warns, with an error of 1.
    ///
    /// If fields are anchored to bodies that move, all bodies are moved by the same plan as soon as one of them needs
    /// it, so reacting fields keep momentum.
    Auto {
        /// Bound of the relative error of the energy of a vibration, (dt·ω)²/4 for
        /// `KickDriftKick`; and of the rate of a decay or a gyration, (dt·γ)²/24. Positive, at
        /// most 0.25.
        ///
        /// Errors add up from step to step. While a body is stiff, its balance is kept: the kinetic energy that it
        /// gained in excess of the work of the forces along its path, as a share of the largest it had. Steps are made
        /// finer before the balance reaches the tolerance. Where it does so nevertheless, the step warns with
        /// [`StepWarning::ToleranceMissed`](crate::StepWarning::ToleranceMissed), and the balance starts from zero.
        /// There is no balance where forces read velocities, where Rapier damps the body, or in steps in which
        /// something else touches it. It does not include errors between the points of a path, such as at the bend of
        /// the force of a spring with a rest length near its anchor.
        ///
        /// Where fields move on kinematic bodies, and where bodies act on nothing but each other, a vibration is judged
        /// by the motion relative to the fields, or to the centre of mass of all bodies; but balances on kinematic
        /// bodies are shares of the kinetic energy in the world, and let a vibration exceed the tolerance there. In
        /// fields that move by the time that a closure or an expression reads, and where several groups of bodies fly
        /// apart, a body that rides along at many times its own velocity may look less stiff than it is.
        ///
        /// All of this holds for forces that change smoothly. Where a force jumps within a step, at the border of a
        /// region or where an operator changes over to another operand, the velocity is off by about half the change of
        /// the force times dt/m. For a body that is not stiff otherwise, the errors of its energy are added up, and
        /// reported as above beyond the tolerance; up to 16 such bodies are
        /// [followed](crate::StepWarning::AbruptForce) at once. For a stiff one they are neither counted nor reported. A
        /// shorter step makes them smaller.
        tolerance: Real,
    },
}

/// The number of substeps of [`Scheme::Substep`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Substeps {
    /// The same number for all bodies, from 1 to 1024.
    Fixed(u32),
    /// For each body a power of two, up to 256, from its stiffness; see [`Scheme::Auto`].
    PerBody {
        /// As the tolerance of [`Scheme::Auto`].
        tolerance: Real,
    },
}

/// At larger tolerances, dt·ω of a substep would come close to the limit of stability.
const LOOSEST: Real = 0.25;
/// The most substeps a user may ask for.
const MOST_FIXED: u32 = 1024;
/// The most substeps [`Substeps::PerBody`] chooses.
const MOST_PER_BODY: u32 = 256;
/// The most substeps [`Scheme::Auto`] chooses, unless the settings allow fewer.
pub(crate) const MOST_AUTO: u32 = 4096;

impl Scheme {
    /// [`Auto`](Scheme::Auto) with this tolerance, such as `1e-3`.
    #[must_use]
    pub const fn auto(tolerance: Real) -> Self {
        Scheme::Auto { tolerance }
    }

    /// [`Substep`](Scheme::Substep) with the same number of substeps for all bodies.
    #[must_use]
    pub const fn substeps(number: u32) -> Self {
        Scheme::Substep(Substeps::Fixed(number))
    }

    /// Returns an error if a parameter of the scheme is out of its range.
    pub(crate) fn validate(self) -> Result<(), BuildError> {
        let bad = |quantity, requirement, value| BuildError::Parameter {
            field: "the scheme".into(),
            quantity,
            requirement,
            value,
        };
        match self {
            Scheme::Substep(Substeps::Fixed(n)) if !(1..=MOST_FIXED).contains(&n) => {
                let count = f64::from(n);
                Err(bad("the number of substeps", "from 1 to 1024", count))
            }
            Scheme::Auto { tolerance } | Scheme::Substep(Substeps::PerBody { tolerance })
                if !(tolerance > 0.0 && tolerance <= LOOSEST) =>
            {
                let tolerance = to_f64(tolerance);
                Err(bad(
                    "the tolerance",
                    "positive, and at most 0.25",
                    tolerance,
                ))
            }
            _ => Ok(()),
        }
    }

    /// The rules by which the scheme chooses plans; `None` if it does not choose.
    pub(super) fn plan_rules(self) -> Option<PlanRules> {
        let (tolerance, most, is_fourth) = match self {
            Scheme::Auto { tolerance } => (tolerance, MOST_AUTO, true),
            Scheme::Substep(Substeps::PerBody { tolerance }) => (tolerance, MOST_PER_BODY, false),
            _ => return None,
        };
        Some(PlanRules {
            tolerance: to_f64(tolerance),
            most,
            is_fourth,
            damps: is_fourth,
        })
    }

    /// Returns true if it chooses a plan for each body.
    pub(crate) fn chooses(self) -> bool {
        self.plan_rules().is_some()
    }

    /// Returns true if bodies without a special method get half a kick before Rapier's step and half after it.
    pub(crate) fn kicks_twice(self) -> bool {
        matches!(self, Scheme::KickDriftKick) || self.plan_rules().is_some()
    }

    /// Returns true if bodies get the whole kick before Rapier's step.
    pub(crate) fn kicks_once(self) -> bool {
        matches!(
            self,
            Scheme::Kick | Scheme::LinearlyImplicit | Scheme::ExternalForce
        )
    }

    /// Returns true if bodies that Rapier's solver holds are loaded instead of kicked.
    pub(crate) fn loads(self) -> bool {
        self != Scheme::Kick
    }
}
