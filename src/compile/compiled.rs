//! The compiled form of a set: constants, radial batches, programs and detection fields, with flags about them.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use super::anchors::Anchors;
use super::at_centres::AtCentres;
use super::entries::{ConstantField, DetectionField, RadialBatch, RadialKey};
use super::extent::Extent;
use super::ordered::{Key, Ordered};
use super::program::Program;
use super::program_log::ProgramLog;
use super::requirements::SamplingRequirements;
use super::term_flags::{FlagCounts, TermFlags};
use crate::field::{Anchor, FieldSet, Fingerprint, Sampling};

/// A set of fields, ready for evaluation. It follows the changes of the set.
///
/// Its parts are in the order of the terms they come from: sources within their batch, instances within their
/// program, and batches and programs by their first term. So the sums are the same, bit for bit, whether the compiled
/// form has followed changes or is new.
#[derive(Debug, Default)]
pub(crate) struct Compiled {
    /// The revision of the set that it was compiled from.
    pub revision: u64,
    pub anchors: Anchors,
    pub constants: Vec<ConstantField>,
    pub radials: Ordered<RadialBatch>,
    pub programs: Ordered<Program>,
    pub program_log: ProgramLog,
    pub detectors: Vec<DetectionField>,
    /// The revision of the set at the latest change of detection fields.
    pub detectors_revision: u64,
    /// Samplings that were set for bodies in place of [`Sampling::Auto`], each once.
    pub overrides: Vec<Sampling>,
    pub requirements: SamplingRequirements,
    /// True if any field depends on velocities.
    pub reads_velocity: bool,
    /// True if any field but drag and wind in [closed form](Program::as_drag) depends on velocities.
    pub reads_velocity_otherwise: bool,
    /// True if any term does not depend on velocities.
    pub ignores_velocity_in_part: bool,
    /// True if any field depends on the user's axes.
    pub reads_user_axes: bool,
    /// True if any field may change with time while its anchor stands still.
    pub reads_time: bool,
    /// True if any field can turn a body, by its force or by the answer to a contact.
    pub torque_possible: bool,
    /// True if no anchor moves and no field changes with time: the force on a sample that rests does not
    /// change.
    pub is_static: bool,
    /// True if the wrench on a body depends, to the bit, on nothing but its own pose and parts, and the time.
    pub each_by_itself: bool,
    /// The bodies on which the set can be evaluated at centres of mass alone; `None` if there are no such bodies.
    pub at_centres: Option<AtCentres>,

    pub(super) terms: HashMap<Key, TermRecord, BuildHasherDefault<Fingerprint>>,
    pub(super) flag_counts: FlagCounts,
    pub(super) radial_ids: HashMap<RadialKey, u32>,
    /// The numbers of programs, by [`Program::dedup_key`].
    pub(super) alike: HashMap<u64, Vec<u32>, BuildHasherDefault<Fingerprint>>,
    pub(super) extent: Extent,
    pub(super) detectors_changed: bool,
}

/// The parts of the compiled form that one term contributes to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TermRecord {
    pub flags: TermFlags,
    pub radial: Option<u32>,
    pub program: Option<u32>,
    pub constants: bool,
    pub detectors: bool,
}

impl Compiled {
    /// Returns true if any force differs from place to place, and so may be stiff.
    pub(crate) fn varies(&self) -> bool {
        self.flag_counts.any(TermFlags::VARIES)
    }

    /// The anchors on bodies and colliders of fields that have a force. Wrenches depend on no other moving anchors.
    pub(crate) fn moving_anchors_of_forces(&self) -> impl Iterator<Item = &Anchor> {
        let mut has_force = vec![false; self.anchors.len()];
        let sources = self.radials.iter().flat_map(|(_, batch)| &batch.sources);
        let programs = self.programs.iter().map(|(_, program)| program);
        let instances = programs
            .filter(|program| program.has_force)
            .flat_map(|program| program.instances.anchors());
        for id in sources.map(|source| source.anchor).chain(instances) {
            has_force[id as usize] = true;
        }
        let moving = self.anchors.moving();
        moving.filter_map(move |(id, anchor)| has_force[id as usize].then_some(anchor))
    }
}

/// A set together with its compiled form.
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
