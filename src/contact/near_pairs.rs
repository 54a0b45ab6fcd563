//! Pairs of solids or bodies that are near each other, kept while their widened bounding boxes hold them.

use crate::math::{Real, Vector};
use crate::neighbors::hierarchy;
use crate::rapier::geometry::Aabb;
use crate::rapier::parry::bounding_volume::BoundingVolume;
use crate::rapier::parry::partitioning::{Bvh, BvhWorkspace};

/// Boxes are wider than their contents by this share of the least half extent.
const WIDER: Real = 0.1;

/// Boxes are longer than their contents by the ways of this many steps.
const AHEAD: Real = 4.0;

/// All boxes are made anew once this share of them has been replaced one by one, because the tree becomes worse.
const REPLACED: f64 = 0.5;

/// The bounds of a solid at its pose, or of a body over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub bounds: Aabb,
    /// Its way in a step, if that is known.
    pub way: Vector,
    pub dynamic: bool,
    /// False for a half-space, which has no bounds.
    pub bounded: bool,
}

impl Place {
    /// The place with a box that it does not leave at once. A place that is not finite touches nothing, but its box
    /// must not spoil those around it.
    fn widened(&self) -> Self {
        let margin = WIDER * self.bounds.half_extents().min_element().max(0.0);
        let mut bounds = self.bounds.loosened(margin);
        let ahead = self.way * AHEAD;
        bounds.mins += ahead.min(Vector::ZERO);
        bounds.maxs += ahead.max(Vector::ZERO);
        if !(bounds.mins.is_finite() && bounds.maxs.is_finite()) {
            bounds = Aabb::from_half_extents(Vector::ZERO, Vector::ZERO);
        }
        Place { bounds, ..*self }
    }
}

/// The pairs whose widened boxes intersect, at least one of each dynamic.
#[derive(Debug, Default)]
pub(super) struct NearPairs {
    /// The widened boxes, by the index of the solid or body.
    boxes: Vec<Place>,
    tree: Bvh,
    unbounded: Vec<u32>,
    /// The number of boxes that were replaced since all were made.
    replaced: usize,
    /// By index: true if the place has left its box.
    has_left: Vec<bool>,
    /// The pairs, in an order that depends on earlier steps. Within a pair the lower index is first, except that an
    /// unbounded one is last. At least one of a pair is dynamic.
    pub list: Vec<[u32; 2]>,
}

impl NearPairs {
    /// Follows the places: those that have left their boxes get new ones. All pairs are made anew if the list of places
    /// has changed.
    pub(super) fn refresh(&mut self, places: &[Place]) {
        let known = || self.boxes.iter().zip(places);
        let kind = |place: &Place| (place.dynamic, place.bounded);
        let alike = places.len() == self.boxes.len() && known().all(|(a, b)| kind(a) == kind(b));
        let leaves =
            |(known, now): (&Place, &Place)| now.bounded && !known.bounds.contains(&now.bounds);
        self.has_left.clear();
        self.has_left.extend(known().map(leaves));
        let count = self.has_left.iter().filter(|left| **left).count();
        self.replaced += count;
        if !alike || self.replaced as f64 > REPLACED * places.len() as f64 {
            self.make(places);
        } else if count > 0 {
            self.replace(places);
        }
    }

    /// Gives new boxes to the places that have left theirs.
    fn replace(&mut self, places: &[Place]) {
        let has_left = |number: u32| self.has_left[number as usize];
        let numbers = || (0..places.len() as u32).filter(|number| has_left(*number));
        for number in numbers() {
            let place = places[number as usize].widened();
            self.boxes[number as usize] = place;
            self.tree.insert(place.bounds, number);
        }
        let boxes = &self.boxes;
        let stays = |number: u32| !has_left(number);
        let list = &mut self.list;
        list.retain(|[a, b]| !boxes[*b as usize].bounded || stays(*a) && stays(*b));
        for number in numbers() {
            let own = &boxes[number as usize];
            for other in self.tree.intersect_aabb(&own.bounds) {
                // A pair of which both have left is found twice.
                let first = stays(other) || other > number;
                if first && (own.dynamic || boxes[other as usize].dynamic) {
                    list.push([number.min(other), number.max(other)]);
                }
            }
        }
    }

