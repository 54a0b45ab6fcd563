//! The energy that bodies gain or lose where forces change abruptly within a step.
//!
//! Where a force jumps or bends between two evaluations, at the border of a region or near the anchor of a spring with a
//! rest length, the kinetic energy changes by more or less than the work of the force. The work along the way is
//! evaluated at more points there, and the errors of each body are added up: a body that comes by once has one error,
//! one that swings to and fro collects them.

use super::Scheme;
use super::stiffness::StepWarning;
use crate::math::{Real, RigidBodyHandle, from_f64, to_f64};
use crate::rapier::dynamics::RigidBodyActivation;
use crate::rigid::{Lookup, Wrench, find_by, is_in_order};

/// At most this number of bodies are followed at once.
const MOST: usize = 16;

/// A body is followed from a change of its force on that can change its kinetic energy by this share.
pub(super) const FOLLOWED_FROM: f64 = 0.02;

/// The share of it from which on a change of force counts that the body has not shown in the step before.
const ABRUPT: f64 = 0.5;

/// A change of force that can change the kinetic energy by this share is looked at in each step: a body that passes a
/// border in each of them shows the same change again and again.
const ANYHOW: f64 = 1.0;

/// The share of the kinetic energy from which on an error counts as one more crossing.
const CROSSES: f64 = 0.005;

/// The number of crossings from which on schemes without a tolerance warn.
const OFTEN: u32 = 3;

/// The share of the kinetic energy from which on they do so.
const BAD: f64 = 0.05;

/// A body may be replaced by another one after this number of steps without a crossing.
const LONG: u64 = 64;

/// After this number of steps without a crossing, the errors of a body and the scale of its energy are forgotten.
const FORGOTTEN: u64 = 256;

/// The bodies on which forces have changed abruptly, in the order of their handles.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Edges {
    /// The number of the present step, and its length.
    step: u64,
    dt: f64,
    /// Bodies are followed from a force on that can change their kinetic energy by this share.
    share: f64,
    accounts: Vec<Account>,
}

/// The energy of a body that is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
struct Account {
    body: RigidBodyHandle,
    /// The last step in which its force changed much, and the square of the frequency that this showed.
    last: u64,
    omega2: f64,
    /// The largest kinetic energy of the body so far.
    scale: f64,
    /// The energy that it has gained in excess of the work of the fields.
    gained: f64,
    crossings: u32,
    /// The step of the last crossing; at first, that in which the body was found.
    crossed: u64,
    /// The square of the force at the end of the last step over the mass, where steps begin and end with half a kick.
    pull: f64,
}

impl Account {
    fn new(body: RigidBodyHandle, step: u64) -> Self {
        Account {
            body,
            last: 0,
            omega2: 0.0,
            scale: 0.0,
            gained: 0.0,
            crossings: 0,
            crossed: step,
            pull: 0.0,
        }
    }

    /// Returns true if another body may take its place.
    fn is_old(&self, step: u64) -> bool {
        step >= self.crossed.saturating_add(LONG)
    }

    fn add(&mut self, gained: f64, step: u64) {
        if gained.is_finite() {
            self.gained += gained;
        }
        if gained.abs() > CROSSES * self.scale {
            self.crossings = self.crossings.saturating_add(1);
            self.crossed = step;
        }
    }
}

/// The change of the force on a body in a step.
#[derive(Clone, Copy)]
pub(crate) struct ForceChange {
    pub body: RigidBodyHandle,
    /// The change of the force times the length of the way; with that of the torque times the angle.
    pub swing: f64,
    pub kinetic: f64,
    /// The square of the force, at the end where it is the larger.
    pub force2: f64,
    pub mass: f64,
    pub dt: f64,
}

impl Edges {
    /// Begins the step of this number and length.
    ///
    /// Equal steps of kick-drift-kick keep, for linear forces, the energy less dt²F²/8m. If their length changes, the
    /// energy of the next steps is another one.
    pub(crate) fn begin(&mut self, step: u64, dt: Real, scheme: Scheme) {
        let (last, dt) = (self.dt, to_f64(dt));
        (self.step, self.dt) = (step, dt);
        let tolerance = scheme.plan_rules().map(|plan_rules| plan_rules.tolerance);
        self.share = tolerance.map_or(FOLLOWED_FROM, |it| it.min(FOLLOWED_FROM));
        if dt != last {
            for account in &mut self.accounts {
                account.add(account.pull * (last * last - dt * dt) / 8.0, step);
            }
        }
    }

    /// The (dt·ω)⁴ from which on the force on a body has changed so much that it is followed.
    pub(crate) fn followed_from(&self) -> Real {
        from_f64(self.share * self.share)
    }

    /// Returns true if a body is followed, or may be.
    pub(crate) fn has_room_for(&self, body: RigidBodyHandle) -> bool {
        self.accounts.len() < MOST
            || self.accounts.iter().any(|it| it.body == body)
            || self.accounts.iter().any(|it| it.is_old(self.step))
    }

