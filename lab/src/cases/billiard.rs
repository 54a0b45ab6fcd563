//! Twenty hard spheres in a cube.

use super::super::scenes::hard_spheres::{self, Event, Gas, in_order};
use super::simulation::{Driver, Simulation};
use super::{About, Case, run};
use crate::study::{Measured, Method, Metric, Run, StudyError};

/// Twenty hard spheres in a cube, dense or dilute: 60 collisions in the order of an exact run.
pub struct HardSpheres {
    gas: Gas,
}

/// The gas moves on until its 60 collisions are over, and a little longer: in steps of `1/60` and
/// halves of it that is always a whole number.
const STEP: f64 = 1.0 / 60.0;

impl HardSpheres {
    /// The dense gas and the dilute one.
    pub fn all() -> [HardSpheres; 2] {
        Gas::references().map(|gas| HardSpheres { gas })
    }

    fn build(&self, method: Method, dt: f64) -> Result<hard_spheres::Run, StudyError> {
        self.steps(dt)?;
        let answer = match method {
            Method::FieldsDiscrete => hard_spheres::Method::Discrete,
            Method::FieldsSwept => hard_spheres::Method::Swept,
            Method::Rapier | Method::RapierCcd => hard_spheres::Method::Rapier,
            _ => {
                let (case, method) = (self.about().name, method.name());
                return Err(StudyError::Method { case, method });
            }
        };
        let mut gas = self.gas.build(answer, dt)?;
        for (_, body) in gas.world.bodies.iter_mut() {
            body.enable_ccd(method == Method::RapierCcd);
        }
        Ok(gas)
    }
}

impl Case for HardSpheres {
    fn about(&self) -> About {
        let last = self.gas.events.last().map_or(0.0, |event| event.time);
        About {
            name: format!("{} hard spheres", self.gas.name),
            description: "Twenty elastic spheres in a cube: how many of the first 60 collisions come in the order of \
                          an exact run.",
            time_unit: "time unit",
            duration: (last / STEP).ceil() * STEP,
            longest: STEP,
            halvings: 6,
            views: vec![(Metric::EventOrder, 0.1)],
        }
    }

    fn methods(&self) -> &'static [Method] {
        &[
            Method::FieldsDiscrete,
            Method::FieldsSwept,
            Method::Rapier,
            Method::RapierCcd,
        ]
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        let gas = self.build(method, dt)?;
        let driver = gas
            .fields
            .map_or(Driver::Nobody, |fields| Driver::Fields(Box::new(fields)));
        let world = gas.world;
        Ok(vec![Simulation { world, driver }])
    }

    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError> {
        let (about, steps) = (self.about(), self.steps(dt)?);
        let mut gas = self.build(method, dt)?;
        let (mut events, mut made): (Vec<Event>, u64) = (Vec::new(), 0);
        while made < steps {
            let Ok(found) = gas.step() else {
                break;
            };
            events.extend(found);
            made += 1;
        }
        let exact = self.gas.events.len().max(1) as f64;
        let missing = 1.0 - in_order(&events, &self.gas) as f64 / exact;
        let errors = vec![Measured::new(Metric::EventOrder, missing)];
        Ok(run(&about, (method, dt), (made, 0), 0, errors))
    }
}
