//! Fields of a set by `set["wind"]` and `set[handle]`.

use std::ops::{Index, IndexMut};

use super::{FieldKey, FieldSet};
use crate::field::Field;

/// The most names that a message lists.
const NAMED: usize = 12;

/// # Panics
/// If there is no such field, as maps do. The message lists the names that there are.
impl<K: FieldKey> Index<K> for FieldSet {
    type Output = Field;

    fn index(&self, key: K) -> &Field {
        let found = key.find(self).and_then(|handle| self.get(handle));
        found.unwrap_or_else(|| panic!("{}", self.no_field(&key)))
    }
}

/// # Panics
/// If there is no such field, as maps do. The message lists the names that there are.
impl<K: FieldKey> IndexMut<K> for FieldSet {
    fn index_mut(&mut self, key: K) -> &mut Field {
        let found = key.find(self).filter(|handle| self.get(*handle).is_some());
        let Some(handle) = found else {
            panic!("{}", self.no_field(&key));
        };
        self.get_mut(handle).expect("it was found")
    }
}

impl FieldSet {
    /// The message for a key that finds no field.
    fn no_field(&self, key: &impl FieldKey) -> String {
        let names = self.iter().filter_map(|(_, field)| field.name());
        let names: Vec<String> = names.take(NAMED).map(|name| format!("`{name}`")).collect();
        let there = if names.is_empty() {
            "no field has a name".to_owned()
        } else {
            format!("there are {}", names.join(", "))
        };
        format!("the set has no field {}; {there}", key.describe())
    }
}
