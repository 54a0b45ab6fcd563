//! Compile: a tree becomes flat batches and a plan.
//!
//! The outermost sum of union falls into terms whose forces simply add up, so each can be
//! evaluated in whatever way suits it best:
//!
//! - radial fields that differ only in strength and anchor become one [`RadialBatch`];
//! - an unbounded uniform field becomes a constant ([`ConstantField`]);
//! - detection fields go to the detector ([`Detector`]) and cost the force pass nothing;
//! - every other term becomes a postfix [`Program`], with as many instances as it has anchors.

mod lower;
mod plan;
mod program;
mod requirements;

use crate::field::{Anchor, ContactLaw, Coupling, ForceMode, Radial, Sampling, SamplingRule, Tree};
use crate::math::{ColliderHandle, InteractionGroups, Real, Vector};

pub(crate) use plan::FEWEST_FOR_GRID;
pub use plan::{IndexKind, Plan, PlanEntry};
pub(crate) use program::{NO_ANCHOR, Program, Step};
pub(crate) use requirements::{PartSampling, SamplingRequirements};

/// Number of an anchor in [`Compiled::anchors`].
pub(crate) type AnchorId = u32;

/// A tree, ready for evaluation.
#[derive(Clone, Debug)]
pub(crate) struct Compiled {
    pub tree: Tree,
    pub anchors: Vec<Anchor>,
    pub constants: Vec<ConstantField>,
    pub radials: Vec<RadialBatch>,
    pub programs: Vec<Program>,
    pub detectors: Vec<Detector>,
    /// What bodies ask for in place of [`Sampling::Auto`](crate::field::Sampling).
    pub overrides: Vec<Sampling>,
    pub requirements: SamplingRequirements,
    pub plan: Plan,
}

impl Compiled {
    /// Whether any field can turn a body, by its force or by the answer to a contact.
    fn torque_possible(&self) -> bool {
        let turns =
            |program: &Program| program.has_force && program.how.sampling != Sampling::Centre;
        let answers = |detector: &Detector| detector.law != ContactLaw::Observe;
        !self.radials.is_empty()
            || !self.overrides.is_empty()
            || self.programs.iter().any(turns)
            || self.detectors.iter().any(answers)
    }

    /// How messages name the field at a place of the tree.
    pub(crate) fn label(&self, place: u32) -> String {
        self.tree.label(place)
    }
}

/// How the vector of a field becomes a force on a sample.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Weighting {
    pub mode: ForceMode,
    pub coupling: Coupling,
    pub groups: Option<InteractionGroups>,
}

/// The same vector for every body, whatever its place.
#[derive(Clone, Debug)]
pub(crate) struct ConstantField {
    pub leaf: u32,
    pub vector: Vector,
    pub mode: ForceMode,
}

/// Radial fields that differ in strength and anchor only.
#[derive(Clone, Debug)]
pub(crate) struct RadialBatch {
    /// The law for a strength of one.
    pub law: Radial,
    /// Radius of the ball the fields act in; without one they act everywhere.
    pub range: Option<Real>,
    pub weighting: Weighting,
    pub how: SamplingRule,
    pub sources: Vec<RadialSource>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct RadialSource {
    pub anchor: AnchorId,
    /// The collider whose origin it is at, if it is.
    pub collider: Option<ColliderHandle>,
    pub strength: Real,
    pub leaf: u32,
}

/// A detection field.
#[derive(Clone, Debug)]
pub(crate) struct Detector {
    pub leaf: u32,
    pub anchor: AnchorId,
    pub collider: ColliderHandle,
    pub law: ContactLaw,
    /// The program instance that says whether the field acts at a sample; without one it does
    /// everywhere.
    pub mask: Option<FieldMask>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct FieldMask {
    pub program: u32,
    pub instance: u32,
    /// Which of the program's leaves is the detection field.
    pub leaf: u32,
}
