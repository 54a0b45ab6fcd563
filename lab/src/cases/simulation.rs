//! A world with its driver, and how it is timed.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use super::fields;
use fields::math::{Real, RigidBodySet, Vector};
use fields::rapier::prelude::{IntegrationParameters, PhysicsWorld};
use fields::{FaultPolicy, Field, Fields, StepError};

/// An action on the bodies at one moment of a step.
type Act = Box<dyn FnMut(&mut RigidBodySet)>;

/// Code that acts on the bodies of a world besides Rapier.
pub(super) enum Driver {
    Fields(Box<Fields>),
    /// Before each of Rapier's steps.
    Before(Act),
    /// Before and after.
    Around(Act, Act),
    Nobody,
}

/// A world and its driver.
pub struct Simulation {
    pub(super) world: PhysicsWorld,
    pub(super) driver: Driver,
}

impl Simulation {
    /// Makes a step; returns whether it gave a warning.
    pub(super) fn step(&mut self) -> Result<bool, StepError> {
        match &mut self.driver {
            Driver::Fields(fields) => {
                // A fault must fail the run. By default, it disables a body and the run goes on.
                fields.settings.on_fault = FaultPolicy::Refuse;
                fields.step(&mut self.world)?;
                return Ok(!fields.warnings().is_empty());
            }
            Driver::Before(act) => {
                act(&mut self.world.bodies);
                self.world.step();
            }
            Driver::Around(before, after) => {
                before(&mut self.world.bodies);
                self.world.step();
                after(&mut self.world.bodies);
            }
            Driver::Nobody => self.world.step(),
        }
        Ok(false)
    }

    /// Makes `steps` steps, or fewer if one fails; returns how many were made.
    pub(super) fn advance(&mut self, steps: u64) -> u64 {
        let failed = (0..steps).find(|_| self.step().is_err());
        failed.unwrap_or(steps)
    }
}

/// Time in which each world makes `steps` steps, s.
pub(super) fn seconds(mut simulations: Vec<Simulation>, steps: u64) -> f64 {
    let start = Instant::now();
    for simulation in &mut simulations {
        simulation.advance(steps);
    }
    start.elapsed().as_secs_f64()
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

/// Counts the samples at which fields are evaluated.
#[derive(Clone, Default)]
pub(super) struct Counter(Arc<AtomicU64>);

impl Counter {
    /// A field that is zero and counts its samples.
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
