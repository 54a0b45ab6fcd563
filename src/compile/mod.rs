//! Compile: a tree becomes flat batches and a plan.
//!
//! The outermost sum of union falls into terms whose forces simply add up, so each can be
//! evaluated in whatever way suits it best:
//!
//! - radial fields that differ only in strength and anchor become one [`RadialBatch`];
//! - an unbounded uniform field becomes a constant ([`ConstantField`]);
//! - detection fields go to the detector ([`Detector`]) and cost the force pass nothing;
//! - every other term becomes a postfix [`Program`], with as many instances as it has anchors.

mod anchors;
mod batches;
mod extent;
mod facts;
mod follow;
mod lower;
mod ordered;
mod plan;
mod program;
mod requirements;
mod roster;

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use crate::field::{
    ContactLaw, Coupling, Field, FieldSet, Fingerprint, ForceMode, Radial, Sampling, SamplingRule,
};
use crate::math::{ColliderHandle, InteractionGroups, Real, Vector};

pub(crate) use anchors::{AnchorId, Anchors};
pub(crate) use extent::Reach;
pub(crate) use ordered::Ordered;
pub use plan::{IndexKind, Plan, PlanEntry};
pub(crate) use program::{NO_ANCHOR, Program, Step};
pub(crate) use requirements::{PartSampling, SamplingRequirements};
pub(crate) use roster::{Followed, Roster};

use batches::RadialKey;
use extent::Extent;
use facts::{Facts, Tally};

/// The serial of a term, by which everything is ordered.
pub(crate) type Key = u64;

/// A set of fields, ready for evaluation; follows the changes of the set.
///
/// All of it stands in the order of the terms it comes from: sources within their batch, instances
/// within their program, and batches and programs by their first. So a form that has followed any
/// changes gives the same sums, bit for bit, as one that is made anew.
#[derive(Debug, Default)]
pub(crate) struct Compiled {
    /// The revision of the set that it was made for.
    pub revision: u64,
    pub anchors: Anchors,
    pub constants: Vec<ConstantField>,
    pub radials: Ordered<RadialBatch>,
    pub programs: Ordered<Program>,
    pub roster: Roster,
    pub detectors: Vec<Detector>,
    /// Changes whenever the detection fields may have.
    pub detectors_revision: u64,
    /// What bodies ask for in place of [`Sampling::Auto`](crate::field::Sampling).
    pub overrides: Vec<Sampling>,
    pub requirements: SamplingRequirements,
    /// Whether any field depends on velocities.
    pub reads_velocity: bool,
    /// Whether any field depends on the user's axes.
    pub reads_user_axes: bool,
    /// Whether any field may change in time while its anchor stands still.
    pub reads_time: bool,
    /// Whether any field can turn a body, by its force or by the answer to a contact.
    pub torque_possible: bool,
    /// Whether the force at a point, on what rests there, never changes.
    pub is_static: bool,
    /// Whether all forces are the same everywhere.
    pub only_constants: bool,

    terms: HashMap<Key, TermRecord, BuildHasherDefault<Fingerprint>>,
    tally: Tally,
    radial_ids: HashMap<RadialKey, u32>,
    /// Programs of one field, by its likeness.
    alike: HashMap<u64, Vec<u32>, BuildHasherDefault<Fingerprint>>,
    extent: Extent,
    masks_moved: bool,
    detectors_changed: bool,
}

/// Where a term went.
#[derive(Clone, Copy, Debug, Default)]
struct TermRecord {
    facts: Facts,
    radial: Option<u32>,
    program: Option<u32>,
    constants: bool,
    detectors: bool,
}

impl Compiled {
    /// Whether any force differs from place to place, and so may be stiff.
    pub(crate) fn varies(&self) -> bool {
        self.tally.any(Facts::VARIES)
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
    pub mode: ForceMode,
    pub coupling: Coupling,
    pub groups: Option<InteractionGroups>,
}

/// The same vector for every body, whatever its place.
#[derive(Clone, Debug)]
pub(crate) struct ConstantField {
    pub serial: Key,
    pub leaf: u32,
    pub vector: Vector,
    pub mode: ForceMode,
}

/// Radial fields that differ in strength and anchor only.
#[derive(Debug)]
pub(crate) struct RadialBatch {
    pub key: RadialKey,
    /// The law for a strength of one.
    pub law: Radial,
    /// One of the fields, for all that they have in common.
    pub prototype: Field,
    /// Radius of the ball the fields act in; without one they act everywhere.
    pub range: Option<Real>,
    pub weighting: Weighting,
    pub how: SamplingRule,
    pub sources: Vec<RadialSource>,
    /// Of the term of each source.
    pub serials: Vec<Key>,
    /// How many sources are at the origin of a collider.
    pub on_colliders: usize,
    /// How many sources hang on a body or collider.
    pub moving: usize,
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
#[derive(Clone, Debug)]
pub(crate) struct Detector {
    pub serial: Key,
    /// The number of the instance within the term.
    pub instance: u32,
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
