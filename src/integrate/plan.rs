//! How finely a body is moved within a step, chosen by a tolerance.

use super::pace::Pace;

/// The steps that Suzuki's scheme composes.
const SUZUKI_STAGES: u32 = 5;

/// A body is looked into at this share of the error that would change what is done with it: along its
/// way it need not meet the stiffest direction.
pub(super) const CAUTION: f64 = 0.25;

/// dt times a rate of drag up to which a body does not follow it within a step: a field that changes along
/// the way is not made up for by a drag that changes as much.
const SHOWS: f64 = 0.25;

/// A plan aims at this share of the tolerance: the next step is a little stiffer as often as not.
const MARGIN: f64 = 0.8;

/// A plan that costs more evaluations is taken up from step to step.
const DEAR: u32 = 256;

/// The part of the energy of a vibration by which that swings under Suzuki's composition is this times
/// (h·ω)⁴, as long as h·ω is less than [`COMPOSED_LIMIT`]; measured.
const COMPOSED_ERROR: f64 = 0.0075;
const COMPOSED_LIMIT: f64 = 1.0;

/// Beyond this error a plan has told nothing: h·ω is 1, and it may explode.
pub(super) const HOPELESS: f64 = 0.25;

/// A step is halved at most so often: beyond, a time is no more than rounding.
pub(super) const MOST_HALVINGS: u32 = 48;
/// Of all lengths, with those that did not do.
pub(super) const MOST_PARTS: u32 = 16384;

/// How a step is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Plan {
    /// Into so many equal parts; into parts of all lengths if zero.
    pub count: u32,
    /// Whether each of them is a composition of fourth order.
    pub composed: bool,
}

impl Plan {
    pub(super) const WHOLE: Plan = Plan {
        count: 1,
        composed: false,
    };

    pub(super) const COMPOSED: Plan = Plan {
        count: 1,
        composed: true,
    };

    /// Into parts that are halved where it takes that.
    pub(super) const UNEVEN: Plan = Plan {
        count: 0,
        composed: false,
    };

    /// Evaluations.
    pub(super) fn cost(self) -> u32 {
        self.count * if self.composed { SUZUKI_STAGES } else { 1 }
    }

    /// The longest drift, in units of the step.
    pub(super) fn length(self) -> f64 {
        let longest = if self.composed {
            1.0 - 4.0 * outer()
        } else {
            1.0
        };
        longest.abs() / f64::from(self.count)
    }

    /// Puts the drifts into `ticks`, in units of the step.
    pub(super) fn divide(self, ticks: &mut Vec<f64>) {
        ticks.clear();
        let part = f64::from(self.count).recip();
        for _ in 0..self.count {
            if self.composed {
                let (outer, inner) = (outer() * part, (1.0 - 4.0 * outer()) * part);
                ticks.extend([outer, outer, inner, outer, outer]);
            } else {
                ticks.push(part);
            }
        }
    }
}

fn outer() -> f64 {
    (4.0 - 4.0_f64.cbrt()).recip()
}

/// What came of parts that were halved.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bisection {
    /// The largest error of a part.
    pub error: f64,
    /// The last of the squares of frequencies.
    pub omega2: f64,
}

/// How a scheme chooses for each body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    pub tolerance: f64,
    /// Substeps.
    pub most: u32,
    /// Whether it may take a composition of fourth order.
    pub composes: bool,
    /// Whether what is beyond all plans is damped.
    pub damps: bool,
}

impl Choice {
    /// The relative error of the energy of a vibration that a body of such a pace is moved with.
    pub(super) fn error(self, pace: Pace, plan: Plan, dt: f64) -> f64 {
        let drift = plan.length() * dt;
        if !plan.composed {
            return pace.omega2 * drift * drift / 4.0;
        }
        let part = dt / f64::from(plan.count);
        let smooth = COMPOSED_ERROR * (pace.omega2 * part * part).powi(2);
        smooth.max(pace.jump * drift * drift / 4.0)
    }

