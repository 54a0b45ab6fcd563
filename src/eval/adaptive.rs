//! Bodies that straddle the border of a region, cut into cells where it passes.
//!
//! A cell is sampled at the centre of what it holds. Where no border passes through it, that is
//! right for forces that vary linearly. Where one does, the force may be another in a part of the
//! cell nobody knows, so the cell's error is bounded by the largest change that any choice of the
//! regions concerned makes to its force, times the part of the cell that may lie beyond. The cell with the largest bound is cut first.

use std::collections::BinaryHeap;

use super::contract::{BatchEvaluator, Scene, Sums};
use super::frames::FrameCache;
use super::instances::Reach;
use super::interpreter::{Interpreter, RegionOverride, SampleContext, boundaries_within};
use super::programs::Programs;
use super::quantity::WrenchError;
use crate::compile::Program;
use crate::field::{Frame, Frames, Motion, Query, real};
use crate::math::{DMat3, DVec3, Real, from_dvec3, from_f64, to_dvec3, to_f64};
use crate::rigid::Wrench;
use crate::sample::{Cell, Moment, Samples, Solid};

/// Cells of one body in one term, at most.
const MOST_CELLS: usize = 4096;

/// A part is cut into this many cells whether or not a border passes, so that forces that vary
/// over it are sampled about as finely as over a whole volume.
const FEWEST_CELLS: usize = 32;

/// Regions whose borders pass through one cell, at most, for its error to be bounded: all of
/// their choices are tried.
const MOST_BORDERS: u32 = 6;

/// A term and all it is sampled with.
struct Bordered<'a> {
    program: &'a Program,
    frames: &'a [Option<Frame>],
    samples: &'a Samples,
    moment: Moment,
}

/// A cell with the force on it.
#[derive(Clone, Copy, Debug)]
struct Sampled {
    cell: Cell,
    solid: u32,
    arm: DVec3,
    force: DVec3,
    /// How far off the force may be.
    error: f64,
}

impl Sampled {
    fn torque_error(&self) -> f64 {
        self.error * (self.arm.length() + self.cell.radius())
    }
}

/// A sum over cells.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    force: DVec3,
    torque: DVec3,
    force_error: f64,
    torque_error: f64,
}

impl Sum {
    fn add(&mut self, sampled: &Sampled, sign: f64) {
        self.force += sampled.force * sign;
        self.torque += sampled.arm.cross(sampled.force) * sign;
        self.force_error += sampled.error * sign;
        self.torque_error += sampled.torque_error() * sign;
    }

    /// Whether the error is small enough; not if it is NaN.
    fn is_within(&self, tolerance: f64, radius: f64) -> bool {
        let size = self.force.length() + self.torque.length() / radius;
        self.force_error + self.torque_error / radius <= tolerance * size
    }
}

/// Evaluates programs, adaptively on the bodies that are sampled so; keeps its buffers between
/// calls.
#[derive(Debug, Default)]
pub(super) struct Adaptive {
    refiner: Refiner,
    programs: Programs,
}

impl Adaptive {
    /// Starts a new evaluation.
    pub(super) fn forget(&mut self, samples: &Samples) {
        self.refiner.forget(samples);
    }

    /// The bound of the error of the last wrench on a body, by its number.
    pub(super) fn error(&self, body: usize) -> Option<WrenchError> {
        self.refiner.error(body)
    }
}

impl BatchEvaluator<Program> for Adaptive {
    fn begin(&mut self, scene: &Scene<'_, impl Frames>, frames: &mut FrameCache) {
        self.programs.begin(scene, frames);
    }

    fn add(
        &mut self,
        (number, program): (u32, &Program),
        scene: &Scene<'_, impl Frames>,
        frames: &mut FrameCache,
        sums: &mut Sums<'_>,
    ) {
        frames.fill(scene.compiled, scene.world, program);
        let field = Bordered {
            program,
            frames: frames.all(),
            samples: scene.samples,
            moment: scene.moment,
        };
        let (reach, machine) = self.programs.tools(number);
        self.refiner.run(&field, reach, machine, sums.wrenches);
        let wanted = |body| !self.refiner.has_done(body);
        self.programs
            .add_where((number, program), scene, frames, sums, wanted);
    }
}

