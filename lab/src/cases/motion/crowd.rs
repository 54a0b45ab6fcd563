//! Ammonia as a gas and as a drop of liquid: too chaotic for errors of final positions.

use std::sync::{Arc, OnceLock};

use super::super::super::scenes::ammonia::{
    BOLTZMANN, DISPERSION, MASS, PRINCIPAL_INERTIA, SITES, interaction,
};
use super::super::fields;
use super::super::{About, Case, Simulation, run};
use super::molecules::{ATOMS, forces, potential};
use super::{Forces, Metric, Motion, Potential, Reference, Site, State, Top, about, real, seen};
use crate::random::Random;
use crate::study::{Measured, Method, Run, StudyError, Table};
use fields::math::{DVec3, RigidBodyHandle, RigidBodySet, to_dvec3};
use fields::{Field, Region};

const DROP: &str = include_str!("../../../../tests/data/b_cluster32/cluster32_liquid.csv");

/// Stiffness of the spherical wall that keeps nitrogens together, amu/ps².
const WALL: f64 = 2000.0;
/// Simulated time, ps.
const DURATION: f64 = 1.0;
/// The longest step, ps: half the stability limit of the fastest oscillation of a drop.
const LONGEST: f64 = 1.0 / 128.0;
const HALVINGS: usize = 6;
/// Number of samples of a run, evenly spaced.
const LOOKS: u64 = 128;
/// Width of the bins of distances, Å, and their number; the last bin holds all larger distances.
const BIN: f64 = 0.25;
const BINS: usize = 64;

/// Molecules whose errors are those of conserved quantities and of averages.
pub struct Crowd {
    motion: Motion,
    place: usize,
}

/// Conserved quantities of a run, and the sums of which averages are made.
#[derive(Clone, Debug, Default)]
struct Means {
    /// Times and energies.
    energies: Vec<[f64; 2]>,
    /// Kinetic energies of translation and rotation, summed over the samples of the second half.
    kinetic: [f64; 2],
    /// Number of distances in each bin, over the same samples.
    distances: Vec<f64>,
    /// The largest change of angular momentum so far, relative to its scale.
    twisted: f64,
}

impl Crowd {
    /// The gas and the liquid.
    pub fn all() -> [Crowd; 2] {
        let gas = "64 molecules of ammonia at 400 K in a round soft wall; kept quantities and means against f64 at \
                   the smallest step.";
        let liquid = "A drop of 32 molecules at 240 K; kept quantities and means against f64 at the smallest step.";
        [
            Self::new(0, "ammonia gas", gas, (lattice(), 400.0), 22.0),
            Self::new(1, "liquid ammonia", liquid, (drop(), 240.0), 12.0),
        ]
    }

    fn new(
        place: usize,
        name: &str,
        description: &'static str,
        (poses, temperature): (Vec<State>, f64),
        radius: f64,
    ) -> Self {
        let states = thermal(poses, temperature);
        let speed = (3.0 * BOLTZMANN * temperature / MASS).sqrt();
        let top = |start: State| Top {
            mass: MASS,
            moments: DVec3::from_array(PRINCIPAL_INERTIA),
            start,
            sites: SITES
                .map(|site| (DVec3::from_array(site.local_point), site.charge))
                .to_vec(),
        };
        let views = [(Metric::EnergyDrift, 0.1), (Metric::PairDistances, 0.1)];
        let motion = Motion {
            about: about(
                name,
                description,
                (DURATION, "ps"),
                (LONGEST, HALVINGS),
                &views,
            ),
            tops: states.into_iter().map(top).collect(),
            gravity: DVec3::ZERO,
            scales: [1.0, speed],
            tree: Arc::new(move |sites| {
                let (molecules, _) = sites.as_chunks::<ATOMS>();
                let outside = Region::ball(real(radius)).complement();
                let wall = Field::spring_damper(real(WALL), 0.0, real(radius)).within(outside);
                let wall = wall.coupled_to_axis(DISPERSION).named("wall");
                interaction(molecules.iter().copied(), None).sum_union(wall)
            }),
            forces: walled(radius),
            potential: Some(walled_potential(radius)),
            first_site_axis: Some(DISPERSION),
            reference: Reference::Table(Vec::new()),
        };
        Crowd { motion, place }
    }

