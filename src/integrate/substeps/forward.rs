//! Steps of fourth order without a step back in time (S. A. Chin, Phys. Lett. A 226 (1997) 344): kicks of h/6, 2h/3
//! and h/6, with drifts of h/2 between them. The second derivative of the forces that the middle kick needs is taken by
//! shifting bodies by h²/24 of their accelerations. Of the further terms that rotation brings, the commutator of
//! rotations and the change of the axes of inertia cancel each other.

use super::{Group, Run};
use crate::integrate::fault::Fault;
use crate::integrate::plan::FORWARD_LIMIT;
use crate::math::to_f64;
use crate::rigid::{ENERGY_ERROR, Lookup, Wrench, of_wrench, pair};

impl<W: Lookup> Run<'_, W> {
    /// Makes `count` equal steps. The wrenches at the start are known.
    pub(super) fn forward(&mut self, group: &mut Group, count: u32) -> Result<(), Fault> {
        let h = to_f64(self.setting.context.dt) / f64::from(count);
        self.see(group);
        for part in 0..count {
            // The last kick of a step and the first of the next are one.
            let kicks = if part == 0 { 1.0 } else { 2.0 };
            self.push_forward(group, kicks * h / 6.0)?;
            self.coast(0.5 * h);
            self.evaluate(group, false)?;
            self.see(group);
            self.evaluate_shifted(group, h)?;
            self.push_forward(group, h * 2.0 / 3.0)?;
            self.coast(0.5 * h);
            self.evaluate(group, false)?;
            self.see(group);
        }
        self.push_forward(group, h / 6.0)
    }

    /// Moves the bodies on without forces.
    fn coast(&mut self, h: f64) {
        let states = self.states.iter_mut();
        states.for_each(|state| state.coast(h, ENERGY_ERROR));
        self.elapsed += h;
    }

    /// Replaces the wrenches by those at poses that are shifted by h²/24 times the accelerations.
    fn evaluate_shifted(&mut self, group: &mut Group, h: f64) -> Result<(), Fault> {
        group.poses.clear();
        for (state, wrench) in self.states.iter_mut().zip(&group.wrenches) {
            group.poses.push((state.position, state.attitude));
            state.shift(of_wrench(*wrench), h * h / 24.0);
        }
        let outcome = self.evaluate(group, false);
        // A shifted pose may be in a stiff place that the path itself avoids, such as the centre of an attraction.
        let most = (FORWARD_LIMIT / h).powi(2);
        let shifted = self.states.iter().zip(&group.wrenches);
        for (track, (state, wrench)) in self.tracks.iter_mut().zip(shifted) {
            track.look_aside(state, *wrench, most);
        }
        if self.setting.most.is_some() {
            self.look_into(group, |track| track.is_stiff_aside);
        }
        for (state, pose) in self.states.iter_mut().zip(&group.poses) {
            (state.position, state.attitude) = *pose;
        }
        outcome
    }

    /// A kick by the wrenches and the accelerations that Rapier adds, without damping.
    fn push_forward(&mut self, group: &Group, duration: f64) -> Result<(), Fault> {
        for (state, wrench) in self.states.iter_mut().zip(&group.wrenches) {
            state.pushed |= *wrench != Wrench::ZERO;
            state.wrench = pair(&of_wrench(*wrench));
            let (force, torque) = state.wrench;
            state.kick(force * duration, torque * duration);
            state.linvel += state.acceleration * duration;
        }
        self.check_speeds(group)
    }
}