/// Samples bodies adaptively.
#[derive(Debug, Default)]
struct Refiner {
    /// By body: whether the present term has been dealt with.
    done: Vec<bool>,
    /// By body: the bounds, summed over terms.
    errors: Vec<Option<WrenchError>>,
    instances: Vec<u32>,
    /// Those that a part is cut into first.
    coarse: Vec<Cell>,
    cells: Heap,
}

/// The cells of a body, the worst of them first at hand.
#[derive(Debug, Default)]
struct Heap {
    cells: Vec<Sampled>,
    /// Errors, as bits, and the cells they belong to.
    order: BinaryHeap<(u64, u32)>,
}

impl Heap {
    fn clear(&mut self) {
        self.cells.clear();
        self.order.clear();
    }

    /// Puts a cell in the place of another, or at the end.
    fn keep(&mut self, place: usize, sampled: Sampled) {
        if sampled.error > 0.0 {
            self.order.push((sampled.error.to_bits(), place as u32));
        }
        match self.cells.get_mut(place) {
            Some(cell) => *cell = sampled,
            None => self.cells.push(sampled),
        }
    }

    /// The cell of the largest error, with its place; `None` if none has any.
    fn worst(&mut self) -> Option<(usize, Sampled)> {
        let (_, place) = self.order.pop()?;
        Some((place as usize, self.cells[place as usize]))
    }
}

impl Refiner {
    /// Starts a new evaluation.
    fn forget(&mut self, samples: &Samples) {
        let count = match samples.solids.is_empty() {
            true => 0,
            false => samples.bodies.len(),
        };
        self.errors.clear();
        self.errors.resize(count, None);
        self.done.clear();
        self.done.resize(count, false);
    }

    fn error(&self, body: usize) -> Option<WrenchError> {
        self.errors.get(body).copied().flatten()
    }

    /// Whether a body needs no further samples in the present term.
    fn has_done(&self, body: u32) -> bool {
        self.done.get(body as usize).is_some_and(|done| *done)
    }

    /// Adds the wrenches of a term on those bodies that are sampled adaptively and that a border
    /// passes through.
    fn run(
        &mut self,
        field: &Bordered<'_>,
        reach: &Reach,
        machine: &mut Interpreter,
        wrenches: &mut [Wrench],
    ) {
        self.done.fill(false);
        let how = field.program.how;
        for solids in field.samples.solids.chunk_by(|a, b| a.body == b.body) {
            let body = solids[0].body;
            let (sampling, _) = field.samples.sampling(how, body);
            let Some(tolerance) = sampling.tolerance() else {
                continue;
            };
            let sum = self.body(field, solids, reach, machine, to_f64(tolerance));
            let total = self.errors[body as usize].get_or_insert_default();
            let Some(sum) = sum else {
                continue;
            };
            total.force += from_f64(sum.force_error);
            total.torque += from_f64(sum.torque_error);
            let wrench = &mut wrenches[body as usize];
            wrench.force += from_dvec3(sum.force);
            wrench.torque += from_dvec3(sum.torque);
            self.done[body as usize] = true;
        }
    }

    /// The wrench on one body, unless no border passes through it.
    fn body(
        &mut self,
        field: &Bordered<'_>,
        solids: &[Solid],
        reach: &Reach,
        machine: &mut Interpreter,
        tolerance: f64,
    ) -> Option<Sum> {
        let centre = &field.samples.centres[solids[0].body as usize];
        let com = to_dvec3(centre.world_point);
        let farthest = |solid: &Solid| {
            let root = solid.cells.root();
            (solid.pose.transform_point(root.centre) - com).length() + root.radius()
        };
        let radius = solids.iter().map(farthest).fold(0.0, f64::max);
        // Rounded up, not to lose what only just reaches.
        let near = from_f64(radius) * (1.0 + Real::EPSILON * 4.0);
        reach.near(
            field.program,
            (centre.world_point, near),
            &mut self.instances,
        );
        if self.instances.is_empty() {
            return None;
        }
        let (instances, found) = (&self.instances, &mut self.cells);
        found.clear();
        let mut sum = Sum::default();
        for (number, solid) in solids.iter().enumerate() {
            let mut sampler = Sampler::new(field, solid, com, machine, instances);
            solid.cells.cut(FEWEST_CELLS, &mut self.coarse);
            for cell in &self.coarse {
                let sampled = sampler.sample(cell, number);
                sum.add(&sampled, 1.0);
                found.keep(found.cells.len(), sampled);
            }
        }
        while found.cells.len() < MOST_CELLS && !sum.is_within(tolerance, radius) {
            let Some((place, worst)) = found.worst() else {
                break;
            };
            let solid = &solids[worst.solid as usize];
            let mut sampler = Sampler::new(field, solid, com, machine, instances);
            sum.add(&worst, -1.0);
            let places = [place, found.cells.len()];
            for (half, place) in solid.cells.halves(&worst.cell).iter().zip(places) {
                let sampled = sampler.sample(half, worst.solid as usize);
                sum.add(&sampled, 1.0);
                found.keep(place, sampled);
            }
        }
        // Anew, without the roundings of what was added and taken away.
        let mut sum = Sum::default();
        found.cells.iter().for_each(|sampled| sum.add(sampled, 1.0));
        let straddles = found.cells.iter().any(|sampled| sampled.error > 0.0);
        straddles.then_some(sum)
    }
}

