//! The clock, and what is moved while it runs.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use super::fields;
use fields::math::{Real, RigidBodySet, Vector};
use fields::rapier::prelude::{IntegrationParameters, PhysicsWorld};
use fields::{FaultPolicy, Field, Fields, StepError};

/// How often a run is repeated for the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Runs before the first that counts.
    pub warm_ups: usize,
    /// Runs that count, at least; one is always made.
    pub repeats: usize,
    /// Seconds that all runs that count take together, at least: what else the machine does in
    /// that time is not to decide a median.
    pub seconds: f64,
}

impl Default for Effort {
    /// One run to warm up, and at least nine and 0.15 s that count.
    fn default() -> Self {
        Effort {
            warm_ups: 1,
            repeats: 9,
            seconds: 0.15,
        }
    }
}

/// Times of repeated runs on the clock, seconds, on one thread.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timing {
    /// How many runs there were.
    pub repeats: u32,
    /// Half of the runs were faster.
    pub median: f64,
    /// The fastest run.
    pub min: f64,
    /// A quarter of the runs were faster.
    pub lower_quartile: f64,
    /// Three quarters of the runs were faster.
    pub upper_quartile: f64,
}

impl Timing {
    /// The times of some runs, interpolated linearly between two; all zero if there are none.
    pub fn of(mut seconds: Vec<f64>) -> Self {
        seconds.sort_unstable_by(f64::total_cmp);
        Timing {
            repeats: seconds.len() as u32,
            median: quantile(&seconds, 0.5),
            min: quantile(&seconds, 0.0),
            lower_quartile: quantile(&seconds, 0.25),
            upper_quartile: quantile(&seconds, 0.75),
        }
    }
}

/// The value below which a `share` of sorted values lies, interpolated linearly.
pub(super) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return 0.0;
    };
    let place = share * last as f64;
    let (below, above) = (sorted[place as usize], sorted[place.ceil() as usize]);
    // Of two infinities, or when it is the value itself, there is nothing to interpolate.
    if below == above || place.fract() == 0.0 {
        below
    } else {
        below + place.fract() * (above - below)
    }
}

/// Who acts on the bodies of a world besides Rapier.
pub(super) enum Driver {
    Fields(Box<Fields>),
    ByHand(Box<dyn FnMut(&mut RigidBodySet)>),
    Nobody,
}

/// A world and who moves it.
pub(super) struct Simulation {
    pub world: PhysicsWorld,
    pub driver: Driver,
}

impl Simulation {
    pub fn step(&mut self) -> Result<(), StepError> {
        match &mut self.driver {
            Driver::Fields(fields) => {
                // A run that comes to grief has failed.
                fields.settings.on_fault = FaultPolicy::Refuse;
                fields.step(&mut self.world).map(|_| ())
            }
            Driver::ByHand(act) => {
                act(&mut self.world.bodies);
                self.world.step();
                Ok(())
            }
            Driver::Nobody => {
                self.world.step();
                Ok(())
            }
        }
    }

    /// Makes some steps, and stops at one that fails; returns how many were made.
    pub fn advance(&mut self, steps: u64) -> u64 {
        let failed = (0..steps).find(|_| self.step().is_err());
        failed.unwrap_or(steps)
    }
}

/// An empty world without gravity, at Rapier's defaults otherwise.
pub(super) fn weightless(dt: Real) -> PhysicsWorld {
    PhysicsWorld {
        gravity: Vector::ZERO,
        integration_parameters: IntegrationParameters {
            dt,
            ..IntegrationParameters::default()
        },
        ..PhysicsWorld::default()
    }
}

/// Times how long some worlds take for their steps. Setting them up does not count.
pub(super) fn time<E>(
    effort: Effort,
    steps: u64,
    set_up: impl Fn() -> Result<Vec<Simulation>, E>,
) -> Result<Timing, E> {
    let once = || {
        let mut simulations = set_up()?;
        let start = Instant::now();
        for simulation in &mut simulations {
            simulation.advance(steps);
        }
        Ok(start.elapsed().as_secs_f64())
    };
    for _ in 0..effort.warm_ups {
        once()?;
    }
    let mut seconds = vec![once()?];
    let mut total = seconds[0];
    while seconds.len() < effort.repeats || total < effort.seconds {
        let next = once()?;
        total += next;
        seconds.push(next);
    }
    Ok(Timing::of(seconds))
}

/// Counts on how many samples fields are evaluated.
#[derive(Clone, Default)]
pub(super) struct Counter(Arc<AtomicU64>);

impl Counter {
    /// A field that counts, and is zero.
    pub fn field(&self) -> Field {
        let counter = self.clone();
        Field::closure([], move |_| {
            counter.count(1);
            Vector::ZERO
        })
    }

    pub fn count(&self, samples: u64) {
        self.0.fetch_add(samples, Ordering::Relaxed);
    }

    pub fn counted(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}
