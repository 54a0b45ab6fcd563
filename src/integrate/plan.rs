//! Plans: the division of a step into substeps, chosen by a tolerance.

use super::rate_estimate::RateEstimate;

/// The number of evaluations of a step of fourth order.
const FORWARD_STAGES: u32 = 3;

/// The number of steps of Suzuki's composition.
pub(super) const SUZUKI_STAGES: u32 = 5;

/// From this share of the tolerance on a body is linearised, because its path need not be in the stiffest direction.
pub(super) const CAUTION: f64 = 0.25;

/// Up to this dt times the rate of drag, a body does not adapt to the flow within a step, so a change of drag along the
/// path cannot hide an equal change of another field.
const SHOWS: f64 = 0.25;

/// A plan aims at this share of the tolerance, because the next step may be a little stiffer.
const MARGIN: f64 = 0.8;

/// A plan that costs more evaluations than this is used in the next step at once, without trying a coarser one first.
const DEAR: u32 = 256;

/// Under steps of fourth order the energy of a vibration oscillates by a share of this times (h·ω)⁴, for h·ω below
/// [`FORWARD_LIMIT`]; measured.
const FORWARD_ERROR: f64 = 0.00285;
pub(super) const FORWARD_LIMIT: f64 = 1.5;

/// A change of the square of the frequency counts this many times in steps of fourth order. At 1, springs with a rest
/// length that pass near their anchor gain or lose energy between the points of their paths, where nothing shows it.
const ROUGH: f64 = 2.25;

/// A path is evenly stiff if the square of the frequency changes by at most this share of it from one piece to the
/// next.
const EVEN: f64 = 0.5;

/// Beyond this error, at h·ω = 1, the result of a plan is of no use: the motion may diverge.
pub(super) const HOPELESS: f64 = 0.25;

/// The limit of halvings of a step: beyond it, parts are shorter than the rounding of a time.
pub(super) const MOST_HALVINGS: u32 = 48;
/// The limit of the number of parts of unequal lengths in a step, including the discarded ones: a multiple of the most
/// substeps.
pub(super) const PARTS_PER_SUBSTEP: u32 = 4;

/// The division of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StepPlan {
    /// The number of equal parts; zero for parts of unequal lengths.
    pub count: u32,
    /// True if each part is a step of fourth order.
    pub forward: bool,
}

impl StepPlan {
    pub(super) const WHOLE: StepPlan = StepPlan {
        count: 1,
        forward: false,
    };

    /// The coarsest plan of second order that has a point between its ends.
    const HALVES: StepPlan = StepPlan {
        count: 2,
        forward: false,
    };

    pub(super) const FORWARD: StepPlan = StepPlan {
        count: 1,
        forward: true,
    };

    /// Parts of unequal lengths, halved where it is necessary.
    pub(super) const UNEVEN: StepPlan = StepPlan {
        count: 0,
        forward: false,
    };

    /// The number of evaluations.
    pub(super) fn cost(self) -> u32 {
        self.count * if self.forward { FORWARD_STAGES } else { 1 }
    }

    /// The longest kick, in units of the step; zero for parts of unequal lengths, which are finer than all equal ones.
    pub(super) fn length(self) -> f64 {
        if self == StepPlan::UNEVEN {
            return 0.0;
        }
        let longest = if self.forward { 2.0 / 3.0 } else { 1.0 };
        longest / f64::from(self.count)
    }
}

