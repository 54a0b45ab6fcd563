//! The places of fields by their names.

use std::collections::HashMap;
use std::sync::Arc;

/// Places of leaves by name.
#[derive(Clone, Debug, Default)]
pub(super) struct FieldNames {
    places: HashMap<Arc<str>, Vec<u32>>,
    /// The name under which each place is listed.
    listed: HashMap<u32, Arc<str>>,
}

impl FieldNames {
    /// The places with a name, in the order in which they got it.
    pub(super) fn places(&self, name: &str) -> &[u32] {
        self.places.get(name).map_or(&[], |places| places)
    }

    /// Lists a leaf under a name, and no longer under its last one.
    pub(super) fn set(&mut self, place: u32, name: Option<&Arc<str>>) {
        if self.listed.get(&place) == name {
            return;
        }
        self.forget(place);
        if let Some(name) = name {
            self.listed.insert(place, name.clone());
            self.places.entry(name.clone()).or_default().push(place);
        }
    }

    pub(super) fn forget(&mut self, place: u32) {
        let Some(name) = self.listed.remove(&place) else {
            return;
        };
        if let Some(places) = self.places.get_mut(&name) {
            places.retain(|known| *known != place);
            if places.is_empty() {
                self.places.remove(&name);
            }
        }
    }
}
