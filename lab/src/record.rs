//! What a run is judged by: conservation with the walls' share counted, and contacts.

use std::time::Instant;

use rapier3d_fields::math::DVec3;

/// The sums over all bodies that are conserved, or should be.
#[derive(Clone, Copy, Debug, Default)]
pub struct Totals {
    pub kinetic: f64,
    pub potential: f64,
    pub momentum: DVec3,
    /// About the origin.
    pub angular_momentum: DVec3,
    /// Σ|mv| and Σ|r||mv|, to hold errors of the two above against.
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

/// How many contacts each side counted, summed over the steps of an interval.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Time at the end of the interval.
    pub time: f64,
    pub fields: u64,
    pub rapier: u64,
}

/// What contacts did in one step; see `watch` of either precision.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepContacts {
    /// Contacts that fields found where the step ended.
    pub found_by_fields: u64,
    /// Pairs that overlap, as Rapier found them where the step began.
    pub found_by_rapier: u64,
    /// Contacts to which the fields gave an impulse.
    pub answered: u64,
    /// Impulse that the walls took up.
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
    /// Contacts that were answered, each once for every step in which it was.
    pub collisions: u64,
    /// Impulse that the walls took up, and its moment about the origin.
    wall_impulse: DVec3,
    wall_twist: DVec3,
    dt: f64,
    steps: usize,
    steps_per_tally: usize,
    /// What the fields found at the poses from which the next step of Rapier starts.
    found_before: u64,
    began: Instant,
    seconds: f64,
}

/// Into how many intervals a run is cut for counting contacts.
const TALLIES: usize = 60;

impl Record {
    /// Begins the record of a run of so many steps.
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

    /// Simulated time. Not the sum of all `dt` in 32 bits, which would be a little off.
    pub fn time(&self) -> f64 {
        self.steps as f64 * self.dt
    }

    /// Takes up what a step did.
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

    /// Notes the energies as they are now.
    pub fn sample(&mut self, now: &Totals) {
        self.samples.push(Sample {
            time: self.time(),
            kinetic: now.kinetic,
            potential: now.potential,
        });
    }

    /// Change of the total energy in each sample, relative to the kinetic energy at the start.
    pub fn drifts(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let start = self.start.energy();
        self.samples.iter().map(move |sample| {
            let change = sample.kinetic + sample.potential - start;
            (sample.time, change / self.start.kinetic)
        })
    }

    /// The largest drift of all samples, and the last.
    pub fn largest_and_last_drift(&self) -> (f64, f64) {
        let largest = self.drifts().fold(0.0, |largest: f64, (_, drift)| {
            // Not `max`, which would pass over NaN.
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

    /// How much momentum, and angular momentum, came from nowhere: bodies and walls together,
    /// relative to the scales at the start.
    pub fn momentum_errors(&self, now: &Totals) -> (f64, f64) {
        let linear = now.momentum + self.wall_impulse - self.start.momentum;
        let angular = now.angular_momentum + self.wall_twist - self.start.angular_momentum;
        let [linear_scale, angular_scale] = self.start.scales;
        (
            relative(linear.length(), linear_scale),
            relative(angular.length(), angular_scale),
        )
    }

    /// Stops the clock.
    pub fn finish(&mut self) {
        self.seconds = self.began.elapsed().as_secs_f64();
    }

    /// Steps in a second of the clock on the wall, until [`finish`](Self::finish).
    pub fn steps_per_second(&self) -> f64 {
        self.steps as f64 / self.seconds
    }
}

/// The error itself where nothing moved at the start, and there is no scale.
fn relative(error: f64, scale: f64) -> f64 {
    if scale > 0.0 { error / scale } else { error }
}
