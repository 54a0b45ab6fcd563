//! Twenty hard spheres in a cube.

use super::super::scenes::hard_spheres::{self, Event, Gas, Pair, in_order};
use super::fields;
use super::simulation::{Driver, Simulation};
use super::{About, Case, run};
use crate::study::{Measured, Method, Metric, Run, StudyError};
use fields::math::to_dvec3;

/// Twenty hard spheres in a cube, dense or dilute: 60 collisions in the order of an exact run.
pub struct HardSpheres {
    gas: Gas,
}

/// The longest time step. The simulated time is that of the 60 collisions, rounded up to a multiple of this step.
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

/// The dense gas over a time so long that only averages can be compared.
pub struct LongGas {
    gas: HardSpheres,
}

/// Simulated time, in which about 1,900 pairs collide.
const LONG: f64 = 40.0;
/// Collisions between spheres per unit of time, and twice the kinetic energy, of the exact run of 60,000 events in the
/// cube of side 4 (`g_hard_spheres20`). The statistical error of the rate is 0.6 %.
const EXACT_RATE: [f64; 2] = [44.536, 60.0];
/// Time between samples of the speeds: five mean free times, so that samples are independent.
const LOOK: f64 = 1.0;

impl LongGas {
    /// The dense gas.
    pub fn dense() -> Self {
        let [gas, _] = HardSpheres::all();
        LongGas { gas }
    }
}

impl Case for LongGas {
    fn about(&self) -> About {
        About {
            name: "dense hard spheres for long".to_owned(),
            description: "Twenty elastic spheres in a cube, some 1,900 collisions of two: whether they keep their energy, \
                          how often they collide, and the law of their speeds; against statistical mechanics.",
            duration: LONG,
            halvings: 5,
            views: vec![(Metric::Energy, 1e-2), (Metric::CollisionRate, 0.1)],
            ..self.gas.about()
        }
    }

    fn methods(&self) -> &'static [Method] {
        self.gas.methods()
    }

    fn is_quick(&self) -> bool {
        false
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        self.gas.set_up(method, dt)
    }

    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError> {
        let (about, steps) = (self.about(), self.steps(dt)?);
        let mut gas = self.gas.build(method, dt)?;
        let mut made = 0;
        let (mut looked, mut shares) = (0.0, Vec::new());
        let start: f64 = squares(&gas).iter().sum();
        let (mut off, mut pairs) = (0.0_f64, 0_usize);
        while made < steps {
            let Ok(events) = gas.step() else {
                break;
            };
            made += 1;
            let of_two = |event: &&Event| matches!(event.pair, Pair::Spheres(..));
            pairs += events.iter().filter(of_two).count();
            let now = squares(&gas);
            let all: f64 = now.iter().sum();
            off = off.max((all / start - 1.0).abs());
            if made as f64 * dt >= looked + LOOK {
                looked += LOOK;
                shares.extend(now.iter().map(|it| it / all));
            }
        }
        // The rate scales with the speeds, so with the square root of the energy.
        let [rate, energy] = EXACT_RATE;
        let exact = rate * (start / energy).sqrt() * made as f64 * dt;
        let errors = vec![
            Measured::new(Metric::Energy, off),
            Measured::new(Metric::CollisionRate, (pairs as f64 / exact - 1.0).abs()),
            Measured::new(Metric::Speeds, from_beta(shares, self.gas.gas.start.len())),
        ];
        Ok(run(&about, (method, dt), (made, 0), 0, errors))
    }
}

/// The squares of the speeds.
fn squares(gas: &hard_spheres::Run) -> Vec<f64> {
    let parent = |part: fields::math::ColliderHandle| gas.world.colliders[part].parent();
    let bodies = gas.spheres.iter().filter_map(|it| parent(*it));
    bodies
        .map(|it| to_dvec3(gas.world.bodies[it].linvel()).length_squared())
        .collect()
}

/// The Kolmogorov-Smirnov distance of v²/Σv² of spheres in a box from Beta(3/2, 3(N-1)/2), which is exact at
/// a fixed energy.
fn from_beta(mut shares: Vec<f64>, count: usize) -> f64 {
    shares.sort_unstable_by(f64::total_cmp);
    let power = 1.5 * (count as f64 - 1.0) - 1.0;
    // With x = s² the density is s² (1 - s²)^power, integrated by Simpson's rule from share to share.
    let density = |s: f64| s * s * (1.0 - s * s).max(0.0).powf(power);
    let between =
        |a: f64, b: f64| (b - a) / 6.0 * (density(a) + 4.0 * density(0.5 * (a + b)) + density(b));
    let fine = |from: f64, to: f64| {
        const PARTS: usize = 64;
        let at = |k: usize| from + (to - from) * k as f64 / PARTS as f64;
        (0..PARTS).map(|k| between(at(k), at(k + 1))).sum::<f64>()
    };
    let (whole, samples) = (fine(0.0, 1.0), shares.len() as f64);
    let (mut below, mut last, mut apart) = (0.0, 0.0, 0.0_f64);
    for (number, share) in shares.iter().enumerate() {
        let s = share.sqrt();
        below += fine(last, s) / whole;
        last = s;
        let found = [number as f64 / samples, (number + 1) as f64 / samples];
        apart = found
            .iter()
            .fold(apart, |most, it| most.max((it - below).abs()));
    }
    if shares.is_empty() { f64::NAN } else { apart }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn the_distance_from_beta_is_small_for_normal_velocities_and_large_for_equal_speeds() {
        let mut random = Random::new(5);
        let mut of = |count: usize, equal: bool| {
            let mut shares = Vec::new();
            for _ in 0..200 {
                let squares = (0..count).map(|_| match equal {
                    true => 1.0,
                    false => random.normal_vector().length_squared(),
                });
                let squares: Vec<f64> = squares.collect();
                let all: f64 = squares.iter().sum();
                shares.extend(squares.iter().map(|it| it / all));
            }
            from_beta(shares, count)
        };
        // The 99 % quantile of the distance for 4,000 samples is 1.63 / sqrt(4000) = 0.026.
        let right = of(20, false);
        assert!(right < 0.026, "{right}");
        assert!(of(20, true) > 0.3);
    }
}
