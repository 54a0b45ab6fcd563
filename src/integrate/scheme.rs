//! How wrenches become motion.

use super::plan::Choice;
use crate::field::BuildError;
use crate::math::{Real, to_f64};

/// How the wrench of the fields becomes motion in a Rapier step.
///
/// ω is the fastest frequency of a body in the fields, from the Jacobian of its wrench; see
/// [`Fields::stiffness`](crate::Fields::stiffness).
///
/// | scheme | order | evaluations per step | force that depends on position |
/// |---|---|---|---|
/// | [`KickDriftKick`](Scheme::KickDriftKick) | 2 | 1 | symplectic: energy bounded while dt·ω < 2 |
/// | [`Kick`](Scheme::Kick) | 1 | 1 | symplectic: energy bounded while dt·ω < 2 |
/// | [`Substep`](Scheme::Substep) | 2 | 1 + n | symplectic: energy bounded while dt·ω < 2 n |
/// | [`Suzuki4`](Scheme::Suzuki4) | 4 | 6 | symplectic, for fields that are smooth |
/// | [`LinearlyImplicit`](Scheme::LinearlyImplicit) | 1 | 1 and Jacobians | damped: in a well that stands still energy falls at any dt·ω |
/// | [`Auto`](Scheme::Auto) | 2 or 4 | 1, more where stiff | as fine as its tolerance asks for, body by body |
/// | [`ExternalForce`](Scheme::ExternalForce) | 1 | 1 | gains energy at any dt·ω with Rapier's default of 4 solver iterations |
///
/// Contacts, joints, gravity, damping, locked axes, dominance and continuous collision detection
/// stay Rapier's under every scheme. `Substep`, `Suzuki4` and `Auto` work out the motion in the
/// fields alone in smaller steps, give the body the mean velocity of that motion before Rapier's
/// step, and the velocity at its end, plus what Rapier changed meanwhile, after it.
///
/// What Rapier's solver holds, by contacts or joints, is loaded as by gravity (except under `Kick`
/// and `ExternalForce`): the force is spread over the iterations of Rapier's step, so that what
/// friction holds stays where it is, and what rests is shown at rest. Such a velocity is behind that
/// of `KickDriftKick` by half an iteration of the force; the map is the same.
///
/// The kicks of a free body in fields hold Rapier's gravity, the user's force and Rapier's damping,
/// too, as far as the scheme is not one to compare with (`Kick`, `ExternalForce`,
/// `LinearlyImplicit`): then the order holds with all of them on. Where no field acts on a body, it
/// is Rapier's; but the free rotation of bodies of unequal inertia is this crate's, whether a field reaches
/// them or not, wherever any field can turn bodies (see [`Fields`](crate::Fields)): a world of balls, or of bodies that
/// do not spin, is Rapier's bit for bit.
///
/// Forces that read velocities: kicks follow their linear part exactly (with gravity and damping), so
/// that a drag of any strength stops a body without turning it back, what falls reaches its terminal
/// velocity, and a magnetic force turns a velocity without changing its length. `Suzuki4` needs
/// the implicit midpoint rule instead; in a step in which drag or damping stops any body (its rate
/// times dt is more than 1) it makes five equal steps of second order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Scheme {
    /// Half the impulse before Rapier's step, half of the next one after it (velocity Verlet).
    /// One evaluation per step: the second half is the next step's first, unless something moved
    /// in between. Free rotation is split off and done by this crate (see
    /// [`Fields`](crate::Fields)).
    #[default]
    KickDriftKick,
    /// The whole impulse before Rapier's step (symplectic Euler).
    Kick,
    /// `add_force` and `add_torque` before Rapier's step; after it the user's own forces are put
    /// back bit for bit. The documented channel of Rapier. Links of multibodies, which ignore
    /// impulses, are moved this way under every scheme.
    ExternalForce,
    /// Kick-drift-kick in steps smaller than Rapier's.
    Substep(Substeps),
    /// Linearly implicit (Rosenbrock) Euler, body by body:
    /// (M − dt ∂F/∂v − dt² ∂F/∂x) Δv = dt (F + dt ∂F/∂x v). Stable at any step; damps what it
    /// cannot follow. Of ∂F/∂x only the part that draws back is used, so that no direction in
    /// which a field pushes away is amplified; the order stays one with any such matrix.
    ///
    /// Each body is solved for as if what carries the fields stood still: bodies that act on each other
    /// may gain energy, and what passes close to a centre that attracts is thrown out at a coarse step.
    /// [`StepWarning::Stiff`](crate::StepWarning::Stiff) tells before; [`Auto`](Scheme::Auto) is for those.
    LinearlyImplicit,
    /// Suzuki's composition of five kick-drift-kick steps (M. Suzuki, Phys. Lett. A 146 (1990)
    /// 319). All bodies pass through its stages together, so that fields of bodies on bodies are
    /// of fourth order too. One of the five goes back in time: not for fields with jumps, nor
    /// for stiff drag.
    Suzuki4,
    /// For each body the cheapest of `KickDriftKick`, `Substep` and compositions as that of `Suzuki4` that
    /// meets the tolerance; in parts of all lengths where it is hard to follow for a moment only, like a
    /// close pass.
    ///
    /// Bodies are watched by how their wrench changes along their way, which costs next to
    /// nothing; Jacobians are worked out only of those that are new, that looked stiff, or whose
    /// velocities were changed by hand. What was moved too coarsely is moved again, more finely, before
    /// Rapier sees any of it. A body that came upon something stiff in a step for which it was not
    /// expected is put where it would have come, after Rapier's step, if nothing else touched it.
    /// Otherwise, and where not even the finest does,
    /// [`StepWarning::ToleranceMissed`](crate::StepWarning::ToleranceMissed) tells so in that step; such a
    /// body alone in a stiff well is damped, as by `LinearlyImplicit`.
    ///
    /// If fields hang on bodies that move, all bodies are moved alike as soon as one of them needs it:
    /// so those that react keep their momentum.
    Auto {
        /// Bound of the relative error of the energy of a vibration, (dt·ω)²/4 for
        /// `KickDriftKick`; and of the rate of a decay or a gyration, (dt·γ)²/24. Positive, at
        /// most 0.25.
        tolerance: Real,
    },
}

