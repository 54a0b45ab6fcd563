//! Programs on bodies that borders cut: each piece is evaluated separately.

use crate::compile::Program;
use crate::field::{Border, Cuts, Frame, Query};
use crate::math::{DVec3, to_dvec3};
use crate::sample::{Cutter, Moment, Samples};

/// The sample at which an instance of a program is evaluated on a body that may be cut.
pub(super) enum SampleOf<'a> {
    /// At the centre of mass, since no border is near.
    Whole(&'a Query),
    /// At a piece, with the weight and the lever arm of the force on it.
    Piece(&'a Query, f64, DVec3),
}

/// A body that borders may cut, among the samples of a moment.
#[derive(Clone, Copy)]
pub(super) struct CutBody<'a> {
    pub samples: &'a Samples,
    pub moment: Moment,
    pub number: u32,
}

/// Finds the borders near bodies, and cuts bodies there. Keeps its buffers between calls.
#[derive(Debug, Default)]
pub(super) struct BodyCuts {
    cutter: Cutter,
    borders: Vec<Border>,
}

impl BodyCuts {
    /// Calls `ask` for some instances, whose frames have been looked up, on a body that the program cuts: once
    /// for the whole body, or once for each of its pieces.
    pub(super) fn each(
        &mut self,
        program: &Program,
        frames: &[Option<Frame>],
        instances: impl Iterator<Item = usize>,
        body: CutBody<'_>,
        mut ask: impl FnMut(usize, SampleOf<'_>),
    ) {
        let CutBody {
            samples,
            moment,
            number: body,
        } = body;
        let rule = program.sampling_rule;
        let Some(bulk) = samples.cut(rule, body) else {
            return;
        };
        let centre = &samples.centres[body as usize];
        let query = samples.query(centre, moment);
        let point = to_dvec3(centre.world_point);
        for instance in instances {
            self.borders.clear();
            for (number, field) in program.leaves.iter().enumerate() {
                if let Some(frame) = program.frame(instance, number, frames)
                    && field.is_on(moment.span)
                    && !frame.carries(&query)
                {
                    Border::near(field, frame, point, bulk.extent, &mut self.borders);
                }
            }
            if self.borders.is_empty() && rule.cuts == Cuts::Bodies {
                ask(instance, SampleOf::Whole(&query));
                continue;
            }
            for piece in self.cutter.body(samples, body, &self.borders) {
                let (query, weight, arm) = samples.of_piece(rule, body, piece, moment);
                ask(instance, SampleOf::Piece(&query, weight, arm));
            }
        }
    }
}
