//! A collection whose items keep their numbers, and are iterated in the order of the first term in each.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// The serial number of a term. Batches, programs and their entries are in the order of these.
pub(crate) type Key = u64;

/// A number that no earlier call in this process has returned.
pub(crate) fn unique() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// Adds a number to a sorted list, or removes it.
pub(super) fn set_member(numbers: &mut Vec<u32>, number: u32, is_member: bool) {
    match numbers.binary_search(&number) {
        Err(place) if is_member => numbers.insert(place, number),
        Ok(place) if !is_member => {
            numbers.remove(place);
        }
        _ => {}
    }
}

/// The places of the items of a term among items in the order of their terms.
pub(super) fn places_of<T>(items: &[T], serial: Key, of: impl Fn(&T) -> Key) -> Range<usize> {
    // A new term is at the end.
    if items.last().is_none_or(|last| of(last) < serial) {
        return items.len()..items.len();
    }
    let start = items.partition_point(|known| of(known) < serial);
    let count = items[start..].partition_point(|known| of(known) == serial);
    start..start + count
}

/// A batch or program, which is ordered by the first of its terms.
pub(crate) trait Keyed {
    /// The first of its terms.
    fn key(&self) -> Key;
}

/// Items under numbers that stay as long as the item does; iterated in the order of their keys.
#[derive(Debug)]
pub(crate) struct Ordered<T> {
    things: Vec<Option<Box<T>>>,
    free: Vec<u32>,
    /// The numbers, in the order of the items' keys.
    order: Vec<u32>,
}

impl<T> Default for Ordered<T> {
    fn default() -> Self {
        Ordered {
            things: Vec::new(),
            free: Vec::new(),
            order: Vec::new(),
        }
    }
}

impl<T: Keyed> Ordered<T> {
    pub(crate) fn get(&self, number: u32) -> Option<&T> {
        self.things.get(number as usize)?.as_deref()
    }

    /// The items with their numbers, in the order of their keys.
    pub(crate) fn iter(&self) -> impl DoubleEndedIterator<Item = (u32, &T)> + Clone {
        let order = self.order.iter();
        order.filter_map(|number| Some((*number, self.get(*number)?)))
    }

    /// One more than the largest number.
    pub(crate) fn bound(&self) -> usize {
        self.things.len()
    }

    pub(crate) fn len(&self) -> usize {
        self.order.len()
    }

    pub(super) fn add(&mut self, thing: T) -> u32 {
        let number = self.free.pop().unwrap_or(self.things.len() as u32);
        if number as usize == self.things.len() {
            self.things.push(None);
        }
        let key = thing.key();
        self.things[number as usize] = Some(Box::new(thing));
        self.put_in_order(number, key);
        number
    }

    fn put_in_order(&mut self, number: u32, key: Key) {
        let mut place = self.order.len();
        if self.order.last().is_some_and(|last| self.key(*last) > key) {
            place = self.order.partition_point(|known| self.key(*known) < key);
        }
        self.order.insert(place, number);
    }

    fn key(&self, number: u32) -> Key {
        self.get(number).map_or(Key::MAX, T::key)
    }

    /// Changes an item, and moves it in the order if its key has changed.
    pub(super) fn change<R>(&mut self, number: u32, change: impl FnOnce(&mut T) -> R) -> Option<R> {
        let thing = self.things.get_mut(number as usize)?.as_deref_mut()?;
        let before = thing.key();
        let result = change(thing);
        let after = thing.key();
        if before != after {
            self.take_from_order(number, before);
            self.put_in_order(number, after);
        }
        Some(result)
    }

    fn take_from_order(&mut self, number: u32, key: Key) {
        let key_of = |known: &u32| {
            if *known == number {
                key
            } else {
                self.key(*known)
            }
        };
        if let Ok(place) = self.order.binary_search_by_key(&key, key_of) {
            self.order.remove(place);
        }
    }

    pub(super) fn remove(&mut self, number: u32) {
        self.take_from_order(number, self.key(number));
        self.things[number as usize] = None;
        self.free.push(number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_kept_in_order_and_once() {
        let mut numbers = Vec::new();
        for number in [5, 2, 9, 2] {
            set_member(&mut numbers, number, true);
        }
        assert_eq!(numbers, [2, 5, 9]);
        for number in [5, 7] {
            set_member(&mut numbers, number, false);
        }
        assert_eq!(numbers, [2, 9]);
    }
}