    fn make(&mut self, places: &[Place]) {
        self.replaced = 0;
        self.boxes.clear();
        self.boxes.extend(places.iter().map(Place::widened));
        let boxes = &self.boxes;
        let numbers = || (0..boxes.len() as u32).zip(boxes);
        self.unbounded.clear();
        let unbounded = numbers().filter(|(_, place)| !place.bounded);
        self.unbounded.extend(unbounded.map(|(number, _)| number));
        let bounded = || numbers().filter(|(_, place)| place.bounded);
        let leaves = bounded().map(|(number, place)| (number as usize, place.bounds));
        self.tree = hierarchy(leaves.collect());
        self.list.clear();
        let list = &mut self.list;
        let mut add = |pair: [u32; 2]| {
            if pair.iter().any(|number| boxes[*number as usize].dynamic) {
                list.push(pair);
            }
        };
        self.tree
            .traverse_bvtt_single_tree::<false>(&mut BvhWorkspace::default(), &mut |a, b| {
                add([a.min(b), a.max(b)]);
            });
        for wall in &self.unbounded {
            bounded().for_each(|(other, _)| add([other, *wall]));
        }
    }

    /// The indices whose widened boxes intersect `bounds`, and all unbounded ones.
    pub(super) fn around<'a>(&'a self, bounds: &'a Aabb) -> impl Iterator<Item = u32> + 'a {
        let near = self.tree.intersect_aabb(bounds);
        near.chain(self.unbounded.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes of several sizes on bent paths, some faster than their boxes are wide. The last is a half-space, and the
    /// centre of one is at times not finite.
    fn places(step: usize) -> Vec<Place> {
        let at = |number: usize, step: usize| {
            let (k, time) = (number as Real, step as Real * 0.02);
            let speed = if number.is_multiple_of(9) { 5.0 } else { 0.3 };
            let turn = Vector::new(k * 0.7, k * 1.3, k * 2.1) + Vector::splat(time * speed);
            Vector::new(turn.x.sin(), turn.y.cos(), turn.z.sin()) * 6.0
        };
        let place = |number: usize| {
            let lost = number == 7 && step % 16 > 10;
            let centre = if lost { Vector::NAN } else { at(number, step) };
            let half = Vector::splat(0.2 + 0.1 * (number % 5) as Real);
            Place {
                bounds: Aabb::from_half_extents(centre, half),
                way: at(number, step + 1) - at(number, step),
                dynamic: number % 4 != 1,
                bounded: number != 99,
            }
        };
        (0..100).map(place).collect()
    }

    /// Also if places move far between steps.
    #[test]
    fn each_pair_that_meets_is_listed_once() {
        let mut near = NearPairs::default();
        let (mut made, mut replaced) = (0, 0);
        for step in 0..300 {
            let places = places(step);
            near.refresh(&places);
            made += usize::from(near.replaced == 0);
            replaced += usize::from(near.replaced > 0);
            let mut list = near.list.clone();
            list.sort_unstable();
            let count = list.len();
            list.dedup();
            assert_eq!(list.len(), count, "a pair is there twice in step {step}");
            for (i, a) in (0_u32..).zip(&places) {
                for (j, b) in (0_u32..).zip(&places).skip(i as usize + 1) {
                    let meet = !b.bounded || a.bounds.intersects(&b.bounds);
                    let listed = list.binary_search(&[i, j]).is_ok();
                    let dynamic = a.dynamic || b.dynamic;
                    assert!(
                        listed || !(meet && dynamic),
                        "{i} misses {j} in step {step}"
                    );
                    assert!(dynamic || !listed, "neither {i} nor {j} is dynamic");
                }
            }
        }
        assert!(made.min(replaced) > 50, "{made} and {replaced}");
    }

    #[test]
    fn a_list_of_another_length_replaces_all_boxes() {
        let mut near = NearPairs::default();
        for count in [100, 3, 0, 100] {
            let first = 100 - count;
            near.refresh(&places(0)[first..]);
            assert_eq!(near.boxes.len(), count);
        }
    }
}
