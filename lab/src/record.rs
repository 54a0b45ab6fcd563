//! The record of a run: conservation of energy and momentum, walls included, and counts of contacts.

use std::time::Instant;

use rapier3d_fields::math::DVec3;

/// Conserved quantities, summed over all bodies.
#[derive(Clone, Copy, Debug, Default)]
pub struct Totals {
    pub kinetic: f64,
    pub potential: f64,
    pub momentum: DVec3,
    /// About the origin.
    pub angular_momentum: DVec3,
    /// Σ|mv| and Σ|r||mv|: the scales of errors of momentum and angular momentum.
    pub scales: [f64; 2],
}

impl Totals {
    pub fn energy(&self) -> f64 {
        self.kinetic + self.potential
    }
}

/// Energies at one time.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub time: f64,
    pub kinetic: f64,
    pub potential: f64,
}

/// Contacts that the fields and Rapier found, summed over the steps of an interval.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Time at the end of the interval.
    pub time: f64,
    pub fields: u64,
    pub rapier: u64,
}

/// The contacts of one step, from `watch::contacts` of either precision.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepContacts {
    /// Contacts that the fields found at the end of the step.
    pub found_by_fields: u64,
    /// Overlapping pairs that Rapier found at the start of the step.
    pub found_by_rapier: u64,
    /// Contacts to which the fields gave an impulse.
    pub answered: u64,
    /// Impulse on the walls, which are fixed bodies.
    pub wall_impulse: DVec3,
    /// Its moment about the origin.
    pub wall_twist: DVec3,
}

/// The record of one run.
pub struct Record {
    pub start: Totals,
    pub samples: Vec<Sample>,
    /// One for each interval.
    pub tallies: Vec<Tally>,
    /// Contacts that got an impulse, counted once per step in which they did.
    pub collisions: u64,
    /// Impulse on the walls, and its moment about the origin.
    wall_impulse: DVec3,
    wall_twist: DVec3,
    dt: f64,
    steps: usize,
    steps_per_tally: usize,
    /// Contacts that the fields found at the poses from which Rapier's next step starts.
    found_before: u64,
    began: Instant,
    seconds: f64,
}

/// Number of intervals of a run in which contacts are counted.
const TALLIES: usize = 60;

impl Record {
    /// Begins the record of a run of `steps` steps.
    pub fn begin(start: Totals, dt: f64, steps: usize) -> Self {
        let mut record = Self {
            start,
            samples: Vec::new(),
            tallies: Vec::new(),
            collisions: 0,
            wall_impulse: DVec3::ZERO,
            wall_twist: DVec3::ZERO,
            dt,
            steps: 0,
            steps_per_tally: steps.div_ceil(TALLIES),
            found_before: 0,
            began: Instant::now(),
            seconds: 0.0,
        };
        record.sample(&start);
        record
    }

    /// Simulated time. A product, because the sum of all `dt` in 32 bits would accumulate rounding errors.
    pub fn time(&self) -> f64 {
        self.steps as f64 * self.dt
    }

    /// Adds a step.
    pub fn step(&mut self, step: &StepContacts) {
        if self.steps.is_multiple_of(self.steps_per_tally) {
            self.tallies.push(Tally::default());
        }
        self.steps += 1;
        let time = self.time();
        if let Some(tally) = self.tallies.last_mut() {
            tally.time = time;
            tally.fields += self.found_before;
            tally.rapier += step.found_by_rapier;
        }
        self.found_before = step.found_by_fields;
        self.collisions += step.answered;
        self.wall_impulse += step.wall_impulse;
        self.wall_twist += step.wall_twist;
    }

    /// Adds a sample of the energies.
    pub fn sample(&mut self, now: &Totals) {
        self.samples.push(Sample {
            time: self.time(),
            kinetic: now.kinetic,
            potential: now.potential,
        });
    }

    /// Time of each sample, and the change of total energy until then relative to the initial kinetic energy.
    pub fn drifts(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let start = self.start.energy();
        self.samples.iter().map(move |sample| {
            let change = sample.kinetic + sample.potential - start;
            (sample.time, change / self.start.kinetic)
        })
    }

    /// The largest absolute drift of all samples, and the last drift.
    pub fn largest_and_last_drift(&self) -> (f64, f64) {
        let largest = self.drifts().fold(0.0, |largest: f64, (_, drift)| {
            // `max` would ignore NaN.
            if drift.abs() <= largest {
                largest
            } else {
                drift.abs()
            }
        });
        (
            largest,
            self.drifts().last().map_or(0.0, |(_, drift)| drift),
        )
    }

    /// Errors of momentum and angular momentum of bodies and walls together, relative to the scales at the start.
    pub fn momentum_errors(&self, now: &Totals) -> (f64, f64) {
        let linear = now.momentum + self.wall_impulse - self.start.momentum;
        let angular = now.angular_momentum + self.wall_twist - self.start.angular_momentum;
        let [linear_scale, angular_scale] = self.start.scales;
        (
            relative(linear.length(), linear_scale),
            relative(angular.length(), angular_scale),
        )
    }

    /// Ends the measurement of wall-clock time.
    pub fn finish(&mut self) {
        self.seconds = self.began.elapsed().as_secs_f64();
    }

    /// Steps per second of wall-clock time, up to [`finish`](Self::finish).
    pub fn steps_per_second(&self) -> f64 {
        self.steps as f64 / self.seconds
    }
}

/// `error / scale`, or the error itself if nothing moved at the start, so that there is no scale.
fn relative(error: f64, scale: f64) -> f64 {
    if scale > 0.0 { error / scale } else { error }
}
