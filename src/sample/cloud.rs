//! Columns of the samples of parts that have several: the numbers that stay the same while bodies move.

use super::point::{Kind, SamplePoint};
use crate::math::Real;

/// The length of a run is padded to a multiple of this.
const PADDING: usize = 8;

/// The samples that are not sites, part by part. Their places follow from the poses of their bodies.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clouds {
    pub runs: Vec<CloudRun>,
    /// From the centre of mass, in the axes of the body.
    pub local_arms: [Vec<Real>; 3],
    /// The fraction of its part that each stands for; zero for padding.
    pub fractions: Vec<Real>,
}

/// The samples of one kind in one part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CloudRun {
    /// The number of the first in the list of samples: they differ only in place and fraction.
    pub first: u32,
    start: u32,
    end: u32,
}

impl CloudRun {
    /// Their range in the columns.
    pub(crate) fn places(&self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

impl Clouds {
    /// Takes the columns of samples whose numbers in the list begin with `first`.
    pub(super) fn fill(&mut self, first: usize, samples: &[SamplePoint]) {
        self.clear();
        let of_one = |a: &SamplePoint, b: &SamplePoint| {
            let part = |it: &SamplePoint| (it.body, it.kind, it.collider);
            part(a) == part(b) && a.kind != Kind::Centre
        };
        let mut number = first;
        for samples in samples.chunk_by(of_one) {
            let start = self.fractions.len() as u32;
            let filled = samples.len().next_multiple_of(PADDING) - samples.len();
            let filling = SamplePoint {
                fraction: 0.0,
                ..samples[0]
            };
            samples.iter().for_each(|sample| self.push(sample));
            (0..filled).for_each(|_| self.push(&filling));
            self.runs.push(CloudRun {
                first: number as u32,
                start,
                end: self.fractions.len() as u32,
            });
            number += samples.len();
        }
    }

    fn push(&mut self, sample: &SamplePoint) {
        for (column, x) in self.local_arms.iter_mut().zip(sample.local_arm.to_array()) {
            column.push(x);
        }
        self.fractions.push(sample.fraction);
    }

    pub(super) fn clear(&mut self) {
        self.runs.clear();
        self.local_arms.iter_mut().for_each(Vec::clear);
        self.fractions.clear();
    }
}
