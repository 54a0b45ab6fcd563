//! Radial fields of very many sources: distant sources act together (Barnes & Hut, Nature 324, 1986).
//!
//! The sources are divided into cells within cells, each into two with the same number of sources. A cell that
//! appears smaller than the opening angle from all of eight neighbouring samples acts by its moments, up to the
//! second, about the centre of its strengths. Other cells are opened, down to single sources. A cell with sources
//! of a sampled body is opened, and these sources are left out.

mod cells;
mod halves;
mod walk;

use std::ops::Range;

use super::contract::Sums;
use super::one_way::Task;
use super::quantity::Quantity;
use super::sources::present;
use crate::compile::{AnchorId, IndexKind, RadialBatch};
use crate::field::{Frame, Linearised};
use crate::math::{DMat3, DVec3, Vector, from_dvec3, to_dvec3, to_f64};
use crate::rigid::Wrench;
use crate::sample::{CloudRun, Moment, SamplePoint, Samples};
use crate::threads::each_chunk;
use cells::{CellTree, Source};
use walk::{Block, CellWalk, WIDTH};

/// Blocks of samples that one thread evaluates at a time.
const CHUNK: usize = 8;

/// Evaluates batches by cells; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(super) struct FarRadials {
    /// The cells of each batch.
    cells: Vec<CellTree>,
    sources: Vec<Source>,
    /// The indices of the sites that are acted on.
    order: Vec<u32>,
    blocks: Vec<Block>,
}

/// Returns true if a batch is to be evaluated by cells, and has enough sources for that.
pub(super) fn is_far(batch: &RadialBatch) -> bool {
    batch.index_kind() == IndexKind::Cells
}

impl FarRadials {
    /// Adds the forces of a batch on all samples. Returns false, and adds nothing, where [`CellWalk::new`] gives
    /// `None`.
    pub(super) fn add(
        &mut self,
        task: &Task<'_>,
        frame: impl FnMut(AnchorId) -> Option<Frame>,
        moment: Moment,
        sums: &mut Sums<'_>,
    ) -> bool {
        self.sort(task.number, task.batch, frame, task.quantity);
        let cells = &self.cells[task.number as usize];
        let Some(walk) = CellWalk::new(cells, &task.batch.law, task.quantity) else {
            return false;
        };
        let blocks = &mut self.blocks;
        add_to_sites(&walk, task, &mut self.order, blocks, sums.forces);
        add_to_clouds(&walk, task, moment, blocks, sums.wrenches);
        true
    }

    /// Sorts the sources of a batch, with anchors at their present places, into cells.
    pub(super) fn sort(
        &mut self,
        number: u32,
        batch: &RadialBatch,
        frame: impl FnMut(AnchorId) -> Option<Frame>,
        quantity: Quantity,
    ) {
        let number = number as usize;
        if self.cells.len() <= number {
            self.cells.resize_with(number + 1, CellTree::default);
        }
        let cells = &mut self.cells[number];
        // Sources that stand still are sorted once.
        let stamp = (batch.moving == 0).then_some(batch.log.stamp);
        if stamp.is_none() || cells.made_for != stamp {
            let present = present(&batch.sources, frame, quantity);
            let source = |(point, strength, owner)| Source {
                point: to_dvec3(point),
                strength: to_f64(strength),
                owner: to_f64(owner),
            };
            self.sources.clear();
            self.sources.extend(present.map(source));
            cells.made_for = stamp;
            cells.sort(&self.sources);
        }
    }

    /// Adds the force of a sorted batch on a sample, with derivatives. Returns false, and adds nothing, where
    /// [`CellWalk::new`] gives `None`.
    pub(super) fn linearise(
        &self,
        number: u32,
        batch: &RadialBatch,
        sample: &SamplePoint,
        weight: f64,
        sum: &mut Linearised,
    ) -> bool {
        let cells = &self.cells[number as usize];
        let walk = CellWalk::new(cells, &batch.law, Quantity::Force);
        walk.is_some_and(|walk| {
            walk.linearise(sample, weight, sum);
            true
        })
    }
}

/// Adds the forces on the sites that the batch acts on; `order` and `blocks` are buffers.
fn add_to_sites(
    walk: &CellWalk<'_>,
    task: &Task<'_>,
    order: &mut Vec<u32>,
    blocks: &mut Vec<Block>,
    sums: &mut [Vector],
) {
    let sites = &task.samples.sites;
    let coupled = |place: &u32| task.weights[*place as usize] != 0.0;
    order.clear();
    order.extend((0..sites.len() as u32).filter(coupled));
    // Neighbouring sites open the same cells, so they share a block.
    let point = |place: &u32| to_dvec3(sites[*place as usize].world_point);
    halves::gather(order, WIDTH, &point);
    let of = |number: usize| order.chunks(WIDTH).skip(number);
    blocks.resize_with(order.len().div_ceil(WIDTH), Block::default);
    each_chunk(blocks, CHUNK, |first, blocks| {
        for (block, places) in blocks.iter_mut().zip(of(first)) {
            let samples = places.iter().map(|place| &sites[*place as usize]);
            let points = samples.map(|it| (to_dvec3(it.world_point), to_f64(it.owner)));
            walk.on(points, block);
        }
    });
    for (block, places) in blocks.iter().zip(of(0)) {
        for (place, sum) in places.iter().zip(block.sums()) {
            let place = *place as usize;
            sums[place] += from_dvec3(sum) * task.weights[place];
        }
    }
}

/// Adds the wrenches on the samples of clouds.
fn add_to_clouds(
    walk: &CellWalk<'_>,
    task: &Task<'_>,
    moment: Moment,
    blocks: &mut Vec<Block>,
    sums: &mut [Wrench],
) {
    for (run, body, weight) in task.clouds(moment) {
        let wrench = on_cloud(walk, task.samples, run, blocks);
        sums[body] = sums[body].plus(wrench.times(weight));
    }
}

/// The wrench on a part with several samples, for a weight of one.
fn on_cloud(
    walk: &CellWalk<'_>,
    samples: &Samples,
    run: &CloudRun,
    blocks: &mut Vec<Block>,
) -> Wrench {
    let body = run.whole.body as usize;
    let turned = DMat3::from_quat(samples.attitudes[body].rotation);
    let centre = to_dvec3(samples.centres[body].world_point);
    let arm = |at: usize| turned * DVec3::from_array(samples.clouds.arm(at).map(to_f64));
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    let Range { start, end } = run.places();
    let of = |number: usize| {
        let first = start + number * WIDTH;
        first..end.min(first + WIDTH)
    };
    blocks.resize_with((end - start).div_ceil(WIDTH), Block::default);
    each_chunk(blocks, CHUNK, |first, blocks| {
        for (number, block) in blocks.iter_mut().enumerate() {
            let point = |at| (centre + arm(at), to_f64(run.whole.owner));
            walk.on(of(first + number).map(point), block);
        }
    });
    for (number, block) in blocks.iter().enumerate() {
        for (at, sum) in of(number).zip(block.sums()) {
            let part = sum * to_f64(samples.clouds.fractions[at]);
            force += part;
            torque += arm(at).cross(part);
        }
    }
    Wrench {
        force: from_dvec3(force),
        torque: from_dvec3(torque),
    }
}
