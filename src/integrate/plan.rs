//! Plans: the division of a step into substeps, chosen by a tolerance.

use super::pace::Pace;

/// The steps that Suzuki's scheme composes.
const SUZUKI_STAGES: u32 = 5;

/// From this share of the tolerance on a body is linearised, because along its path it need not meet the stiffest
/// direction.
pub(super) const CAUTION: f64 = 0.25;

/// dt times a rate of drag up to which a body does not follow the flow within a step, so that a field that changes
/// along the path is not hidden by a drag that changes as much.
const SHOWS: f64 = 0.25;

/// A plan aims at this share of the tolerance, because the next step may be a little stiffer.
const MARGIN: f64 = 0.8;

/// A plan that costs more evaluations than this is used at the start of the next step, without trying a whole step
/// first.
const DEAR: u32 = 256;

/// The share of a vibration's energy by which it oscillates under Suzuki's composition is this times (h·ω)⁴, for h·ω
/// below [`COMPOSED_LIMIT`]; measured.
const COMPOSED_ERROR: f64 = 0.0075;
const COMPOSED_LIMIT: f64 = 1.0;

/// Beyond this error a plan shows nothing: h·ω is 1, and it may explode.
pub(super) const HOPELESS: f64 = 0.25;

/// The limit of halvings of a step: beyond it, a time is rounding.
pub(super) const MOST_HALVINGS: u32 = 48;
/// The limit of parts of a step of unequal lengths, including the discarded ones.
pub(super) const MOST_PARTS: u32 = 16384;

/// The division of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct StepPlan {
    /// The number of equal parts; zero for parts of unequal lengths.
    pub count: u32,
    /// True if each part is a composition of fourth order.
    pub composed: bool,
}

impl StepPlan {
    pub(super) const WHOLE: StepPlan = StepPlan {
        count: 1,
        composed: false,
    };

    pub(super) const COMPOSED: StepPlan = StepPlan {
        count: 1,
        composed: true,
    };

    /// Parts of unequal lengths, halved where it is necessary.
    pub(super) const UNEVEN: StepPlan = StepPlan {
        count: 0,
        composed: false,
    };

    /// The number of evaluations.
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

    /// Writes the lengths of the drifts into `ticks`, in units of the step.
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

/// The result of a step in parts that were halved.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bisection {
    /// The largest error of a part.
    pub error: f64,
    /// The square of the frequency in the last part.
    pub omega2: f64,
}

/// The rules by which a scheme chooses a plan for each body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    pub tolerance: f64,
    /// The largest number of substeps.
    pub most: u32,
    /// True if compositions of fourth order are allowed.
    pub composes: bool,
    /// True if bodies that are too stiff for all plans are damped.
    pub damps: bool,
}

impl Choice {
    /// The relative error of the energy of a vibration under a plan, for a body of this stiffness.
    pub(super) fn error(self, pace: Pace, plan: StepPlan, dt: f64) -> f64 {
        let drift = plan.length() * dt;
        if !plan.composed {
            return pace.omega2 * drift * drift / 4.0;
        }
        let part = dt / f64::from(plan.count);
        let smooth = COMPOSED_ERROR * (pace.omega2 * part * part).powi(2);
        smooth.max(pace.jump * drift * drift / 4.0)
    }

    /// Returns true if not even the finest plan is of use.
    pub(super) fn is_hopeless(self, pace: Pace, dt: f64) -> bool {
        // False for NaN.
        let hopeful = self.error(pace, self.plan(pace, dt), dt) <= HOPELESS;
        !hopeful
    }

    /// Returns true if whole steps meet the tolerance with room to spare.
    pub(super) fn is_calm(self, pace: Pace, dt: f64) -> bool {
        self.error(pace, StepPlan::WHOLE, dt) <= CAUTION * self.tolerance
    }

    /// The highest rate of drag or gyration that needs no linearisation: its own error is small, and the change of a
    /// wrench along the path still shows the stiffness of the fields.
    pub(super) fn quiet_rate(self, dt: f64) -> f64 {
        (24.0 * CAUTION * self.tolerance).sqrt().min(SHOWS) / dt
    }

    /// The cheapest plan that meets the tolerance for this stiffness; the finest if none does.
    pub(super) fn plan(self, pace: Pace, dt: f64) -> StepPlan {
        let tolerance = MARGIN * self.tolerance;
        let finest = 2.0 * tolerance.sqrt();
        let swing = pace.omega2.sqrt() * dt;
        let plain = swing / finest;
        let smooth = (tolerance / COMPOSED_ERROR).sqrt().sqrt();
        let jumps = pace.jump.sqrt() * dt * StepPlan::COMPOSED.length() / finest;
        let parts = (swing / smooth.min(COMPOSED_LIMIT)).max(jumps);
        let cost = f64::from(SUZUKI_STAGES) * power_of_two(parts);
        let composed = self.composes && cost < power_of_two(plain);
        StepPlan {
            count: self.count(if composed { parts } else { plain }, composed),
            composed,
        }
    }

    /// The first plan to try for a body that had this stiffness before. It is the whole step as long as that is cheap:
    /// the plan then depends on the path only, and is the same backwards, so plans change at the same places on the way
    /// to a centre and away from it, and the energy comes back. `looked_into` if Jacobians show the stiffness, where
    /// forces read velocities.
    pub(super) fn first(self, pace: Pace, dt: f64, looked_into: bool) -> StepPlan {
        let plan = self.plan(pace, dt);
        if plan.cost() > DEAR || looked_into {
            plan
        } else {
            StepPlan::WHOLE
        }
    }

    /// A plan after one that did not meet the tolerance: at least twice as fine and at most eight times; `None` if
    /// there is no finer one. `uneven` allows parts of unequal lengths where the finest equal ones are of no use.
    pub(super) fn finer(
        self,
        pace: Pace,
        than: StepPlan,
        dt: f64,
        uneven: bool,
    ) -> Option<StepPlan> {
        if than == StepPlan::UNEVEN {
            return None;
        }
        let wanted = self.plan(pace, dt);
        let length = wanted
            .length()
            .clamp(than.length() / 8.0, than.length() / 2.0);
        let count = f64::from(wanted.count) * wanted.length() / length;
        let count = self.count(count, wanted.composed);
        let finer = StepPlan { count, ..wanted };
        let hopeless = |plan| self.error(pace, plan, dt) > HOPELESS || !pace.omega2.is_finite();
        if uneven && hopeless(wanted) {
            return Some(StepPlan::UNEVEN);
        }
        (finer.length() < 0.75 * than.length()).then_some(finer)
    }

    fn count(self, wanted: f64, composed: bool) -> u32 {
        let most = if composed { self.most / 2 } else { self.most };
        // False for NaN.
        if wanted <= f64::from(most) {
            power_of_two(wanted) as u32
        } else {
            most
        }
    }
}

/// The next power of two, at least 1. Values larger than any plan stay as they are.
fn power_of_two(wanted: f64) -> f64 {
    if wanted < 1e6 {
        f64::from((wanted.ceil() as u32).next_power_of_two())
    } else {
        wanted
    }
}