/// Samples the cells of one part.
struct Sampler<'a> {
    field: &'a Bordered<'a>,
    solid: &'a Solid,
    /// The body's centre of mass, and its velocity.
    com: DVec3,
    linvel: DVec3,
    machine: &'a mut Interpreter,
    instances: &'a [u32],
    query: Query,
}

impl<'a> Sampler<'a> {
    fn new(
        field: &'a Bordered<'a>,
        solid: &'a Solid,
        com: DVec3,
        machine: &'a mut Interpreter,
        instances: &'a [u32],
    ) -> Self {
        let samples = field.samples;
        let site = &samples.list[solid.site as usize];
        Sampler {
            field,
            solid,
            com,
            linvel: to_dvec3(samples.centres[solid.body as usize].velocity),
            machine,
            instances,
            query: samples.query(site, field.moment),
        }
    }

    fn sample(&mut self, cell: &Cell, solid: usize) -> Sampled {
        let Bordered {
            program, frames, ..
        } = *self.field;
        let pose = &self.solid.pose;
        let world_point = pose.transform_point(cell.centre);
        let arm = world_point - self.com;
        let edges = cell.high - cell.low;
        let turned = DMat3::from_quat(pose.rotation);
        self.query.world_point = world_point;
        self.query.world_velocity = self.linvel + self.solid.angvel.cross(arm);
        self.query.fraction = cell.content;
        self.query.spread =
            turned * DMat3::from_diagonal(edges * edges / 12.0) * turned.transpose();
        let motion = Motion::of(&self.query);
        let (mut total, mut error) = (DVec3::ZERO, 0.0);
        let spin = self.solid.angvel.length();
        for instance in self.instances {
            let place = SampleContext {
                program,
                instance: *instance as usize,
                frames,
                query: &self.query,
                motion: &motion,
                overridden: RegionOverride::default(),
                watched: None,
            };
            let mut force = |overridden: RegionOverride| {
                let outcome = self.machine.run_at(&SampleContext {
                    overridden,
                    ..place
                });
                outcome.map_or(DVec3::ZERO, |outcome| real(&outcome.force))
            };
            let here = force(RegionOverride::default());
            total += here;
            let bordering = boundaries_within(&place, (cell.radius(), spin));
            error += bordering.map_or(f64::INFINITY, |(which, nearest)| {
                let change =
                    largest_change(which, here, |holds| force(RegionOverride { which, holds }));
                // As near as the border is not, the force is that of the centre.
                change * (1.0 - cell.within(nearest))
            });
        }
        Sampled {
            cell: *cell,
            solid: solid as u32,
            arm,
            force: total,
            error,
        }
    }
}

/// The largest change of a force over all choices of some regions, which are given by bits.
fn largest_change(which: u64, here: DVec3, mut force: impl FnMut(u64) -> DVec3) -> f64 {
    if which == 0 {
        return 0.0;
    }
    if which.count_ones() > MOST_BORDERS {
        return f64::INFINITY;
    }
    let (mut holds, mut largest) = (which, 0.0_f64);
    loop {
        let change = (force(holds) - here).length();
        // A force that is not finite bounds nothing.
        largest = if change.is_nan() {
            f64::INFINITY
        } else {
            largest.max(change)
        };
        if holds == 0 || largest == f64::INFINITY {
            return largest;
        }
        holds = (holds - 1) & which;
    }
}
