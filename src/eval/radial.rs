//! Evaluates batches of radial fields: pair by pair, by cells, or one way, whichever suits the batch.

use super::contract::{BatchEvaluator, Summing};
use super::far::{FarRadials, is_far};
use super::one_way::{OneWayRadials, Task, weigh};
use super::pairwise::{PairwiseRadials, Sides};
use super::quantity::Quantity;
use crate::compile::{Ordered, RadialBatch};
use crate::field::Frames;
use crate::math::Real;

/// Evaluates radial batches; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(super) struct Radials {
    one_way: OneWayRadials,
    pairwise: PairwiseRadials,
    far: FarRadials,
    weights: Vec<Real>,
}

impl BatchEvaluator<Ordered<RadialBatch>> for Radials {
    fn add(&mut self, _: u32, batches: &Ordered<RadialBatch>, on: &mut Summing<'_, impl Frames>) {
        self.add_quantity(batches, on, Quantity::Force);
    }
}

impl Radials {
    /// Adds the forces on all samples; or, in place of their first components, the potentials of those laws that
    /// have one.
    pub(super) fn add_quantity(
        &mut self,
        batches: &Ordered<RadialBatch>,
        on: &mut Summing<'_, impl Frames>,
        quantity: Quantity,
    ) {
        let (scene, frames, sums) = (on.scene, &mut *on.frames, &mut on.sums);
        let (samples, moment) = (scene.samples, scene.moment);
        let known = |batch: &RadialBatch| quantity == Quantity::Force || batch.law.has_potential();
        let is_on = |batch: &RadialBatch| batch.prototype.is_on(moment.span) && known(batch);
        let batches = batches.iter().filter(|(_, batch)| is_on(batch));
        let on_colliders = |batch: &RadialBatch| batch.on_colliders > 0 && !is_far(batch);
        let on_colliders = batches.clone().filter(|(_, batch)| on_colliders(batch));
        self.pairwise
            .take_up(on_colliders, samples, moment, Sides::are_worth_it);
        for (number, batch) in batches {
            let mut frame = |anchor| frames.get(scene, anchor);
            if self.pairwise.has(number) {
                self.pairwise
                    .add_others(number, batch, scene, quantity, frame, sums);
                continue;
            }
            weigh(batch, samples, moment, &mut self.weights);
            let task = Task {
                number,
                batch,
                samples,
                weights: &self.weights,
                quantity,
            };
            if !is_far(batch) || !self.far.add(&task, &mut frame, moment, sums) {
                self.one_way.run(&task, frame, moment, sums);
            }
        }
        self.pairwise.meet(samples, quantity, sums.forces);
    }
}

#[cfg(test)]
mod by_themselves {
    //! Both evaluators by themselves: on any batch they differ in rounding only.

    use super::*;

    impl BatchEvaluator<Ordered<RadialBatch>> for OneWayRadials {
        fn add(
            &mut self,
            _: u32,
            batches: &Ordered<RadialBatch>,
            on: &mut Summing<'_, impl Frames>,
        ) {
            let (scene, mut weights) = (on.scene, Vec::new());
            let is_on = |batch: &RadialBatch| batch.prototype.is_on(scene.moment.span);
            for (number, batch) in batches.iter().filter(|(_, batch)| is_on(batch)) {
                weigh(batch, scene.samples, scene.moment, &mut weights);
                let task = Task {
                    number,
                    batch,
                    samples: scene.samples,
                    weights: &weights,
                    quantity: Quantity::Force,
                };
                let frame = |anchor| on.frames.get(scene, anchor);
                self.run(&task, frame, scene.moment, &mut on.sums);
            }
        }
    }

    impl BatchEvaluator<Ordered<RadialBatch>> for PairwiseRadials {
        fn add(
            &mut self,
            _: u32,
            batches: &Ordered<RadialBatch>,
            on: &mut Summing<'_, impl Frames>,
        ) {
            let (scene, force) = (on.scene, Quantity::Force);
            let samples = scene.samples;
            let is_on = |batch: &RadialBatch| batch.prototype.is_on(scene.moment.span);
            let batches = batches.iter().filter(|(_, batch)| is_on(batch));
            self.take_up(batches.clone(), samples, scene.moment, |_, _| true);
            for (number, batch) in batches {
                let frame = |anchor| on.frames.get(scene, anchor);
                self.add_others(number, batch, scene, force, frame, &mut on.sums);
            }
            self.meet(samples, force, on.sums.forces);
        }
    }
}
