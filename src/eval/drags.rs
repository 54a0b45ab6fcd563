//! Drag and wind in closed form, with derivatives, which each step needs of bodies in them.

use fearless_simd::{Simd, dispatch};

use super::lanes::level;
use super::quantity::Terms;
use crate::compile::{Instruction, Program};
use crate::field::{
    Axis, ForceMode, Formula, Frame, Linearised, LocalQuery, Open, Query, Scalar, real,
};
use crate::math::{DVec3, Vector, to_f64};
use crate::rigid::Slowing;
use crate::sample::{Moment, SamplePoint};

/// An instance of a program that [is one drag or wind](Program::as_drag), in a step.
#[derive(Clone, Copy)]
pub(super) struct DragOn {
    rates: [f64; 2],
    strength: f64,
    /// The share of the step in which it acts.
    share: f64,
    mode: ForceMode,
    dt: f64,
}

impl DragOn {
    pub(super) fn new(program: &Program, instance: usize, moment: Moment) -> Option<Self> {
        let drag = program.as_drag()?;
        let field = &program.leaves[0];
        Some(DragOn {
            rates: [drag.linear, drag.quadratic].map(to_f64),
            strength: to_f64(program.strength(instance, 0)),
            share: field.lifetime.share_of(moment.span),
            mode: field.mode,
            dt: to_f64(moment.dt),
        })
    }

    /// The derivative by velocity of its `force` on a sample.
    pub(super) fn slowing(&self, sample: &SamplePoint, force: DVec3) -> Slowing {
        let weight = self.weight(sample) * self.strength * self.share;
        Slowing::of_drag(force, weight, self.rates)
    }

    /// The factor from the vector of a field that is shared out by mass to a force on a sample.
    fn weight(&self, sample: &SamplePoint) -> f64 {
        let mass = to_f64(sample.mass);
        let whole = match self.mode {
            ForceMode::Force => to_f64(sample.share),
            ForceMode::Acceleration => mass,
            ForceMode::VelocityChange => mass / self.dt,
        };
        whole * to_f64(sample.fraction)
    }
}

/// The force of a program that is one drag, with its derivatives, in closed form; `None` where there is none. The
/// derivative by place is right only with [`Terms::All`].
pub(super) fn drag_on(
    program: &Program,
    instance: usize,
    frames: &[Option<Frame>],
    query: &Query,
    terms: Terms,
) -> Option<Linearised> {
    let ([Instruction::Leaf(0)], [leaf]) = (&program.steps[..], &program.leaves[..]) else {
        return None;
    };
    let frame = program.frame(instance, 0, frames)?;
    let everywhere = leaf.region.is_everywhere();
    let still = frame.angvel == Vector::ZERO && everywhere && leaf.scale.is_none();
    let reads_velocity = |scale: &Scalar| scale.axes().any(Axis::reads_velocity);
    let known = match terms {
        Terms::All => still,
        _ => !leaf.scale.as_ref().is_some_and(reads_velocity),
    };
    if !known || !leaf.acts_on(query, frame) {
        return None;
    }
    let local = LocalQuery::new(query, frame);
    if !everywhere {
        let open = Open::<f64>::new();
        let defined = leaf.region.set(&local, &open);
        if open.on_a_surface() {
            return None;
        }
        if !defined {
            return Some(Linearised::default());
        }
    }
    let flow = |flow: &Formula| flow_of(flow, &local, terms);
    leaf.drag_of(program.strength(instance, 0), &local, flow)
}

/// The flow at a sample; `None` if its derivatives are needed and may not be zero.
fn flow_of(flow: &Formula, local: &LocalQuery<'_>, terms: Terms) -> Option<DVec3> {
    let here = || real(flow.vector(local));
    match flow {
        Formula::Uniform(_) => Some(here()),
        _ if terms == Terms::All || flow.reads_velocity() => None,
        Formula::Turbulence(law) => {
            let (point, time) = (local.local_point(), local.query.time);
            Some(dispatch!(level(), simd => simd.vectorize(
                #[inline(always)]
                || law.flow(point, time),
            )))
        }
        _ => Some(here()),
    }
}

#[cfg(test)]
mod tests;
