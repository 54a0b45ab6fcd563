//! A ball on a spring.

use std::f64::consts::TAU;

use super::super::measure::{Counter, Driver, Simulation, time, weightless};
use super::super::{Effort, Measured, Method, Metric, PRECISION, Run, StudyError};
use super::fields;
use super::{Case, finite_or_infinite, halvings, whole_steps};
use fields::math::{DVec3, Real, RigidBodyHandle, RigidBodySet, from_dvec3, from_f64, to_dvec3};
use fields::rapier::prelude::{ColliderBuilder, RigidBodyBuilder};
use fields::{Field, Fields, Tree};

/// A ball of 1 kg on a spring of 1 Hz, let go at 1 m, for ten and a quarter periods.
///
/// A quarter more, because [`Method::Kick`] differs from [`Method::KickDriftKick`] by where in a
/// period it looks: after whole periods its first-order error cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spring;

/// Simulated time, s.
const DURATION: f64 = 10.25;

/// Mass, kg.
const MASS: f64 = 1.0;

/// Circular frequency, rad/s.
const OMEGA: f64 = TAU;

/// Where the ball is let go, m: 1 m away, along no axis.
const START: DVec3 = DVec3::new(2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0);

const NAME: &str = "spring";

impl Spring {
    fn set_up(
        self,
        method: Method,
        dt: f64,
        counter: Option<&Counter>,
    ) -> Result<(Simulation, RigidBodyHandle), StudyError> {
        let mut world = weightless(from_f64(dt));
        let ball = RigidBodyBuilder::dynamic()
            .translation(from_dvec3(START))
            .can_sleep(false);
        let collider = ColliderBuilder::ball(0.1).mass(from_f64(MASS));
        let (body, _) = world.insert(ball, collider);
        let stiffness = from_f64(MASS * OMEGA * OMEGA);
        let driver = match (method, method.scheme()) {
            (_, Some(scheme)) => {
                let mut tree = Tree::from(Field::spring(stiffness));
                if let Some(counter) = counter {
                    tree = tree.sum_union(counter.field());
                }
                let fields = Fields::builder(tree).scheme(scheme).build()?;
                Driver::Fields(Box::new(fields))
            }
            (Method::AddForceLoop, _) => by_hand(body, stiffness, counter.cloned()),
            _ => {
                let (case, method) = (NAME, method.name());
                return Err(StudyError::Method { case, method });
            }
        };
        Ok((Simulation { world, driver }, body))
    }
}

fn by_hand(body: RigidBodyHandle, stiffness: Real, counter: Option<Counter>) -> Driver {
    Driver::ByHand(Box::new(move |bodies: &mut RigidBodySet| {
        let body = &mut bodies[body];
        let force = -stiffness * body.translation();
        body.reset_forces(true);
        body.add_force(force, true);
        if let Some(counter) = &counter {
            counter.count(1);
        }
    }))
}

impl Case for Spring {
    fn name(&self) -> &'static str {
        NAME
    }

    fn time_unit(&self) -> &'static str {
        "s"
    }

    fn methods(&self) -> &'static [Method] {
        &Method::FORCES
    }

    /// From 16 steps in a period to 4096.
    fn time_steps(&self) -> Vec<f64> {
        halvings(1.0 / 16.0, 9)
    }

    fn run(&self, method: Method, dt: f64, effort: Effort) -> Result<Run, StudyError> {
        let steps = whole_steps(NAME, DURATION, dt)?;
        let energy = |position: DVec3, velocity: DVec3| {
            0.5 * MASS * (velocity.length_squared() + OMEGA * OMEGA * position.length_squared())
        };
        let (mut simulation, body) = self.set_up(method, dt, None)?;
        let (mut position, mut velocity) = (START, DVec3::ZERO);
        let (mut worst, mut made) = (0.0_f64, 0);
        while made < steps && simulation.step().is_ok() {
            let body = &simulation.world.bodies[body];
            (position, velocity) = (to_dvec3(body.translation()), to_dvec3(body.linvel()));
            let ratio = energy(position, velocity) / energy(START, DVec3::ZERO);
            worst = worst.max(finite_or_infinite((ratio - 1.0).abs()));
            made += 1;
        }
        let (sin, cos) = (OMEGA * DURATION).sin_cos();
        let offset = (position - START * cos).length();
        let lag = (velocity + START * (OMEGA * sin)).length() / OMEGA;
        let error = if made == steps {
            finite_or_infinite(offset.hypot(lag))
        } else {
            f64::INFINITY
        };
        let counter = Counter::default();
        self.set_up(method, dt, Some(&counter))?.0.advance(steps);
        Ok(Run {
            case: NAME.to_owned(),
            method,
            precision: PRECISION,
            dt,
            steps: made,
            simulated: made as f64 * dt,
            evaluations: counter.counted(),
            errors: vec![
                Measured {
                    metric: Metric::FinalState,
                    value: error,
                },
                Measured {
                    metric: Metric::Energy,
                    value: worst,
                },
            ],
            timing: time(effort, steps, || {
                Ok::<_, StudyError>(vec![self.set_up(method, dt, None)?.0])
            })?,
        })
    }
}
