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

use crate::field::{
    Anchor, ContactLaw, Coupling, Field, FieldSet, ForceMode, Radial, Sampling, SamplingRule,
};
use crate::math::{ColliderHandle, InteractionGroups, Real, Vector};

pub(crate) use plan::FEWEST_FOR_GRID;
pub use plan::{IndexKind, Plan, PlanEntry};
pub(crate) use program::{NO_ANCHOR, Program, Step};
pub(crate) use requirements::{PartSampling, SamplingRequirements};

/// Number of an anchor in [`Compiled::anchors`].
pub(crate) type AnchorId = u32;

/// A set of fields, ready for evaluation.
#[derive(Debug)]
pub(crate) struct Compiled {
    /// The revision of the set that it was made for.
    pub revision: u64,
    pub anchors: Vec<Anchor>,
    pub constants: Vec<ConstantField>,
    pub radials: Vec<RadialBatch>,
    pub programs: Vec<Program>,
    pub detectors: Vec<Detector>,
    /// What bodies ask for in place of [`Sampling::Auto`](crate::field::Sampling).
    pub overrides: Vec<Sampling>,
    pub wanted: SamplingRequirements,
    /// Fields that can never act, for people.
    pub left_out: Vec<String>,
    /// Whether any field depends on velocities.
    pub reads_velocity: bool,
    /// Whether any field can turn a body, by its force or by the answer to a contact.
    pub torque_possible: bool,
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
}

/// A set, and what was made of it.
#[derive(Clone, Copy)]
pub(crate) struct Prepared<'a> {
    pub set: &'a FieldSet,
    pub compiled: &'a Compiled,
}

impl std::ops::Deref for Prepared<'_> {
    type Target = Compiled;

    fn deref(&self) -> &Compiled {
        self.compiled
    }
}

/// How the vector of a field becomes a force on a sample.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Weighting {
    pub reading: ForceMode,
    pub coupling: Coupling,
    pub groups: Option<InteractionGroups>,
}

/// The same vector for every body, whatever its place.
#[derive(Debug)]
pub(crate) struct ConstantField {
    pub leaf: u32,
    pub vector: Vector,
    pub reading: ForceMode,
}

/// Radial fields that differ in strength and anchor only.
#[derive(Debug)]
pub(crate) struct RadialBatch {
    /// The law for a strength of one.
    pub law: Radial,
    /// One of the fields, for all that they have in common.
    pub prototype: Field,
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
    /// Bound of the force's length, infinite without one.
    pub strongest: Real,
    pub leaf: u32,
}

impl RadialSource {
    /// The law of the source, strength and all.
    pub(crate) fn law_in(&self, batch: &RadialBatch) -> Radial {
        let strongest = (self.strongest < Real::INFINITY).then_some(self.strongest);
        Radial {
            strongest,
            ..batch.law.times(self.strength)
        }
    }
}

/// A detection field.
#[derive(Debug)]
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
