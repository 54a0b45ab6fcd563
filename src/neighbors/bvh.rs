//! Hierarchies of numbered bounding boxes, on top of Parry's `Bvh`: built once, or rebuilt in place while boxes
//! move, come and go.

use std::fmt;
use std::ops::{Deref, DerefMut};

use crate::rapier::parry::bounding_volume::Aabb;
use crate::rapier::parry::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};

/// Builds a hierarchy of numbered boxes.
pub(crate) fn hierarchy(boxes: Vec<(usize, Aabb)>) -> Bvh {
    // Parry's builder requires one or two boxes to be numbered from zero, and panics if they are not.
    if boxes.len() > 2 {
        return Bvh::from_iter(BvhBuildStrategy::Binned, boxes);
    }
    let mut tree = Bvh::new();
    for (number, bounds) in boxes {
        tree.insert(bounds, number as u32);
    }
    tree
}

/// A hierarchy whose boxes move. Each build reuses the buffers of the one before.
#[derive(Default)]
pub(crate) struct Hierarchy {
    tree: Bvh,
    workspace: BvhWorkspace,
}

impl Hierarchy {
    /// Rebuilds the hierarchy from the boxes given by number. A number with `None` is removed; numbers that are
    /// left out keep the box they have.
    pub(crate) fn build(&mut self, boxes: impl Iterator<Item = (u32, Option<Aabb>)>) {
        if self.tree.is_empty() {
            let boxes = boxes.filter_map(|(number, bounds)| Some((number as usize, bounds?)));
            self.tree = hierarchy(boxes.collect());
            return;
        }
        for (number, bounds) in boxes {
            match bounds {
                // Ancestors are updated by the rebuild below.
                Some(bounds) => drop(self.tree.insert_or_update_partially(bounds, number, 0.0)),
                None => self.tree.remove(number),
            }
        }
        self.tree
            .rebuild(&mut self.workspace, BvhBuildStrategy::Binned);
    }
}

impl Deref for Hierarchy {
    type Target = Bvh;

    fn deref(&self) -> &Bvh {
        &self.tree
    }
}

impl DerefMut for Hierarchy {
    fn deref_mut(&mut self) -> &mut Bvh {
        &mut self.tree
    }
}

impl fmt::Debug for Hierarchy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.tree.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Real, Vector};

    #[test]
    fn boxes_that_move_come_and_go_are_found_where_they_are() {
        let bounds = |number: u32, round: u32| {
            let gone = (number * 7 + round * 3).is_multiple_of(5) || number > 3 * round;
            let place = Real::from((number * 5 + round * round) as u16 % 40);
            (!gone).then(|| Aabb::new(Vector::splat(place), Vector::splat(place + 1.5)))
        };
        let mut tree = Hierarchy::default();
        for round in (0..12).chain((0..12).rev()) {
            tree.build((0..30).map(|number| (number, bounds(number, round))));
            for place in 0..42 {
                let here = Aabb::from_half_extents(Vector::splat(place as Real), Vector::ZERO);
                let mut found: Vec<u32> = tree.intersect_aabb(&here).collect();
                found.sort_unstable();
                let there = |number: &u32| {
                    let bounds = bounds(*number, round);
                    bounds.is_some_and(|b| b.mins.x <= here.maxs.x && b.maxs.x >= here.mins.x)
                };
                let expected: Vec<u32> = (0..30).filter(there).collect();
                assert_eq!(found, expected, "round {round}, at {place}");
            }
        }
    }

    #[test]
    fn a_few_boxes_may_have_any_numbers() {
        for count in 0..5 {
            let bounds =
                |k: usize| Aabb::new(Vector::splat(k as Real), Vector::splat(k as Real + 0.5));
            let tree = hierarchy((0..count).map(|k| (10 * k + 7, bounds(k))).collect());
            let everything = Aabb::new(Vector::splat(-1.0), Vector::splat(9.0));
            let mut found: Vec<u32> = tree.intersect_aabb(&everything).collect();
            found.sort_unstable();
            let expected: Vec<u32> = (0..count as u32).map(|k| 10 * k + 7).collect();
            assert_eq!(found, expected);
        }
    }
}
