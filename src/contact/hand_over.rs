//! Contacts that the fields answer as impacts but that do not separate are handed over to Rapier.

use super::hooks::PairOutcomes;
use super::ownership::OwnershipRules;
use super::rules::{Pairs, in_order};
use super::{Detector, FieldContact};
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, Real};

/// A pair is handed over once it was answered in this number of steps running and overlaps after each, or once it
/// went deeper than before this number of times. A pair that was Rapier's for more steps running is not watched.
const STEPS: u8 = 3;

/// A depth that grows by less than this share counts as unchanged.
const SAME_DEPTH: Real = 1.0e-3;

/// The count of a pair that goes deeper starts anew once its overlap shrinks below this share of its largest one, or to
/// the allowed error of Rapier's solver.
const RECOVERED: Real = 0.5;

/// A pair is reported if its overlap is beyond this many times the allowed error of Rapier's solver, which alone leaves
/// about as much in a fifth of its steps with falling bodies.
const DEEP: Real = 4.0;

/// The pairs that are watched, and those handed over, in the order of their handles.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct HandOver(Vec<WatchedPair>);

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
struct WatchedPair {
    pair: [ColliderHandle; 2],
    /// The largest overlap at the end of a step since it was last far less; zero for a new pair.
    deepest: Real,
    /// Steps running in which it was answered, by a law that loses speed, and overlapped at the end.
    answered: u8,
    /// Times that it went deeper than before. Beyond Rapier's allowed error these need not be consecutive, because the
    /// depth of a squeezed body goes up and down.
    deeper: u8,
    /// Steps running in which fields neither answered it nor lifted it off Rapier's solver.
    quiet: u8,
    given: bool,
}

/// Pairs that are handed over in this step and are to be reported, by the reason.
#[derive(Debug, Default)]
pub(crate) struct Given {
    /// Pairs whose overlap grew, each with its depth.
    pub deeper: Vec<([ColliderHandle; 2], Real)>,
    pub not_finite: Vec<[ColliderHandle; 2]>,
}

impl WatchedPair {
    fn new(pair: [ColliderHandle; 2]) -> Self {
        WatchedPair {
            pair,
            deepest: 0.0,
            answered: 0,
            deeper: 0,
            quiet: 0,
            given: false,
        }
    }

    fn key(&self) -> [(u32, u32); 2] {
        self.pair.map(ColliderHandle::into_raw_parts)
    }
}

impl HandOver {
    /// Returns true if the list is sorted and finite, which may not hold for one that was deserialized.
    pub(crate) fn is_sound(&self) -> bool {
        let sorted = self.0.is_sorted_by_key(WatchedPair::key);
        sorted && self.0.iter().all(|entry| entry.deepest.is_finite())
    }

    /// The pairs that Rapier answers until they separate.
    pub(crate) fn given(&self) -> Pairs {
        let given = self.0.iter().filter(|entry| entry.given);
        given.map(|entry| entry.pair).collect()
    }

    fn of(&self, pair: [ColliderHandle; 2]) -> Option<&WatchedPair> {
        let key = pair.map(ColliderHandle::into_raw_parts);
        let place = self.0.binary_search_by_key(&key, WatchedPair::key).ok()?;
        Some(&self.0[place])
    }

    /// Updates the counts from the contacts of a step, and returns the pairs that the caller is to warn of.
    pub(crate) fn update(
        &mut self,
        detector: &Detector,
        rules: &OwnershipRules,
        outcomes: &PairOutcomes,
    ) -> Given {
        let mut given = Given::default();
        let unsound = &detector.not_finite;
        let [overlaps, touches] = [&detector.contacts, &detector.touched];
        let idle = self.0.is_empty() && outcomes.lifted.is_empty() && unsound.is_empty();
        if idle
            && !overlaps
                .iter()
                .chain(touches)
                .any(FieldContact::is_answered)
        {
            return given;
        }
        let touched = touches.iter().filter(|it| it.is_answered());
        let touched: Pairs = touched.map(|it| it.colliders).collect();
        let mut now = Vec::new();
        for contact in overlaps {
            let pair = contact.colliders;
            let was = self.of(pair);
            let answered = contact.is_answered() || touched.contains(&pair);
            let ours = answered || outcomes.lifted.contains(&pair);
            if !(ours || was.is_some()) {
                continue;
            }
            let Some(law) = rules
                .law(pair)
                .filter(|law| !matches!(law, ContactLaw::Penalty { .. }))
            else {
                continue;
            };
            let mut entry = was.copied().unwrap_or(WatchedPair::new(pair));
            let count = |steps: u8, again: bool| if again { steps.saturating_add(1) } else { 0 };
            entry.answered = count(entry.answered, answered && !law.keeps_speed());
            entry.quiet = count(entry.quiet, !ours);
            if entry.quiet > STEPS && !entry.given {
                continue;
            }
            let allowed = detector.starts.rebound();
            let (shallow, deep) = (contact.depth <= allowed, DEEP * allowed);
            let known = entry.deepest > 0.0;
            let grows = known && contact.depth > entry.deepest * (1.0 + SAME_DEPTH);
            let comes_out = shallow || contact.depth < entry.deepest * RECOVERED;
            if grows && (ours || entry.given) {
                entry.deeper = entry.deeper.saturating_add(1);
                let told = entry.deeper > STEPS && entry.deepest > deep;
                if entry.deeper >= STEPS && contact.depth > deep && !told {
                    given.deeper.push((pair, contact.depth));
                }
            }
            if !grows && comes_out {
                entry.deeper = 0;
            }
            if grows || comes_out || !known {
                entry.deepest = contact.depth;
            }
            entry.given |= entry.answered.max(entry.deeper) >= STEPS;
            now.push(entry);
        }
        // Rapier's solver still holds these pairs, though they do not overlap.
        let close = |entry: &&WatchedPair| entry.given && outcomes.held.contains(&entry.pair);
        now.extend(self.0.iter().filter(close));
        for pair in unsound.iter().map(|pair| in_order(*pair)) {
            given.not_finite.push(pair);
            now.push(WatchedPair {
                given: true,
                ..WatchedPair::new(pair)
            });
        }
        now.sort_unstable_by_key(|entry| (entry.key(), !entry.given));
        now.dedup_by_key(|entry| entry.pair);
        self.0 = now;
        given
    }
}