    /// Whether not even the finest plan tells anything.
    pub(super) fn is_hopeless(self, pace: Pace, dt: f64) -> bool {
        // Not so for NaN.
        let hopeful = self.error(pace, self.plan(pace, dt), dt) <= HOPELESS;
        !hopeful
    }

    /// Whether whole steps do, with room to spare.
    pub(super) fn is_calm(self, pace: Pace, dt: f64) -> bool {
        self.error(pace, Plan::WHOLE, dt) <= CAUTION * self.tolerance
    }

    /// The fastest rate, of drag or gyration, that is no reason to look into a body: it is off by little
    /// itself, and how a wrench changes along the way still shows how stiff the fields are.
    pub(super) fn quiet_rate(self, dt: f64) -> f64 {
        (24.0 * CAUTION * self.tolerance).sqrt().min(SHOWS) / dt
    }

    /// The cheapest that meets the tolerance at such a pace; the finest if none does.
    pub(super) fn plan(self, pace: Pace, dt: f64) -> Plan {
        let tolerance = MARGIN * self.tolerance;
        let finest = 2.0 * tolerance.sqrt();
        let swing = pace.omega2.sqrt() * dt;
        let plain = swing / finest;
        let smooth = (tolerance / COMPOSED_ERROR).sqrt().sqrt();
        let jumps = pace.jump.sqrt() * dt * Plan::COMPOSED.length() / finest;
        let parts = (swing / smooth.min(COMPOSED_LIMIT)).max(jumps);
        let cost = f64::from(SUZUKI_STAGES) * power_of_two(parts);
        let composed = self.composes && cost < power_of_two(plain);
        Plan {
            count: self.count(if composed { parts } else { plain }, composed),
            composed,
        }
    }

    /// What is tried first for a body that had such a pace before. A whole step, as long as that costs
    /// little: what is made of it is then a matter of the way alone, and the same backwards. On the way to
    /// a centre and away from it plans change at the same places, and the energy comes back.
    /// `looked_into`: whether Jacobians tell that, where forces read velocities.
    pub(super) fn first(self, pace: Pace, dt: f64, looked_into: bool) -> Plan {
        let plan = self.plan(pace, dt);
        if plan.cost() > DEAR || looked_into {
            plan
        } else {
            Plan::WHOLE
        }
    }

    /// A plan after one that did not do: at least twice as fine, at most eight times; `None` if there
    /// is no finer one. `uneven`: whether parts of all lengths may be tried, where the finest equal ones
    /// tell nothing.
    pub(super) fn finer(self, pace: Pace, than: Plan, dt: f64, uneven: bool) -> Option<Plan> {
        if than == Plan::UNEVEN {
            return None;
        }
        let wanted = self.plan(pace, dt);
        let length = wanted
            .length()
            .clamp(than.length() / 8.0, than.length() / 2.0);
        let count = f64::from(wanted.count) * wanted.length() / length;
        let count = self.count(count, wanted.composed);
        let finer = Plan { count, ..wanted };
        let hopeless = |plan| self.error(pace, plan, dt) > HOPELESS || !pace.omega2.is_finite();
        if uneven && hopeless(wanted) {
            return Some(Plan::UNEVEN);
        }
        (finer.length() < 0.75 * than.length()).then_some(finer)
    }

    fn count(self, wanted: f64, composed: bool) -> u32 {
        let most = if composed { self.most / 2 } else { self.most };
        // Not so for NaN.
        if wanted <= f64::from(most) {
            power_of_two(wanted) as u32
        } else {
            most
        }
    }
}

/// The next one; at least 1. What is larger than any plan stays as it is.
fn power_of_two(wanted: f64) -> f64 {
    if wanted < 1e6 {
        f64::from((wanted.ceil() as u32).next_power_of_two())
    } else {
        wanted
    }
}