    /// Follows a body on which the force has changed much. Returns `Some` if it may have changed abruptly: an error
    /// beyond this energy is to be [added](Self::add).
    pub(crate) fn look(&mut self, change: &ForceChange) -> Option<f64> {
        let whole = 2.0 * change.kinetic;
        // False for NaN.
        let is_large = change.swing > self.share * whole;
        let place = is_large.then(|| self.place_for(change.body))??;
        let (step, account) = (self.step, &mut self.accounts[place]);
        if account.last == step {
            return None;
        }
        if step > account.crossed.saturating_add(FORGOTTEN) {
            *account = Account {
                last: account.last,
                omega2: account.omega2,
                ..Account::new(change.body, step)
            };
        }
        let omega2 = change.swing / (whole * change.dt * change.dt);
        let known = if account.last.saturating_add(1) == step {
            account.omega2
        } else {
            // It was less than would have been followed.
            self.share / (change.dt * change.dt)
        };
        let resting = to_f64(RigidBodyActivation::default_normalized_linear_threshold());
        let slow = 0.5 * change.mass * resting * resting;
        (account.last, account.omega2) = (step, omega2);
        // If it swings with this frequency, its kinetic energy will be the sum of that and of the potential now.
        let potential = 0.5 * change.force2 / (change.mass * omega2);
        account.scale = account.scale.max(change.kinetic + potential).max(slow);
        let least = ABRUPT * self.share * account.scale;
        let new = (omega2 - known).abs() * (change.dt * change.dt * whole);
        (new > least || change.swing > ANYHOW * whole).then_some(least)
    }

    /// The place of the account of a body, which is new if there is room for it.
    fn place_for(&mut self, body: RigidBodyHandle) -> Option<usize> {
        if let Some(place) = find_by(&self.accounts, body, |it| it.body) {
            return Some(place);
        }
        let index = |it: RigidBodyHandle| it.into_raw_parts().0;
        // Another body may have had the same index.
        self.accounts.retain(|it| index(it.body) != index(body));
        if self.accounts.len() >= MOST {
            let accounts = self.accounts.iter().enumerate();
            let (oldest, account) = accounts.min_by_key(|it| it.1.crossed)?;
            if !account.is_old(self.step) {
                return None;
            }
            self.accounts.remove(oldest);
        }
        let place = self
            .accounts
            .partition_point(|it| index(it.body) < index(body));
        self.accounts.insert(place, Account::new(body, self.step));
        Some(place)
    }

    /// Adds the energy that a body has gained in the step, in excess of the work on it.
    pub(crate) fn add(&mut self, body: RigidBodyHandle, gained: f64) {
        if let Some(place) = find_by(&self.accounts, body, |it| it.body) {
            self.accounts[place].add(gained, self.step);
        }
    }

    /// Looks at the bodies after the step. `felt` has the wrench on a body, if half a kick by it begins the next step.
    pub(crate) fn see(
        &mut self,
        world: &impl Lookup,
        felt: impl Fn(RigidBodyHandle) -> Option<Wrench>,
    ) {
        self.accounts.retain_mut(|account| {
            let Some(body) = world.body(account.body) else {
                return false;
            };
            account.scale = account.scale.max(to_f64(body.kinetic_energy()));
            let damps = body.linear_damping() != 0.0 || body.angular_damping() != 0.0;
            let force = felt(account.body).filter(|_| !damps);
            account.pull = force.map_or(0.0, |it| {
                to_f64(it.force.length_squared()) / to_f64(body.mass())
            });
            account.scale > 0.0 && account.scale.is_finite() && account.pull.is_finite()
        });
    }

    /// Warns of the bodies whose errors have become too large, and returns the largest error under a scheme with a
    /// tolerance.
    pub(crate) fn report(&mut self, scheme: Scheme, warnings: &mut Vec<StepWarning>) -> f64 {
        let plan_rules = scheme.plan_rules();
        let mut worst = 0.0_f64;
        for account in &mut self.accounts {
            let (body, error) = (account.body, account.gained.abs() / account.scale);
            let warning = match plan_rules {
                Some(plan_rules) if error > plan_rules.tolerance => {
                    worst = worst.max(error);
                    StepWarning::missed(plan_rules, body, error)
                }
                None if error > BAD && account.crossings >= OFTEN => StepWarning::AbruptForce {
                    body,
                    error: from_f64(error),
                },
                _ => continue,
            };
            warnings.push(warning);
            account.gained = 0.0;
        }
        worst
    }

    /// Returns false if no step can have left these values, which may be the case if they were deserialized.
    pub(crate) fn is_sound(&self) -> bool {
        let sound = |it: &Account| {
            it.omega2 >= 0.0
                && it.scale > 0.0
                && it.scale.is_finite()
                && it.gained.is_finite()
                && it.pull.is_finite()
        };
        self.accounts.len() <= MOST
            && is_in_order(&self.accounts, |it| it.body)
            && self.accounts.iter().all(sound)
    }
}
