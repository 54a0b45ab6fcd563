//! Pairs of spheres that meet.

use super::answer::{answered, follow};
use super::fields;
use super::simulation::{Simulation, weightless};
use super::{About, Case, run};
use crate::study::{Measured, Method, Metric, Row, Run, StudyError, Table, quantile};
use fields::ContactLaw;
use fields::math::{DVec3, RigidBodyHandle, Vector, from_dvec3, from_f64, to_dvec3};
use fields::rapier::prelude::{ColliderBuilder, RigidBodyBuilder};

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
/// The unit of time is the flight time of a pair: the time in which it covers the sum of its radii at its relative
/// speed. A run takes two flight times with the contact near its middle, for each pair at a different moment within a
/// step. Rapier's limit on speeds is lifted, for bullets; all other parameters are its defaults. One of them is
/// `contact_recycling`, by which Rapier may use contacts that are slightly out of date: at 1/256 of the flight time,
/// 95 % of its errors are within 0.08 with it and within 0.01 without.
#[derive(Clone, Debug, PartialEq)]
pub struct Impacts {
    /// The pairs that touch.
    pub pairs: Vec<Impact>,
    /// Pairs that pass without touching; `time` is that of their closest approach.
    pub misses: Vec<Impact>,
}

/// Simulated time per pair, in flight times.
const DURATION: f64 = 2.0;

/// The golden ratio less one: the fractional parts of its multiples are evenly spread.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

const NAME: &str = "sphere impacts";

impl Impacts {
    /// The pairs of a table: those that meet (`hit` is 1), and those that pass.
    ///
    /// Columns of the first sphere: `m1`, `r1`, `x1 y1 z1`, `vx1 vy1 vz1` before and `v1px v1py v1pz` after contact;
    /// those of the second have a 2 instead. Further `e`, the restitution, and `toi`, the time of contact, or `tca`,
    /// that of the closest approach.
    ///
    /// # Errors
    /// A column is missing, or a cell is not a number.
    pub fn from_csv(text: &str) -> Result<Self, StudyError> {
        let table = Table::parse(text)?;
        let (mut pairs, mut misses) = (Vec::new(), Vec::new());
        for row in table.rows() {
            if row.number("hit")? == 1.0 {
                pairs.push(Impact::read(&row, "toi")?);
            } else {
                misses.push(Impact::read(&row, "tca")?);
            }
        }
        Ok(Impacts { pairs, misses })
    }

    /// The hundred pairs of the reference.
    pub fn reference() -> Self {
        let text = include_str!("../../../tests/data/f_collisions/spheres.csv");
        Self::from_csv(text).expect("a table that the tests read")
    }

    /// The share of passing pairs whose velocities change.
    fn invented(&self, method: Method, dt: f64, steps: u64) -> Result<f64, StudyError> {
        let mut invented = 0;
        for (place, pair) in self.misses.iter().enumerate() {
            let lead = Self::lead(place, steps);
            let mut simulation = pair.set_up(method, dt, lead)?;
            let (found, _) = pair.watch(&mut simulation, steps, dt, lead);
            invented += usize::from(!found.missed);
        }
        Ok(invented as f64 / self.misses.len().max(1) as f64)
    }

    /// Number of steps from the start of a run to the contact of the pair at `place`.
    fn lead(place: usize, steps: u64) -> f64 {
        steps as f64 / 2.0 + (place as f64 * GOLDEN).fract()
    }
}

/// The errors of one impact.
struct Found {
    /// Largest error of a velocity, relative to the largest speed.
    velocity: f64,
    /// Error of the time at which velocities change, in flight times.
    time: f64,
    missed: bool,
}

impl Impact {
    fn read(row: &Row<'_>, time: &str) -> Result<Self, StudyError> {
        Ok(Impact {
            masses: [row.number("m1")?, row.number("m2")?],
            radii: [row.number("r1")?, row.number("r2")?],
            positions: [row.vector("", "1")?, row.vector("", "2")?],
            before: [row.vector("v", "1")?, row.vector("v", "2")?],
            restitution: row.number("e")?,
            time: row.number(time)?,
            after: [row.vector("v1p", "")?, row.vector("v2p", "")?],
        })
    }

