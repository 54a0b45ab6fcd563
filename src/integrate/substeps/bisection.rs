//! Steps that are halved until they meet the tolerance, for paths that are stiff in few places, like a close pass.

use super::{Group, Run};
use crate::integrate::fault::Fault;
use crate::integrate::plan::{Bisection, MOST_HALVINGS, PARTS_PER_SUBSTEP, PlanRules};
use crate::integrate::rate_estimate::Track;
use crate::math::to_f64;
use crate::rigid::{ENERGY_ERROR, Lookup, RigidState, Wrench};

/// The state at the start of a part, to return to.
struct PartStart {
    states: Vec<RigidState>,
    tracks: Vec<Track>,
    wrenches: Vec<Wrench>,
    elapsed: f64,
}

impl<W: Lookup> Run<'_, W> {
    /// Integrates the step in parts, each half as long as one that did not meet the tolerance.
    pub(super) fn bisect(
        &mut self,
        group: &mut Group,
        plan_rules: PlanRules,
    ) -> Result<Bisection, Fault> {
        let dt = to_f64(self.setting.context.dt);
        let mut made = Bisection::default();
        let mut left = PARTS_PER_SUBSTEP * plan_rules.most;
        // The parts to be made, the next one last, each by its number of halvings.
        let mut parts = vec![0_u32];
        self.track(group);
        while let Some(halvings) = parts.pop() {
            let saved = self.save(group);
            let h = dt * 0.5_f64.powi(halvings as i32);
            let drifted = self.half(group, h);
            let omega2 = drifted.as_ref().copied().unwrap_or(f64::INFINITY);
            let error = omega2 * h * h / 4.0;
            left = left.saturating_sub(1);
            // False for NaN.
            let does = error <= plan_rules.tolerance;
            if !does && halvings < MOST_HALVINGS && left > 0 {
                self.back(group, saved);
                parts.extend([halvings + 1; 2]);
                continue;
            }
            drifted?;
            self.push(group, 0.5 * h)?;
            made.error = made.error.max(error);
            made.omega2 = omega2;
        }
        Ok(made)
    }

    /// Makes half a kick and the drift. Returns the square of the highest frequency that they show.
    fn half(&mut self, group: &mut Group, h: f64) -> Result<f64, Fault> {
        self.push(group, 0.5 * h)?;
        let states = self.states.iter_mut();
        states.for_each(|state| state.drift(h, ENERGY_ERROR));
        self.elapsed += h;
        self.evaluate(group, false)?;
        Ok(self.track(group))
    }

    fn save(&self, group: &Group) -> PartStart {
        PartStart {
            states: self.states.to_vec(),
            tracks: self.tracks.to_vec(),
            wrenches: group.wrenches.clone(),
            elapsed: self.elapsed,
        }
    }

    fn back(&mut self, group: &mut Group, saved: PartStart) {
        self.states.clone_from_slice(&saved.states);
        self.tracks.clone_from_slice(&saved.tracks);
        group.wrenches = saved.wrenches;
        self.elapsed = saved.elapsed;
    }
}
