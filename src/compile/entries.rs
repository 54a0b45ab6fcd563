//! The parts of a compiled set besides programs: constants, batches of radial fields, and detection fields.

use super::anchors::AnchorId;
use super::ordered::{Key, unique};
use crate::field::{ContactLaw, Coupling, Field, ForceMode, Lifetime, Radial, SamplingRule};
use crate::math::{ColliderHandle, InteractionGroups, Real, Vector};

/// The properties that all sources of a batch share.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct RadialKey {
    pub law: [u64; 7],
    pub range: u64,
    pub weighting: Weighting,
    pub sampling_rule: SamplingRule,
}

/// The factors by which the vector of a field becomes a force on a sample, and the conditions under which the
/// field acts.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Weighting {
    pub mode: ForceMode,
    pub coupling: Coupling,
    pub groups: Option<InteractionGroups>,
    /// The bits of the times at which its lifetime begins and ends (s).
    pub life: [u64; 2],
}

impl Weighting {
    pub(crate) fn of(field: &Field) -> Self {
        let Lifetime { from, until, .. } = field.lifetime;
        Weighting {
            mode: field.mode,
            coupling: field.coupling.clone(),
            groups: field.groups,
            life: [from, until].map(f64::to_bits),
        }
    }

    /// The lifetime in simulated time, without a limit of steps.
    pub(crate) fn lifetime(&self) -> Lifetime {
        let [from, until] = self.life.map(f64::from_bits);
        Lifetime::between(from, until)
    }

    /// The weighting of a vector that is shared out by mass, at all times and on all groups.
    pub(crate) fn shared(mode: ForceMode) -> Self {
        Weighting {
            mode,
            coupling: Coupling::Share,
            groups: None,
            life: [f64::NEG_INFINITY, f64::INFINITY].map(f64::to_bits),
        }
    }
}

/// A field with the same vector for every body and everywhere.
#[derive(Clone, Debug)]
pub(crate) struct ConstantField {
    pub serial: Key,
    pub leaf: u32,
    pub vector: Vector,
    pub mode: ForceMode,
}

/// Radial fields that differ only in strength and anchor.
#[derive(Debug)]
pub(crate) struct RadialBatch {
    pub key: RadialKey,
    /// The law for a strength of one.
    pub law: Radial,
    /// One of the fields, to read the properties that all share.
    pub prototype: Field,
    /// Radius of the ball within which the fields act; without one they act everywhere.
    pub range: Option<Real>,
    pub weighting: Weighting,
    pub sampling_rule: SamplingRule,
    pub sources: Vec<RadialSource>,
    /// The term of each source.
    pub serials: Vec<Key>,
    /// The number of sources that are at the origin of a collider.
    pub on_colliders: usize,
    /// The number of sources that are anchored to a body or collider.
    pub moving: usize,
    pub log: SourceLog,
}

/// The latest changes of a batch, for indices that keep its sources sorted.
#[derive(Debug)]
pub(crate) struct SourceLog {
    /// The stamp of the batch before the oldest change in the list.
    first: u64,
    /// The present stamp. Each change sets a new one, which no other batch has.
    pub stamp: u64,
    /// Changes, one entry for each source that was removed: the stamp after the change, the term, and the
    /// place of the source in the frame of its carrier. Each change ends with an entry without a place.
    changes: Vec<(u64, Key, Option<Vector>)>,
}

/// A follower that is behind by more entries than this has to start over.
const LONGEST_LOG: usize = 64;

impl Default for SourceLog {
    fn default() -> Self {
        let stamp = unique();
        SourceLog {
            first: stamp,
            stamp,
            changes: Vec::new(),
        }
    }
}

impl SourceLog {
    /// Notes a change of a term whose sources were at these places.
    pub(super) fn note(&mut self, serial: Key, were: impl Iterator<Item = Vector>) {
        if self.changes.len() >= 2 * LONGEST_LOG {
            self.first = self.changes[LONGEST_LOG].0;
            self.changes.retain(|change| change.0 > self.first);
        }
        self.stamp = unique();
        let were = were.map(Some).chain([None]);
        let changes = were.map(|was| (self.stamp, serial, was));
        self.changes.extend(changes);
    }

    /// The terms that were changed since a stamp, and where their sources were; `None` if the log does not
    /// reach back that far.
    pub(crate) fn since(
        &self,
        stamp: u64,
    ) -> Option<impl Iterator<Item = (Key, Option<Vector>)> + Clone> {
        let last = self.changes.iter().rposition(|change| change.0 == stamp);
        let known = last.map(|last| last + 1);
        let known = known.or((stamp == self.first).then_some(0));
        let known = known.filter(|known| self.changes.len() - known <= LONGEST_LOG)?;
        Some(
            self.changes[known..]
                .iter()
                .map(|change| (change.1, change.2)),
        )
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct RadialSource {
    pub anchor: AnchorId,
    /// The collider at whose origin the source is, if there is one.
    pub collider: Option<ColliderHandle>,
    pub strength: Real,
    pub leaf: u32,
}

/// A detection field on a collider.
#[derive(Clone, Debug)]
pub(crate) struct DetectionField {
    pub serial: Key,
    /// The number of the instance within the term.
    pub instance: u32,
    pub leaf: u32,
    pub anchor: AnchorId,
    pub collider: ColliderHandle,
    pub law: ContactLaw,
    /// The program instance that decides whether the field acts at a sample; without one it acts everywhere.
    pub mask: Option<FieldMask>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct FieldMask {
    pub program: u32,
    pub instance: u32,
    /// The number of the detection field among the program's leaves.
    pub leaf: u32,
}

impl FieldMask {
    /// Returns true if both masks are of one instance of a composite.
    pub(crate) fn is_beside(&self, other: &FieldMask) -> bool {
        (self.program, self.instance) == (other.program, other.instance)
    }
}
