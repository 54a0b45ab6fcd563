//! Who may not fall asleep: Rapier lets sleep what is slow, but under a force that nothing balances a
//! body is only about to move.

use super::constrained::Constraints;
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::rapier::dynamics::IntegrationParameters;
use crate::rapier::geometry::ContactPair;
use crate::rigid::{Body, Wrench, find_by};

/// What is not told from balance, in both precisions: `f64` would have bodies settle for minutes.
const RESOLUTION: Real = f32::EPSILON as Real;

/// Forces balance if no more than this part of them is left: what rounding leaves.
const ROUNDING: Real = 64.0 * RESOLUTION;

/// A body that is held moves if it is accelerated at this part of what contacts leave it if nothing
/// rubs. A ball that rolls is so at five sevenths, and may rest.
const YIELDS: Real = 0.9;

/// The velocities of held bodies when they became slow enough to fall asleep, in the order of their
/// handles.
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) struct Drowsing(Vec<(RigidBodyHandle, Vector)>);

impl Drowsing {
    fn of(&self, body: RigidBodyHandle) -> Option<Vector> {
        let place = find_by(&self.0, body, |(known, _)| *known)?;
        Some(self.0[place].1)
    }

    /// Whether what was read from elsewhere is of one piece.
    pub(crate) fn is_sound(&self) -> bool {
        let index = |(handle, _): &(RigidBodyHandle, Vector)| handle.into_raw_parts().0;
        let sorted = self.0.is_sorted_by(|a, b| index(a) < index(b));
        sorted && self.0.iter().all(|(_, linvel)| linvel.is_finite())
    }
}

/// What decides who may sleep.
#[derive(Clone, Copy)]
pub(crate) struct Balance<'a> {
    pub constraints: Constraints<'a>,
    pub gravity: Vector,
    pub parameters: &'a IntegrationParameters,
    /// As of the last step.
    pub drowsing: &'a Drowsing,
}

impl Balance<'_> {
    /// Whether a body that is about to fall asleep under a wrench is to stay awake. Bodies come in the
    /// order of their handles; `drowsing` is that of this step.
    pub(crate) fn keeps_awake(&self, body: &Body, wrench: Wrench, drowsing: &mut Drowsing) -> bool {
        if body.drowsy <= 0.0 || wrench == Wrench::ZERO || body.sleeping {
            return false;
        }
        let own = self.gravity * (body.gravity_scale * body.mass) + body.user_force;
        let acceleration = (wrench.force + own) * body.inv_mass;
        let size = (wrench.force.length() + own.length()) * body.inv_mass.max_element();
        // What would not move it by a rounding while it falls asleep.
        let place = body.pose.translation.length() + self.parameters.length_unit;
        let least = RESOLUTION * place / (body.drowsy * body.drowsy);
        let least = least.max(ROUNDING * size);
        if self.constraints.join(body.handle) {
            return false;
        }
        if self.constraints.pushing(body.handle).next().is_none() {
            let turning = (body.inv_inertia * wrench.torque).length() * radius(body);
            return acceleration.length().max(turning) > least;
        }
        let known = self.drowsing.of(body.handle);
        let known = known.filter(|_| body.drowsy > 1.5 * self.parameters.dt);
        let began = known.unwrap_or(body.linvel);
        drowsing.0.push((body.handle, began));
        if body.drowsy < 0.5 * body.patience {
            return false;
        }
        let left = self.unresisted(body.handle, acceleration);
        let gained = (body.linvel - began).dot(left);
        left.length() > least && gained > YIELDS * left.length_squared() * body.drowsy
    }

    /// What contacts leave of an acceleration, if nothing rubs.
    fn unresisted(&self, handle: RigidBodyHandle, acceleration: Vector) -> Vector {
        let mut left = acceleration;
        // What one contact turns away the next may turn back.
        for _ in 0..4 {
            for (pair, first) in self.constraints.pushing(handle) {
                for away in pushes(pair, first) {
                    left -= away * left.dot(away).min(0.0);
                }
            }
        }
        left
    }
}

/// The directions in which the contacts of a pair push its first side, or its second.
fn pushes(pair: &ContactPair, first: bool) -> impl Iterator<Item = Vector> + '_ {
    let manifolds = pair.manifolds().iter();
    let active = manifolds.filter(|manifold| !manifold.data.solver_contacts.is_empty());
    active.map(move |manifold| manifold.data.normal * if first { -1.0 } else { 1.0 })
}

/// The radius of gyration about the axis that turns most easily.
fn radius(body: &Body) -> Real {
    let easiest = body.inv_principal_inertia.max_element();
    match easiest > 0.0 {
        true => (body.inv_mass.max_element() / easiest).sqrt(),
        false => 0.0,
    }
}