/// How many substeps [`Scheme::Substep`] makes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Substeps {
    /// So many for every body, from 1 to 1024.
    Fixed(u32),
    /// For each body a power of two, up to 256, from its stiffness; see [`Scheme::Auto`].
    PerBody {
        /// As that of [`Scheme::Auto`].
        tolerance: Real,
    },
}

/// Beyond this tolerance dt·ω of a substep would come close to the limit of stability.
const LOOSEST: Real = 0.25;
/// The most substeps a user may ask for.
const MOST_FIXED: u32 = 1024;
/// The most substeps [`Substeps::PerBody`] chooses.
const MOST_PER_BODY: u32 = 256;
/// The most substeps [`Scheme::Auto`] chooses.
const MOST_AUTO: u32 = 4096;

impl Scheme {
    /// Whether the numbers of the scheme are in their range.
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

    /// How the scheme chooses, if it chooses.
    pub(super) fn choice(self) -> Option<Choice> {
        let (tolerance, most, composes) = match self {
            Scheme::Auto { tolerance } => (tolerance, MOST_AUTO, true),
            Scheme::Substep(Substeps::PerBody { tolerance }) => (tolerance, MOST_PER_BODY, false),
            _ => return None,
        };
        Some(Choice {
            tolerance: to_f64(tolerance),
            most,
            composes,
            damps: composes,
        })
    }

    /// Whether it chooses for each body.
    pub(crate) fn chooses(self) -> bool {
        self.choice().is_some()
    }

    /// Whether bodies that nothing else is done to get half a kick before and half after.
    pub(crate) fn kicks_twice(self) -> bool {
        matches!(self, Scheme::KickDriftKick) || self.choice().is_some()
    }

    /// Whether bodies get the whole of a kick before Rapier's step.
    pub(crate) fn kicks_once(self) -> bool {
        matches!(
            self,
            Scheme::Kick | Scheme::LinearlyImplicit | Scheme::ExternalForce
        )
    }

    /// Whether what Rapier's solver holds is loaded, not kicked.
    pub(crate) fn loads(self) -> bool {
        self != Scheme::Kick
    }
}
