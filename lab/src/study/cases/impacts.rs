//! Pairs of spheres that meet.

use super::super::measure::{Driver, Simulation, quantile, time, weightless};
use super::super::{Effort, Measured, Method, Metric, PRECISION, Row, Run, StudyError, Table};
use super::fields;
use super::{Case, finite_or_infinite, halvings, whole_steps};
use fields::math::{DVec3, RigidBodyHandle, Vector, from_dvec3, from_f64, to_dvec3};
use fields::rapier::prelude::{ColliderBuilder, RigidBodyBuilder};
use fields::{ContactLaw, Field, Fields};

/// Two spheres that fly in straight lines, touch once, and part without friction.
///
/// Any consistent units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Masses.
    pub masses: [f64; 2],
    /// Radii.
    pub radii: [f64; 2],
    /// Centres at time zero.
    pub positions: [DVec3; 2],
    /// Velocities before they touch.
    pub before: [DVec3; 2],
    /// Ratio of the normal speeds after and before.
    pub restitution: f64,
    /// When they touch.
    pub time: f64,
    /// Velocities after.
    pub after: [DVec3; 2],
}

/// Pairs of spheres that meet, each in a world of its own.
///
/// The unit of time is that of the pair: the time in which the two fly, relative to each other,
/// the sum of their radii. A run covers two such times, and they touch about in the middle, each
/// pair at another moment within a step. Rapier's limit on speeds is lifted, for bullets; all
/// else is as Rapier has it. That includes `contact_recycling`, which lets Rapier answer by
/// contacts a little out of date: at 1/256 of the flight time, 95 % of its errors are within 0.08
/// with it and within 0.01 without.
#[derive(Clone, Debug, PartialEq)]
pub struct Impacts {
    /// The pairs.
    pub pairs: Vec<Impact>,
}

/// Simulated time per pair, in flight times.
const DURATION: f64 = 2.0;

/// The golden ratio less one: its multiples fall evenly within a step.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

const NAME: &str = "sphere impacts";

impl Impacts {
    /// The pairs of a table that meet (`hit` is 1).
    ///
    /// Columns, for each of two spheres: `m`, `r`, `x y z`, `vx vy vz` before and `vxp vyp vzp`
    /// after, each with the number of the sphere after the axis or letter (`m1`, `x1`, `vx1`;
    /// but `v1px` after); and `e`, the restitution, and `toi`, the time of contact.
    ///
    /// # Errors
    /// A column is not there, or a cell is no number.
    pub fn from_csv(text: &str) -> Result<Self, StudyError> {
        let table = Table::parse(text)?;
        let mut pairs = Vec::new();
        for row in table.rows() {
            if row.number("hit")? == 1.0 {
                pairs.push(Impact::read(&row)?);
            }
        }
        Ok(Impacts { pairs })
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        let steps = whole_steps(NAME, DURATION, dt)?;
        let pairs = self.pairs.iter().enumerate();
        pairs
            .map(|(place, pair)| {
                let phase = (place as f64 * GOLDEN).fract();
                pair.set_up(method, dt, steps as f64 / 2.0 + phase)
            })
            .collect()
    }
}

/// How an impact went.
struct Found {
    /// Largest error of a velocity over the largest speed.
    velocity: f64,
    /// Error of the time of the answer, in flight times.
    time: f64,
    missed: bool,
}

impl Impact {
    fn read(row: &Row<'_>) -> Result<Self, StudyError> {
        Ok(Impact {
            masses: [row.number("m1")?, row.number("m2")?],
            radii: [row.number("r1")?, row.number("r2")?],
            positions: [row.vector("", "1")?, row.vector("", "2")?],
            before: [row.vector("v", "1")?, row.vector("v", "2")?],
            restitution: row.number("e")?,
            time: row.number("toi")?,
            after: [row.vector("v1p", "")?, row.vector("v2p", "")?],
        })
    }

    /// The time in which they fly the sum of their radii.
    fn flight_time(&self) -> f64 {
        (self.radii[0] + self.radii[1]) / self.before[0].distance(self.before[1])
    }

