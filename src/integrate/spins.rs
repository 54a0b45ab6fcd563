//! Bodies that turn freely over a step: their rotations are computed several at a time.

use super::motion::{Motions, SteadyTurn, TurnAfter, VelocityUpdate};
use crate::math::{DVec3, Real, Vector};
use crate::number::LANES;
use crate::rigid::{Body, FreeTop};

/// The step over which bodies turn.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SpinRules {
    pub dt: Real,
    /// Solver iterations of Rapier's step.
    pub iterations: u32,
    /// True if bodies are included whose rotation Rapier computes exactly.
    pub balls_too: bool,
}

/// Bodies whose rotations are not computed yet.
#[derive(Debug, Default)]
pub(crate) struct Spins {
    rules: SpinRules,
    tops: Vec<FreeTop>,
    places: Vec<SpinPlace>,
}

/// The place of a rotation among the motions of a step.
#[derive(Clone, Copy, Debug)]
struct SpinPlace {
    turn: usize,
    /// The velocities to give to Rapier; the angular one is not yet set.
    update: VelocityUpdate,
    /// The index of `update` in [`Motions::updates`].
    index: usize,
}

impl Spins {
    pub(crate) fn begin(&mut self, rules: SpinRules) {
        self.rules = rules;
        self.tops.clear();
        self.places.clear();
    }

    /// Returns true if this crate is to turn a body that starts with these velocities.
    #[inline]
    pub(crate) fn includes(&self, body: &Body, update: &VelocityUpdate) -> bool {
        self.rules.dt > 0.0 && body.free_top(update.angvel, self.rules.balls_too).is_some()
    }

    /// Adds new velocities of a body to the motions, and its free rotation if this crate is to turn it. `twist` is the
    /// angular impulse that is part of the velocities. [`Self::compute`] completes them.
    pub(crate) fn push(
        &mut self,
        motions: &mut Motions,
        body: &Body,
        update: VelocityUpdate,
        twist: DVec3,
    ) {
        motions.updates.push(update);
        if self.includes(body, &update) {
            self.add(motions, body, update, twist);
        }
        if self.tops.len() == LANES {
            self.compute(motions, |_| ());
        }
    }

    /// Adds the free rotation of the last body of [`Motions::updates`].
    pub(crate) fn add(
        &mut self,
        motions: &mut Motions,
        body: &Body,
        update: VelocityUpdate,
        twist: DVec3,
    ) {
        self.tops
            .push(FreeTop::new(body, twist, self.rules.iterations));
        self.places.push(SpinPlace {
            turn: motions.turns.len(),
            update: VelocityUpdate {
                spins: true,
                ..update
            },
            index: motions.updates.len() - 1,
        });
        motions.turns.push(SteadyTurn {
            body: body.handle,
            after: TurnAfter::Momentum(DVec3::ZERO),
            inertia: body.principal_inertia,
            twist,
            gyroscopic: true,
            damped: false,
            steady: Vector::ZERO,
        });
    }

    /// Computes the rotations that were added, and passes the velocities to give to Rapier to `write`.
    pub(crate) fn compute(
        &mut self,
        motions: &mut Motions,
        mut write: impl FnMut(&VelocityUpdate),
    ) {
        let chunks = self.tops.chunks(LANES).zip(self.places.chunks(LANES));
        for (tops, places) in chunks {
            for (spin, place) in FreeTop::turn_all(tops, self.rules.dt).zip(places) {
                let turn = &mut motions.turns[place.turn];
                turn.after = TurnAfter::Momentum(spin.momentum);
                turn.steady = spin.angvel;
                let update = VelocityUpdate {
                    angvel: spin.angvel,
                    ..place.update
                };
                motions.updates[place.index] = update;
                write(&update);
            }
        }
        self.tops.clear();
        self.places.clear();
    }
}
