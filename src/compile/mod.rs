//! Compiles a tree into flat batches and a plan.
//!
//! The forces of the operands of the outermost sum of union add up, so each operand (a term) can be evaluated
//! in the way that suits it best:
//!
//! - radial fields that differ only in strength and anchor become one [`RadialBatch`];
//! - an unbounded uniform field becomes a constant ([`ConstantField`]);
//! - detection fields go to the detector ([`DetectionField`]) and cost the force pass nothing;
//! - any other term becomes a postfix [`Program`], with one instance for each of its anchors.

mod anchors;
mod at_centres;
mod batches;
mod compiled;
mod cost;
mod entries;
mod extent;
mod follow;
mod index_kind;
mod instances;
mod lower;
mod ordered;
pub mod plan;
mod program;
mod program_log;
mod reach;
mod requirements;
mod term_flags;

pub(crate) use anchors::{AnchorId, NO_ANCHOR};
pub(crate) use at_centres::AtCentres;
pub(crate) use compiled::{Compiled, Prepared};
pub(crate) use entries::{
    ConstantField, DetectionField, FieldMask, RadialBatch, RadialSource, Weighting,
};
pub(crate) use extent::Bounds;
pub(crate) use index_kind::IndexKind;
pub(crate) use ordered::{Key, Keyed, Ordered, unique};
pub(crate) use plan::Plan;
pub(crate) use program::{Instruction, Program};
pub(crate) use program_log::Followed;
pub(crate) use reach::FieldReach;
pub(crate) use requirements::{PartSampling, SamplingRequirements};