    /// Averages of the run in f64 at half of the smallest step, computed once.
    fn reference(&self) -> &'static Means {
        static KNOWN: [OnceLock<Means>; 2] = [OnceLock::new(), OnceLock::new()];
        KNOWN[self.place].get_or_init(|| {
            let twin = &crate::double::cases::Crowd::all()[self.place];
            let [energies, kinetic, distances] = twin.observed();
            Means {
                energies: energies.chunks(2).map(|it| [it[0], it[1]]).collect(),
                kinetic: [kinetic[0], kinetic[1]],
                distances,
                twisted: 0.0,
            }
        })
    }

    /// The data of the reference of both precisions, as plain numbers because their types differ.
    pub fn observed(&self) -> [Vec<f64>; 3] {
        let dt = LONGEST / f64::from(1 << HALVINGS);
        let made = self.observe(Method::KickDriftKick, dt);
        let (means, _) = made.expect("a method and a step of the case");
        let energies = means.energies.into_iter().flatten().collect();
        [energies, means.kinetic.to_vec(), means.distances]
    }

    /// Runs the case and samples it; also returns the number of steps, and of those with a warning.
    fn observe(&self, method: Method, dt: f64) -> Result<(Means, (u64, u64)), StudyError> {
        let steps = self.steps(dt)?;
        let (mut simulation, bodies) = self.motion.simulation(method, dt, None)?;
        let mut means = Means {
            distances: vec![0.0; BINS],
            ..Means::default()
        };
        let start = self.twist(&simulation.world.bodies, &bodies);
        let (mut made, mut warned) = (0, 0);
        let every = (steps / LOOKS).max(1);
        while made < steps {
            let Ok(told) = simulation.step() else {
                break;
            };
            made += 1;
            warned += u64::from(told);
            if made % every == 0 {
                let set = &simulation.world.bodies;
                let (now, scale) = self.twist(set, &bodies);
                means.twisted = worse(means.twisted, now.distance(start.0) / scale);
                means.look(self, (set, &bodies), made as f64 * dt);
            }
        }
        Ok((means, (made, warned)))
    }

    /// The angular momentum about the origin, and the scale of its errors.
    fn twist(&self, set: &RigidBodySet, bodies: &[RigidBodyHandle]) -> (DVec3, f64) {
        let all = bodies.iter().zip(&self.motion.tops);
        all.fold((DVec3::ZERO, 0.0), |(sum, scale), (body, top)| {
            let state = seen(set, *body, top.moments);
            let orbit = state.position.cross(state.velocity) * top.mass;
            let sizes = orbit.length() + state.momentum.length();
            (sum + orbit + state.momentum, scale + sizes)
        })
    }
}

impl Means {
    fn look(&mut self, crowd: &Crowd, world: (&RigidBodySet, &[RigidBodyHandle]), time: f64) {
        let (set, bodies) = world;
        let energy = crowd.motion.energy(set, bodies).unwrap_or(f64::NAN);
        self.energies.push([time, energy]);
        if time < 0.5 * DURATION {
            return;
        }
        let tops = bodies.iter().zip(&crowd.motion.tops);
        let states: Vec<State> = tops.map(|(it, top)| seen(set, *it, top.moments)).collect();
        for (number, (state, top)) in states.iter().zip(&crowd.motion.tops).enumerate() {
            let w = state.angvel(top.moments);
            self.kinetic[0] += 0.5 * top.mass * state.velocity.length_squared();
            self.kinetic[1] += 0.5 * state.momentum.dot(w);
            for other in &states[..number] {
                let bin = state.position.distance(other.position) / BIN;
                self.distances[(bin as usize).min(BINS - 1)] += 1.0;
            }
        }
    }

    /// The slope of the straight line through the energies, by least squares.
    fn slope(&self) -> f64 {
        let count = self.energies.len() as f64;
        let sums = |of: fn(&[f64; 2]) -> f64| self.energies.iter().map(of).sum::<f64>() / count;
        let (time, energy) = (sums(|it| it[0]), sums(|it| it[1]));
        let both = |it: &[f64; 2]| (it[0] - time) * (it[1] - energy);
        let squares = |it: &[f64; 2]| (it[0] - time).powi(2);
        let covariance: f64 = self.energies.iter().map(both).sum();
        covariance / self.energies.iter().map(squares).sum::<f64>()
    }

    fn errors(&self, reference: &Means, (start, kinetic): (f64, f64)) -> Vec<Measured> {
        let energies = self.energies.iter().map(|it| (it[1] - start).abs());
        let off = energies.fold(0.0, worse);
        let total = |it: &Means| it.kinetic[0] + it.kinetic[1];
        let shared = |it: &Means| it.kinetic[0] / it.kinetic[1];
        let all = |it: &Means| it.distances.iter().sum::<f64>();
        let bins = self.distances.iter().zip(&reference.distances);
        let apart = bins.map(|(a, b)| (a / all(self) - b / all(reference)).abs());
        let against = |found: f64, exact: f64| (found / exact - 1.0).abs();
        vec![
            Measured::new(Metric::EnergyDrift, self.slope().abs() / kinetic),
            Measured::new(Metric::PairDistances, 0.5 * apart.sum::<f64>()),
            Measured::new(Metric::Energy, off / kinetic),
            Measured::new(Metric::AngularMomentum, self.twisted),
            Measured::new(Metric::Temperature, against(total(self), total(reference))),
            Measured::new(
                Metric::Equipartition,
                against(shared(self), shared(reference)),
            ),
        ]
    }
}

