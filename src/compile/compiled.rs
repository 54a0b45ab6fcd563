//! The compiled form of a set.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use super::anchors::Anchors;
use super::at_centres::AtCentres;
use super::entries::{ConstantField, DetectionField, RadialBatch, RadialKey};
use super::extent::Extent;
use super::facts::{FactCounts, Facts};
use super::ordered::{Key, Ordered};
use super::program::Program;
use super::requirements::SamplingRequirements;
use super::roster::Roster;
use crate::field::{FieldSet, Fingerprint, Sampling};

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
    pub detectors: Vec<DetectionField>,
    /// Changes whenever the detection fields may have.
    pub detectors_revision: u64,
    /// What bodies ask for in place of [`Sampling::Auto`](crate::field::Sampling).
    pub overrides: Vec<Sampling>,
    pub requirements: SamplingRequirements,
    /// Whether any field depends on velocities.
    pub reads_velocity: bool,
    /// Whether any does but drag and wind in [closed form](Program::as_drag).
    pub reads_velocity_otherwise: bool,
    /// Whether any field depends on the user's axes.
    pub reads_user_axes: bool,
    /// Whether any field may change in time while its anchor stands still.
    pub reads_time: bool,
    /// Whether any field can turn a body, by its force or by the answer to a contact.
    pub torque_possible: bool,
    /// Whether the force at a point, on what rests there, never changes.
    pub is_static: bool,
    /// The bodies on which it can be evaluated at their centres of mass alone.
    pub at_centres: Option<AtCentres>,

    pub(super) terms: HashMap<Key, TermRecord, BuildHasherDefault<Fingerprint>>,
    pub(super) tally: FactCounts,
    pub(super) radial_ids: HashMap<RadialKey, u32>,
    /// Programs by their likeness.
    pub(super) alike: HashMap<u64, Vec<u32>, BuildHasherDefault<Fingerprint>>,
    pub(super) extent: Extent,
    pub(super) masks_moved: bool,
    pub(super) detectors_changed: bool,
}

/// Where a term went.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TermRecord {
    pub facts: Facts,
    pub radial: Option<u32>,
    pub program: Option<u32>,
    pub constants: bool,
    pub detectors: bool,
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
