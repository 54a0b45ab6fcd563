//! Divides points into halves of halves, so that neighbours share a group.

use crate::math::DVec3;

/// Partitions items along the axis of their largest extent: the first `at` items have no larger coordinate than the
/// others. Both sides are given by their number of items, so one distant item does not coarsen the other groups.
pub(super) fn part<T>(items: &mut [T], at: usize, point: impl Fn(&T) -> DVec3) {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let points = items.iter().map(&point);
    let (low, high) = points.fold(none, |(low, high), it| (low.min(it), high.max(it)));
    let axis = (high - low).max_position();
    items.select_nth_unstable_by(at, |a, b| point(a)[axis].total_cmp(&point(b)[axis]));
}

/// Reorders items so that each chunk of `size` consists of neighbours.
pub(super) fn gather<T>(items: &mut [T], size: usize, point: &impl Fn(&T) -> DVec3) {
    if items.len() <= size {
        return;
    }
    let middle = (items.len() / 2).next_multiple_of(size);
    part(items, middle, point);
    let (before, after) = items.split_at_mut(middle);
    gather(before, size, point);
    gather(after, size, point);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a line, shuffled, with one of them very far away.
    #[test]
    fn gathering_puts_neighbours_into_one_chunk() {
        let place = |number: usize| match number {
            700 => 1e30,
            number => (number * 577 % 1013) as f64,
        };
        let mut points: Vec<_> = (0..1013).map(|number| DVec3::Y * place(number)).collect();
        gather(&mut points, 8, &|point| *point);
        let spread = |points: &[DVec3]| {
            let ends = points.iter().map(|point| point.y);
            ends.clone().fold(0.0, f64::max) - ends.fold(f64::INFINITY, f64::min)
        };
        let wide = points.chunks(8).filter(|points| spread(points) > 8.0);
        assert_eq!(wide.count(), 1, "the one with the far point");
    }

    #[test]
    fn gathering_keeps_every_item() {
        for count in [0, 1, 8, 9, 15, 16, 17, 100] {
            let mut numbers: Vec<usize> = (0..count).collect();
            gather(&mut numbers, 8, &|n| {
                DVec3::new((*n % 3) as f64, f64::NAN, 1.0)
            });
            numbers.sort_unstable();
            assert!(numbers.into_iter().eq(0..count));
        }
    }
}
