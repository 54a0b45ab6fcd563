//! Contacts: those that begin, and all on which the two sides of the cross-check differ.

use std::collections::HashSet;

use super::super::fields::Fields;
use super::super::fields::cross_check::{CrossCheckReport, Difference};
use super::super::fields::math::{ColliderHandle, DVec3, Real, Vector, to_dvec3};
use super::super::fields::rapier::geometry::ContactPair;
use super::super::fields::rapier::pipeline::PhysicsWorld;
use super::frames::Counts;
use crate::page::ContactKind;

/// The most contacts of a frame that are drawn.
const MOST: usize = 500;

type Pair = [ColliderHandle; 2];

/// A contact as it is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flash {
    pub at: DVec3,
    pub kind: ContactKind,
}

/// Contacts since the last frame, and which pairs touch.
#[derive(Default)]
pub(super) struct Contacts {
    flashes: Vec<Flash>,
    /// Pairs that touched in the last step, so that a lasting contact is drawn only when it begins.
    touching: HashSet<Pair>,
    /// Differences since the last frame, so that each is drawn once.
    told: HashSet<(Pair, ContactKind)>,
}

impl Contacts {
    /// Records the contacts of a step.
    pub fn note(&mut self, world: &PhysicsWorld, fields: &Fields) {
        let mut now = HashSet::new();
        let check = fields.cross_check();
        let mut differ = HashSet::new();
        if let Some(check) = check {
            differ = self.differences(check);
        }
        let kind = match check {
            Some(_) => ContactKind::Agreed,
            None => ContactKind::Fields,
        };
        for contact in fields.contacts() {
            let pair = contact.colliders;
            let is_new = now.insert(pair) && !self.touching.contains(&pair);
            if is_new && !differ.contains(&pair) {
                self.flash(contact.world_point, kind);
            }
        }
        if check.is_none() {
            self.note_rapiers(world, &mut now);
        }
        self.touching = now;
    }

    /// Records the differences of a step, and returns their pairs.
    fn differences(&mut self, check: &CrossCheckReport) -> HashSet<Pair> {
        let mut pairs = HashSet::new();
        for it in &check.disagreements {
            let kind = kind(&it.difference);
            pairs.insert(it.colliders);
            if self.told.insert((it.colliders, kind)) {
                self.flash(it.world_point, kind);
            }
        }
        pairs
    }

    /// Records Rapier's contacts that begin, of pairs without a contact of the fields.
    fn note_rapiers(&mut self, world: &PhysicsWorld, now: &mut HashSet<Pair>) {
        for pair in world.narrow_phase.contact_pairs() {
            let mut colliders = [pair.collider1, pair.collider2];
            colliders.sort_unstable_by_key(|it| it.into_raw_parts());
            let Some(point) = deepest(world, pair) else {
                continue;
            };
            if now.insert(colliders) && !self.touching.contains(&colliders) {
                self.flash(point, ContactKind::Rapier);
            }
        }
    }

    fn flash(&mut self, point: Vector, kind: ContactKind) {
        if self.flashes.len() < MOST {
            let at = to_dvec3(point);
            self.flashes.push(Flash { at, kind });
        }
    }

    /// Takes out the contacts since the last frame.
    pub fn take(&mut self) -> Vec<Flash> {
        self.told.clear();
        std::mem::take(&mut self.flashes)
    }
}

fn kind(difference: &Difference) -> ContactKind {
    match difference {
        Difference::OnlyField { .. } => ContactKind::OnlyFields,
        Difference::OnlyRapier { .. } => ContactKind::OnlyRapier,
        _ => ContactKind::Differs,
    }
}

/// The point of deepest overlap of a pair, in world coordinates, if the pair overlaps.
fn deepest(world: &PhysicsWorld, pair: &ContactPair) -> Option<Vector> {
    let points = pair.manifolds().iter().flat_map(|it| &it.points);
    let overlaps = points.filter(|point| point.dist < 0.0 as Real);
    let deepest = overlaps.min_by(|a, b| a.dist.total_cmp(&b.dist))?;
    let pose = world.colliders.get(pair.collider1)?.position();
    Some(*pose * deepest.local_p1)
}

/// By frame, four numbers of each contact; see [`Replay::contacts`](crate::page::Replay::contacts).
pub(super) fn rows(flashes: &[Vec<Flash>], counts: &Counts) -> Vec<Vec<i64>> {
    let row = |flashes: &Vec<Flash>| {
        let numbers = flashes.iter().flat_map(|flash| {
            let [x, y, z] = counts.place(flash.at);
            [x, y, z, flash.kind as i64]
        });
        numbers.collect()
    };
    flashes.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_marked_once_per_frame() {
        let band = 1e-6;
        let mut report = CrossCheckReport::default();
        let text = format!(
            r#"{{"step": 1, "world_point": [1, 2, 3], "colliders": [{{"index": 0, "generation": 0}},
            {{"index": 1, "generation": 0}}], "difference": {{"OnlyRapier": {{"depth": 0.1}}}}, "band": {band}}}"#
        );
        report.disagreements = vec![serde_json::from_str(&text).expect("a difference")];
        let mut contacts = Contacts::default();
        assert_eq!(contacts.differences(&report).len(), 1);
        contacts.differences(&report);
        let flashes = contacts.take();
        assert_eq!(flashes.len(), 1);
        assert_eq!(flashes[0].kind, ContactKind::OnlyRapier);
        assert_eq!(flashes[0].at, DVec3::new(1.0, 2.0, 3.0));
        contacts.differences(&report);
        assert_eq!(contacts.take().len(), 1, "in the next frame again");
    }
}
