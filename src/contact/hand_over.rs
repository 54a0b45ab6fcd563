//! Contacts that are answered as impacts and do not part: they are given back to Rapier.

use super::claims::Claims;
use super::hooks::Verdicts;
use super::rules::{Pairs, in_order};
use super::{Detector, FieldContact};
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, Real, Vector};

/// A pair that overlaps at the end of this many steps running, though it was answered, or deeper each time,
/// is no impact.
const STEPS: u8 = 3;

/// A depth that grows by less than this share is the same.
const SAME_DEPTH: Real = 1.0e-3;

/// The pairs that are watched, and those given back, in the order of their handles.
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) struct HandOver(Vec<WatchedPair>);

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
struct WatchedPair {
    pair: [ColliderHandle; 2],
    /// At the end of the last step.
    depth: Real,
    /// Steps running in which it was answered and overlaps, and in which it came to be deeper.
    answered: u8,
    deeper: u8,
    given: bool,
}

/// Pairs that are Rapier's from now on, and why.
#[derive(Debug, Default)]
pub(crate) struct Given {
    /// With how deep they overlap.
    pub deeper: Vec<([ColliderHandle; 2], Real)>,
    pub not_finite: Vec<[ColliderHandle; 2]>,
}

impl WatchedPair {
    fn key(&self) -> [(u32, u32); 2] {
        self.pair.map(ColliderHandle::into_raw_parts)
    }
}

impl HandOver {
    /// The pairs that are Rapier's while they last.
    pub(crate) fn given(&self) -> Pairs {
        let given = self.0.iter().filter(|entry| entry.given);
        given.map(|entry| entry.pair).collect()
    }

    fn of(&self, pair: [ColliderHandle; 2]) -> Option<&WatchedPair> {
        let key = pair.map(ColliderHandle::into_raw_parts);
        let place = self.0.binary_search_by_key(&key, WatchedPair::key).ok()?;
        Some(&self.0[place])
    }

    /// Takes note of how a step has left the contacts that the fields answer.
    pub(crate) fn update(
        &mut self,
        detector: &Detector,
        claims: &Claims,
        verdicts: &Verdicts,
    ) -> Given {
        let mut given = Given::default();
        let unsound = &detector.not_finite;
        let [overlaps, touches] = [&detector.contacts, detector.touches()];
        let pushes = |contact: &FieldContact| contact.impulses != [Vector::ZERO; 2];
        let idle = self.0.is_empty() && verdicts.lifted.is_empty() && unsound.is_empty();
        if idle && !overlaps.iter().chain(touches).any(pushes) {
            return given;
        }
        let touched: Pairs = touches
            .iter()
            .filter(|it| pushes(it))
            .map(|it| it.colliders)
            .collect();
        let mut now = Vec::new();
        for contact in overlaps {
            let pair = contact.colliders;
            let was = self.of(pair);
            let answered = pushes(contact) || touched.contains(&pair);
            let lifted = verdicts.lifted.contains(&pair);
            if !(answered || lifted || was.is_some_and(|it| it.given)) {
                continue;
            }
            let Some(law) = claims
                .law(pair)
                .filter(|law| !matches!(law, ContactLaw::Penalty { .. }))
            else {
                continue;
            };
            let mut entry = was.copied().unwrap_or(WatchedPair {
                pair,
                depth: Real::INFINITY,
                answered: 0,
                deeper: 0,
                given: false,
            });
            let count = |steps: u8, again: bool| if again { steps.saturating_add(1) } else { 0 };
            let grows = contact.depth > entry.depth * (1.0 + SAME_DEPTH);
            entry.answered = count(entry.answered, answered && !law.keeps_speed());
            entry.deeper = count(entry.deeper, grows);
            entry.depth = contact.depth;
            // A pair that sinks by less than the tolerance of Rapier's solver is at rest.
            if entry.deeper == STEPS && contact.depth > detector.starts.rebound() {
                given.deeper.push((pair, contact.depth));
            }
            entry.given |= entry.answered.max(entry.deeper) >= STEPS;
            now.push(entry);
        }
        // Rapier still holds these, though they do not overlap.
        let close = |entry: &&WatchedPair| entry.given && verdicts.held.contains(&entry.pair);
        now.extend(self.0.iter().filter(close));
        for pair in unsound.iter().map(|pair| in_order(*pair)) {
            given.not_finite.push(pair);
            now.push(WatchedPair {
                pair,
                depth: 0.0,
                answered: 0,
                deeper: 0,
                given: true,
            });
        }
        now.sort_unstable_by_key(|entry| (entry.key(), !entry.given));
        now.dedup_by_key(|entry| entry.pair);
        self.0 = now;
        given
    }
}