    /// A world in which they will touch after `lead` steps of `dt` flight times.
    fn set_up(&self, method: Method, dt: f64, lead: f64) -> Result<Simulation, StudyError> {
        let dt = dt * self.flight_time();
        let mut world = weightless(from_f64(dt));
        world.integration_parameters.normalized_max_linear_velocity = fields::math::Real::MAX;
        let restitution = from_f64(self.restitution);
        let spheres = [0, 1].map(|which| {
            let start = self.positions[which] + self.before[which] * (self.time - lead * dt);
            let body = RigidBodyBuilder::dynamic()
                .translation(from_dvec3(start))
                .linvel(from_dvec3(self.before[which]))
                .can_sleep(false);
            let ball = ColliderBuilder::ball(from_f64(self.radii[which]))
                .mass(from_f64(self.masses[which]))
                .restitution(restitution)
                .friction(0.0);
            world.insert(body, ball).1
        });
        let law = match method {
            Method::ImpulseLaw => ContactLaw::restitution(restitution),
            Method::PaperLaw => ContactLaw::Paper,
            Method::RapierContacts => {
                let driver = Driver::Nobody;
                return Ok(Simulation { world, driver });
            }
            _ => {
                let (case, method) = (NAME, method.name());
                return Err(StudyError::Method { case, method });
            }
        };
        let [first, second] = spheres.map(|sphere| Field::contact(law).at(sphere));
        let driver = Driver::Fields(Box::new(Fields::new(first.sum_union(second))?));
        Ok(Simulation { world, driver })
    }

    /// Makes the steps of a world of [`Impact::set_up`], and sees how it goes.
    fn watch(&self, simulation: &mut Simulation, steps: u64, dt: f64, lead: f64) -> Found {
        let velocities = |simulation: &Simulation| -> Vec<Vector> {
            let bodies = &simulation.world.bodies;
            let handles: Vec<RigidBodyHandle> = bodies.iter().map(|(handle, _)| handle).collect();
            handles
                .iter()
                .map(|handle| bodies[*handle].linvel())
                .collect()
        };
        let start = velocities(simulation);
        let mut answered = None;
        for step in 1..=steps {
            if simulation.step().is_err() {
                break;
            }
            if answered.is_none() && velocities(simulation) != start {
                answered = Some(step);
            }
        }
        let end = velocities(simulation).into_iter().map(to_dvec3);
        let errors = end.zip(self.after).map(|(end, after)| end.distance(after));
        let speeds = self.before.iter().chain(&self.after).map(|v| v.length());
        let off = errors.map(finite_or_infinite).fold(0.0, f64::max);
        Found {
            velocity: off / speeds.fold(0.0, f64::max),
            time: answered.map_or(f64::INFINITY, |step| (step as f64 - lead).abs() * dt),
            missed: answered.is_none(),
        }
    }
}

impl Case for Impacts {
    fn name(&self) -> &'static str {
        NAME
    }

    fn time_unit(&self) -> &'static str {
        "flight time"
    }

    fn methods(&self) -> &'static [Method] {
        &Method::CONTACTS
    }

    /// From half the flight time to 1/256 of it.
    fn time_steps(&self) -> Vec<f64> {
        halvings(0.5, 8)
    }

    fn run(&self, method: Method, dt: f64, effort: Effort) -> Result<Run, StudyError> {
        let steps = whole_steps(NAME, DURATION, dt)?;
        let mut simulations = self.set_up(method, dt)?;
        let found: Vec<Found> = simulations
            .iter_mut()
            .zip(&self.pairs)
            .enumerate()
            .map(|(place, (simulation, pair))| {
                let lead = steps as f64 / 2.0 + (place as f64 * GOLDEN).fract();
                pair.watch(simulation, steps, dt, lead)
            })
            .collect();
        let sorted = |of: fn(&Found) -> f64| {
            let mut values: Vec<f64> = found.iter().map(of).collect();
            values.sort_unstable_by(f64::total_cmp);
            values
        };
        let velocity = sorted(|found| found.velocity);
        let time_error = sorted(|found| found.time);
        let missed = found.iter().filter(|found| found.missed).count();
        let errors = [
            (Metric::Velocity, quantile(&velocity, 0.5)),
            (Metric::Velocity95, quantile(&velocity, 0.95)),
            (Metric::VelocityWorst, quantile(&velocity, 1.0)),
            (Metric::ContactTime, quantile(&time_error, 0.5)),
            (Metric::Missed, missed as f64 / found.len().max(1) as f64),
        ];
        let all = steps * self.pairs.len() as u64;
        Ok(Run {
            case: NAME.to_owned(),
            method,
            precision: PRECISION,
            dt,
            steps: all,
            simulated: all as f64 * dt,
            evaluations: 0,
            errors: errors
                .map(|(metric, value)| Measured { metric, value })
                .to_vec(),
            timing: time(effort, steps, || self.set_up(method, dt))?,
        })
    }
}
