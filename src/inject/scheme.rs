//! How wrenches become motion.

use crate::math::Real;

/// How the wrench of the fields becomes motion in a Rapier step.
///
/// | scheme | order | force that depends on position |
/// |---|---|---|
/// | [`KickDriftKick`](Scheme::KickDriftKick) | 2 | symplectic: energy bounded while dt·ω < 2 |
/// | [`Kick`](Scheme::Kick) | 1 | symplectic: energy bounded while dt·ω < 2 |
/// | [`ExternalForce`](Scheme::ExternalForce) | 1 | gains energy at any dt·ω with Rapier's default of 4 solver iterations |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Scheme {
    /// Half the impulse before Rapier's step, half of the next one after it (velocity Verlet).
    /// One evaluation per step: the second half is the next step's first, unless something moved
    /// in between. Free rotation is split off and done by the layer (see
    /// [`Fields`](crate::Fields)).
    #[default]
    KickDriftKick,
    /// The whole impulse before Rapier's step (symplectic Euler).
    Kick,
    /// `add_force` and `add_torque` before Rapier's step; after it the user's own forces are put
    /// back bit for bit. The documented channel of Rapier, which multibody links need: they
    /// ignore impulses.
    ExternalForce,
}

/// When fields wake sleeping bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum WakePolicy {
    /// Never: sleeping bodies are not even sampled.
    Never,
    /// When the wrench on a sleeping body has changed, since it fell asleep or was first seen
    /// asleep, by more than this fraction of the larger of the two.
    OnChange {
        /// The fraction.
        fraction: Real,
    },
    /// Whenever the wrench is not zero: bodies in fields never sleep.
    Always,
}

impl Default for WakePolicy {
    fn default() -> Self {
        WakePolicy::OnChange { fraction: 1e-3 }
    }
}