/// The lengths of the steps of Suzuki's composition, in units of the whole.
pub(super) fn suzuki_steps() -> [f64; SUZUKI_STAGES as usize] {
    let outer = (4.0 - 4.0_f64.cbrt()).recip();
    [outer, outer, 1.0 - 4.0 * outer, outer, outer]
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
pub(super) struct PlanRules {
    pub tolerance: f64,
    /// The largest number of substeps.
    pub most: u32,
    /// True if steps of fourth order are allowed.
    pub is_fourth: bool,
    /// True if bodies that are too stiff for all plans are damped.
    pub damps: bool,
}

impl PlanRules {
    /// The relative error of the energy of a vibration under a plan, for a body of this stiffness.
    pub(super) fn error(self, path_rate: RateEstimate, plan: StepPlan, dt: f64) -> f64 {
        let length = plan.length() * dt;
        let second = |omega2: f64| omega2 * length * length / 4.0;
        let part = dt / f64::from(plan.count);
        let swing2 = path_rate.omega2 * part * part;
        // False for NaN.
        let is_followed = swing2 <= FORWARD_LIMIT.powi(2);
        if plan.forward && is_followed {
            (FORWARD_ERROR * swing2 * swing2).max(second(ROUGH * path_rate.jump))
        } else {
            second(path_rate.omega2)
        }
    }

    /// Returns true if even the finest plan exceeds [`HOPELESS`].
    pub(super) fn is_hopeless(self, path_rate: RateEstimate, dt: f64) -> bool {
        // False for NaN.
        let hopeful = self.error(path_rate, self.plan(path_rate, dt), dt) <= HOPELESS;
        !hopeful
    }

    /// Returns true if whole steps meet the tolerance with room to spare.
    pub(super) fn is_calm(self, path_rate: RateEstimate, dt: f64) -> bool {
        self.error(path_rate, StepPlan::WHOLE, dt) <= CAUTION * self.tolerance
    }

    /// The highest rate of drag or gyration that needs no linearisation: the error that it causes is small, and the
    /// change of a wrench along the path still shows the stiffness of the fields.
    pub(super) fn quiet_rate(self, dt: f64) -> f64 {
        (24.0 * CAUTION * self.tolerance).sqrt().min(SHOWS) / dt
    }

    /// The cheapest plan that meets the tolerance for this stiffness; the finest if none does.
    pub(super) fn plan(self, path_rate: RateEstimate, dt: f64) -> StepPlan {
        let tolerance = MARGIN * self.tolerance;
        let finest = 2.0 * tolerance.sqrt();
        let swing = path_rate.omega2.sqrt() * dt;
        let plain = swing / finest;
        let smooth = (tolerance / FORWARD_ERROR).sqrt().sqrt();
        let jumps = (ROUGH * path_rate.jump).sqrt() * dt * StepPlan::FORWARD.length() / finest;
        let parts = (swing / smooth.min(FORWARD_LIMIT)).max(jumps);
        let cost = f64::from(FORWARD_STAGES) * power_of_two(parts);
        let forward = self.is_fourth && cost < power_of_two(plain);
        StepPlan {
            count: self.count(if forward { parts } else { plain }, forward),
            forward,
        }
    }

    /// The first plan to try for a body that had this stiffness before: the coarsest that yields an energy balance,
    /// unless the plan for this stiffness is expensive. The plan used then depends on the path only, and is the same on
    /// the reversed path: plans change at the same places on the way to a centre and away from it, so the errors of the
    /// energy cancel. `looked_into` if Jacobians show the stiffness, because forces read velocities.
    pub(super) fn first(self, path_rate: RateEstimate, dt: f64, looked_into: bool) -> StepPlan {
        let plan = self.plan(path_rate, dt);
        if plan.cost() > DEAR || looked_into {
            plan
        } else if self.is_fourth {
            StepPlan::FORWARD
        } else {
            StepPlan::HALVES
        }
    }

    /// A plan after one that did not meet the tolerance: at least twice as fine and at most eight times; `None` if
    /// there is no finer one. `uneven` allows parts of unequal lengths where the finest equal ones are of no use, or do
    /// not meet the tolerance of a path that is stiff for a moment only.
    pub(super) fn finer(
        self,
        path_rate: RateEstimate,
        than: StepPlan,
        dt: f64,
        uneven: bool,
    ) -> Option<StepPlan> {
        if than == StepPlan::UNEVEN {
            return None;
        }
        let wanted = self.plan(path_rate, dt);
        let length = wanted
            .length()
            .clamp(than.length() / 8.0, than.length() / 2.0);
        let count = f64::from(wanted.count) * wanted.length() / length;
        let count = self.count(count, wanted.forward);
        let finer = StepPlan { count, ..wanted };
        let is_brief = path_rate.jump > EVEN * path_rate.omega2;
        let most = if is_brief { self.tolerance } else { HOPELESS };
        let misses = self.error(path_rate, wanted, dt) > most || !path_rate.omega2.is_finite();
        // With few substeps, an even path that is sampled coarsely looks uneven.
        if self.damps && uneven && misses {
            return Some(StepPlan::UNEVEN);
        }
        (finer.length() < 0.75 * than.length()).then_some(finer)
    }

    fn count(self, wanted: f64, forward: bool) -> u32 {
        let most = if forward {
            self.most.div_ceil(2)
        } else {
            self.most
        };
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
