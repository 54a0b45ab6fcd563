//! Replaces the sources or instances of one term within a batch or program. They stay in the order of the
//! terms.

use std::ops::Range;

use super::entries::{RadialBatch, RadialSource};
use super::instances::Instances;
use super::ordered::{Key, Keyed, places_of};
use super::program::Program;

impl Keyed for RadialBatch {
    fn key(&self) -> Key {
        self.serials.first().copied().unwrap_or(Key::MAX)
    }
}

impl RadialBatch {
    /// The places of the sources of a term.
    pub(crate) fn places_of(&self, serial: Key) -> Range<usize> {
        places_of(&self.serials, serial, Key::clone)
    }

    /// Replaces the sources of one term by those of `term`, a batch with the same key. Returns the old sources,
    /// which the caller has to subtract from the counts.
    pub(super) fn put(&mut self, serial: Key, term: Option<RadialBatch>) -> Vec<RadialSource> {
        let places = self.places_of(serial);
        let Some(term) = term else {
            self.serials.drain(places.clone());
            return self.sources.drain(places).collect();
        };
        self.on_colliders += term.on_colliders;
        self.moving += term.moving;
        self.serials.splice(places.clone(), term.serials);
        self.sources.splice(places, term.sources).collect()
    }
}

impl Keyed for Program {
    fn key(&self) -> Key {
        self.instances.serials.first().copied().unwrap_or(Key::MAX)
    }
}

impl Program {
    /// Replaces the instances of one term by those of `term`, a program that [is like](Program::is_like) this one.
    /// Returns the old instances, which the caller has to subtract from the count.
    pub(super) fn put(&mut self, serial: Key, term: Option<Program>) -> Instances {
        let stride = self.stride();
        let known = &mut self.instances;
        let new = term.map(|term| term.instances).unwrap_or_default();
        let places = places_of(&known.serials, serial, Key::clone);
        let strided = places.start * stride..places.end * stride;
        // Composites have no strengths of their own.
        let none = known.strengths.is_empty();
        let strengths = if none { 0..0 } else { places.clone() };
        known.moving += new.moving;
        Instances {
            serials: known.serials.splice(places.clone(), new.serials).collect(),
            centres: known.centres.splice(places, new.centres).collect(),
            anchors: known.anchors.splice(strided.clone(), new.anchors).collect(),
            places: known.places.splice(strided, new.places).collect(),
            strengths: known.strengths.splice(strengths, new.strengths).collect(),
            moving: 0,
        }
    }
}
