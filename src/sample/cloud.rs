//! Samples of parts that are sampled at many points, in columns: what stays of them while bodies move.

use super::point::{Kind, SamplePoint};
use crate::math::Real;

/// Runs are padded to a multiple of this.
const PADDING: usize = 8;

/// The samples that are no sites, part by part. Where they are follows from how their bodies stand.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clouds {
    pub runs: Vec<CloudRun>,
    /// From the centre of mass, in the axes of the body.
    pub local_arms: [Vec<Real>; 3],
    /// Which fraction of its part each stands for; zero if it is there to fill up.
    pub fractions: Vec<Real>,
}

/// The samples of one kind of a part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CloudRun {
    /// The number of one of them among all samples: they differ in their places and fractions only.
    pub first: u32,
    start: u32,
    end: u32,
}

impl CloudRun {
    /// Where they are in the columns.
    pub(crate) fn places(&self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

impl Clouds {
    /// Of samples whose numbers begin with `first`.
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
