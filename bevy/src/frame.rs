//! The steps that Rapier makes in one frame of the app.

use bevy_rapier3d::prelude::TimestepMode;

/// The steps of one frame: `rounds` times `substeps` steps of `dt`, as the system of `bevy_rapier3d` makes them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrameSteps {
    pub dt: f32,
    pub substeps: usize,
    /// 1, except in the mode `Interpolated`, where physics catches up with the time of the app.
    pub rounds: usize,
    /// The time step that the context shows between frames.
    pub shown_dt: f32,
}

impl FrameSteps {
    /// The steps of a frame that took `elapsed` seconds. Updates `behind`, the lag of physics in seconds.
    pub fn new(mode: TimestepMode, elapsed: f32, behind: &mut f32) -> Self {
        let (shown_dt, whole, substeps, rounds) = match mode {
            TimestepMode::Fixed { dt, substeps } => (dt, dt, substeps, 1),
            TimestepMode::Variable {
                max_dt,
                time_scale,
                substeps,
            } => {
                let dt = (elapsed * time_scale).min(max_dt);
                (dt, dt, substeps, 1)
            }
            TimestepMode::Interpolated {
                dt,
                time_scale,
                substeps,
            } => {
                *behind += elapsed;
                let mut rounds = 0;
                // With a `dt` that is not positive, or lost in rounding, the loop would not end.
                while *behind > 0.0 && *behind - dt < *behind {
                    *behind -= dt;
                    rounds += 1;
                }
                (dt, dt * time_scale, substeps, rounds)
            }
        };
        let dt = match mode {
            // In the order of `bevy_rapier3d`, for the same bits.
            TimestepMode::Interpolated { dt, time_scale, .. } => dt / substeps as f32 * time_scale,
            _ => whole / substeps as f32,
        };
        FrameSteps {
            dt,
            substeps: if dt > 0.0 { substeps } else { 0 },
            rounds,
            shown_dt,
        }
    }

    /// Returns true if Rapier makes no step.
    pub fn is_empty(&self) -> bool {
        self.rounds == 0 || self.substeps == 0
    }
}