/// The larger of both, or infinity if `other` is NaN, which `max` would ignore.
fn worse(most: f64, other: f64) -> f64 {
    match other.is_nan() {
        true => f64::INFINITY,
        false => most.max(other),
    }
}

impl Case for Crowd {
    fn about(&self) -> About {
        self.motion.about()
    }

    fn methods(&self) -> &'static [Method] {
        self.motion.methods()
    }

    fn is_quick(&self) -> bool {
        false
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        self.motion.set_up(method, dt)
    }

    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError> {
        let (means, (made, warned)) = self.observe(method, dt)?;
        let (simulation, bodies) = self.motion.simulation(method, dt, None)?;
        let start = self.motion.energy(&simulation.world.bodies, &bodies);
        let kinetic = self.motion.tops.iter().map(|top| {
            let state = &top.start;
            let spin = state.momentum.dot(state.angvel(top.moments));
            0.5 * (top.mass * state.velocity.length_squared() + spin)
        });
        let start = (start.unwrap_or(f64::NAN), kinetic.sum());
        let mut errors = means.errors(self.reference(), start);
        if made < self.steps(dt)? {
            errors.iter_mut().for_each(|it| it.value = f64::INFINITY);
        }
        let evaluations = self.motion.evaluations(method, dt)?;
        Ok(run(
            &self.about(),
            (method, dt),
            (made, warned),
            evaluations,
            errors,
        ))
    }
}

/// Molecules on a cubic lattice, 8 Å apart, with random attitudes.
fn lattice() -> Vec<State> {
    let mut random = Random::new(1);
    let place = |cell: usize| 8.0 * (cell as f64 - 1.5);
    let poses = (0..64).map(|cell| State {
        position: DVec3::new(place(cell / 16), place(cell / 4 % 4), place(cell % 4)),
        rotation: random.rotation(),
        ..State::default()
    });
    poses.collect()
}

/// The drop of `tests/data/b_cluster32`.
fn drop() -> Vec<State> {
    let read = || -> Result<Vec<State>, StudyError> {
        let table = Table::parse(DROP)?;
        let pose = |row: crate::study::Row<'_>| {
            Ok(State {
                position: row.vector("", "")?,
                rotation: row.rotation()?,
                ..State::default()
            })
        };
        table.rows().map(pose).collect()
    };
    read().expect("a table that the tests read")
}

/// Adds the velocities of an ideal gas of rigid rotors at `temperature`, K, with total momentum zero.
fn thermal(mut states: Vec<State>, temperature: f64) -> Vec<State> {
    let mut random = Random::new(2);
    let thermal = BOLTZMANN * temperature;
    for state in &mut states {
        state.velocity = random.normal_vector() * (thermal / MASS).sqrt();
        let sigma = DVec3::from_array(PRINCIPAL_INERTIA.map(|it| (thermal * it).sqrt()));
        state.momentum = state.rotation * (sigma * random.normal_vector());
    }
    let mean = states.iter().map(|it| it.velocity).sum::<DVec3>() / states.len() as f64;
    states.iter_mut().for_each(|it| it.velocity -= mean);
    states
}

/// Forces of the molecules and of the wall, without fields.
fn walled(radius: f64) -> Forces {
    let (between, radius) = (forces(), real(radius));
    Arc::new(move |sites, forces| {
        between(sites, forces);
        for (site, force) in sites.iter().zip(forces).step_by(ATOMS) {
            let distance = site.world_point.length();
            if distance > radius {
                *force -= site.world_point * (real(WALL) * (1.0 - radius / distance));
            }
        }
    })
}

fn walled_potential(radius: f64) -> Potential {
    let between = potential();
    Arc::new(move |sites: &[Site]| {
        let out = |site: &Site| to_dvec3(site.world_point).length() - radius;
        let wall = sites.iter().step_by(ATOMS).map(out);
        let wall: f64 = wall
            .filter(|it| *it > 0.0)
            .map(|it| 0.5 * WALL * it * it)
            .sum();
        between(sites) + wall
    })
}