    /// The time in which the pair covers the sum of its radii at its relative speed.
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
            Method::PaperLaw => ContactLaw::Paper,
            _ => ContactLaw::restitution(restitution),
        };
        answered(NAME, method, world, &spheres, law)
    }

    /// Runs a world of [`Impact::set_up`]; returns the errors, and the number of steps with a warning.
    fn watch(&self, simulation: &mut Simulation, steps: u64, dt: f64, lead: f64) -> (Found, u64) {
        let velocities = |simulation: &Simulation| -> Vec<Vector> {
            let bodies = &simulation.world.bodies;
            let handles: Vec<RigidBodyHandle> = bodies.iter().map(|(handle, _)| handle).collect();
            handles
                .iter()
                .map(|handle| bodies[*handle].linvel())
                .collect()
        };
        let start = velocities(simulation);
        let mut first = None;
        let (_, warned) = follow(simulation, steps, |step, simulation| {
            if first.is_none() && velocities(simulation) != start {
                first = Some(step);
            }
        });
        let end = velocities(simulation).into_iter().map(to_dvec3);
        let errors = end.zip(self.after).map(|(end, after)| end.distance(after));
        let speeds = self.before.iter().chain(&self.after).map(|v| v.length());
        let off = errors.fold(0.0, |most: f64, it| match it.is_nan() {
            true => f64::INFINITY,
            false => most.max(it),
        });
        let found = Found {
            velocity: off / speeds.fold(0.0, f64::max),
            time: first.map_or(f64::INFINITY, |step| (step as f64 - lead).abs() * dt),
            missed: first.is_none(),
        };
        (found, warned)
    }
}

impl Case for Impacts {
    fn about(&self) -> About {
        About {
            name: NAME.to_owned(),
            description: "Pairs of spheres that meet head on, off centre, grazing, as bullets, at mass ratios up to 1e6; \
                          against the exact impact.",
            time_unit: "flight time",
            duration: DURATION,
            longest: 0.5,
            halvings: 8,
            views: vec![(Metric::Velocity, 1e-2), (Metric::Velocity95, 0.1)],
        }
    }

    fn methods(&self) -> &'static [Method] {
        &Method::CONTACTS
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        let steps = self.steps(dt)?;
        let pairs = self.pairs.iter().enumerate();
        pairs
            .map(|(place, pair)| pair.set_up(method, dt, Self::lead(place, steps)))
            .collect()
    }

    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError> {
        let steps = self.steps(dt)?;
        let mut warned = 0;
        let mut simulations = self.set_up(method, dt)?;
        let all = simulations.iter_mut().zip(&self.pairs).enumerate();
        let found = all.map(|(place, (simulation, pair))| {
            let (found, told) = pair.watch(simulation, steps, dt, Self::lead(place, steps));
            warned += told;
            found
        });
        let found: Vec<Found> = found.collect();
        let sorted = |of: fn(&Found) -> f64| {
            let mut values: Vec<f64> = found.iter().map(of).collect();
            values.sort_unstable_by(f64::total_cmp);
            values
        };
        let (velocity, time) = (sorted(|it| it.velocity), sorted(|it| it.time));
        let missed = found.iter().filter(|found| found.missed).count();
        let errors = vec![
            Measured::new(Metric::Velocity, quantile(&velocity, 0.5)),
            Measured::new(Metric::Velocity95, quantile(&velocity, 0.95)),
            Measured::new(Metric::VelocityWorst, quantile(&velocity, 1.0)),
            Measured::new(Metric::ContactTime, quantile(&time, 0.5)),
            Measured::new(Metric::Missed, missed as f64 / found.len().max(1) as f64),
            Measured::new(Metric::Invented, self.invented(method, dt, steps)?),
        ];
        let all = steps * self.pairs.len() as u64;
        Ok(run(&self.about(), (method, dt), (all, warned), 0, errors))
    }
}
