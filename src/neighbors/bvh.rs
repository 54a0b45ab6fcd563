//! Hierarchies of bounding boxes.

use crate::rapier::parry::bounding_volume::Aabb;
use crate::rapier::parry::partitioning::{Bvh, BvhBuildStrategy};

/// A hierarchy of numbered boxes.
pub(crate) fn hierarchy(boxes: Vec<(usize, Aabb)>) -> Bvh {
    // Parry takes one or two boxes to be numbered from zero, and panics if they are not.
    if boxes.len() > 2 {
        return Bvh::from_iter(BvhBuildStrategy::Binned, boxes);
    }
    let mut tree = Bvh::new();
    for (number, bounds) in boxes {
        tree.insert(bounds, number as u32);
    }
    tree
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Real, Vector};

    #[test]
    fn few_boxes_of_any_number() {
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
