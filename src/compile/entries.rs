//! What terms become, apart from programs.

use super::anchors::AnchorId;
use super::ordered::{Key, unique};
use crate::field::{ContactLaw, Coupling, Field, ForceMode, Lifetime, Radial, SamplingRule};
use crate::math::{ColliderHandle, InteractionGroups, Real, Vector};

/// What sources of one batch have in common.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct RadialKey {
    pub law: [u64; 7],
    pub range: u64,
    pub weighting: Weighting,
    pub how: SamplingRule,
}

/// How the vector of a field becomes a force on a sample.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Weighting {
    pub mode: ForceMode,
    pub coupling: Coupling,
    pub groups: Option<InteractionGroups>,
    /// The bits of when it begins and ends.
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

    /// When it acts.
    pub(crate) fn lifetime(&self) -> Lifetime {
        let [from, until] = self.life.map(f64::from_bits);
        Lifetime::between(from, until)
    }

    /// That of a vector that is shared out by mass.
    pub(crate) fn shared(mode: ForceMode) -> Self {
        Weighting {
            mode,
            coupling: Coupling::Share,
            groups: None,
            life: [f64::NEG_INFINITY, f64::INFINITY].map(f64::to_bits),
        }
    }
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
    pub log: SourceLog,
}

/// The last changes of a batch, for those that keep its sources sorted.
#[derive(Debug)]
pub(crate) struct SourceLog {
    /// That of the batch as it was before them.
    first: u64,
    /// Another after each change, and no other batch's.
    pub stamp: u64,
    /// The stamp after each, the term that was changed, and where one of its sources stood.
    changes: Vec<(u64, Key, Option<Vector>)>,
}

/// Followers that are more changes behind begin anew.
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
    /// Notes that a term was changed that had sources there.
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

    /// The changes since a stamp: the term, and where its sources stood; `None` if all may be
    /// others.
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
    /// The collider whose origin it is at, if it is.
    pub collider: Option<ColliderHandle>,
    pub strength: Real,
    pub leaf: u32,
}

/// A detection field.
#[derive(Clone, Debug)]
pub(crate) struct DetectionField {
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

impl FieldMask {
    /// Whether both stand in one composite.
    pub(crate) fn is_beside(&self, other: &FieldMask) -> bool {
        (self.program, self.instance) == (other.program, other.instance)
    }
}
