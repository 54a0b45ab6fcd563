//! A neighbour list of balls that outlives the step: it is made with a margin, and made again only once a ball
//! has moved or grown by more than half of it (Verlet, Phys. Rev. 159 (1967) 98).

use super::grid::{FEWEST_FOR_GRID, PointGrid};
use crate::math::{Real, Vector};

/// Margin of the list, as a share of the reach plus the largest radius. The list holds until a ball has moved
/// by half the margin. Measured on ammonia: from 0.1 to 0.25 the cost is flat.
const SKIN: Real = 0.15;

/// A ball around the parts of one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cluster {
    pub centre: Vector,
    pub radius: Real,
    /// Its parts, as a range of places in a list of parts.
    pub start: u32,
    pub end: u32,
}

/// Pairs of clusters whose surfaces are closer than a reach.
#[derive(Debug, Default)]
pub(crate) struct VerletList {
    reach: Real,
    skin: Real,
    /// The clusters as they were when the list was made.
    made_for: Vec<Cluster>,
    grid: PointGrid,
    centres: Vec<Vector>,
    /// For each cluster, where its neighbours start; one more for the end.
    starts: Vec<u32>,
    /// The neighbours of all clusters, one after the other: numbers of later clusters that are near.
    neighbours: Vec<u32>,
}

impl VerletList {
    /// Makes the list again unless it still holds all pairs of `clusters` closer than `reach`, surface to
    /// surface.
    pub(crate) fn refresh(&mut self, clusters: &[Cluster], reach: Real) {
        if !self.still_holds(clusters, reach) {
            self.make(clusters, reach);
        }
    }

    /// Clusters after `cluster` that may be within reach; some are a little farther.
    pub(crate) fn later(&self, cluster: usize) -> &[u32] {
        &self.neighbours[self.starts[cluster] as usize..self.starts[cluster + 1] as usize]
    }

    fn still_holds(&self, clusters: &[Cluster], reach: Real) -> bool {
        let slack = self.skin * 0.5;
        let like = |(is, was): (&Cluster, &Cluster)| {
            // A cluster that grew reaches farther, as if it had moved.
            let grown = (is.radius - was.radius).max(0.0);
            let moved = slack - grown;
            is.start == was.start
                && is.end == was.end
                && moved >= 0.0
                && (is.centre - was.centre).length_squared() <= moved * moved
        };
        reach == self.reach
            && clusters.len() == self.made_for.len()
            && !self.starts.is_empty()
            && clusters.iter().zip(&self.made_for).all(like)
    }

    fn make(&mut self, clusters: &[Cluster], reach: Real) {
        let largest = clusters
            .iter()
            .fold(0.0, |most: Real, cluster| most.max(cluster.radius));
        self.reach = reach;
        self.skin = SKIN * (reach + largest);
        self.made_for.clear();
        self.made_for.extend_from_slice(clusters);
        self.centres.clear();
        self.centres
            .extend(clusters.iter().map(|cluster| cluster.centre));
        let farthest = reach + self.skin + 2.0 * largest;
        let gridded = clusters.len() >= FEWEST_FOR_GRID;
        // Half the reach: finer cells fit the ball better than they cost in ranges.
        self.grid.build(
            &self.centres,
            if gridded { farthest * 0.5 } else { Real::MAX },
        );
        self.starts.clear();
        self.neighbours.clear();
        for (i, cluster) in clusters.iter().enumerate() {
            self.starts.push(self.neighbours.len() as u32);
            let (order, neighbours) = (self.grid.order(), &mut self.neighbours);
            let first = neighbours.len();
            let own = reach + self.skin + cluster.radius;
            self.grid
                .for_each_near(cluster.centre, own + largest, |run| {
                    for j in &order[run] {
                        let other = &clusters[*j as usize];
                        let reach = own + other.radius;
                        let apart = (cluster.centre - other.centre).length_squared();
                        if *j as usize > i && apart <= reach * reach {
                            neighbours.push(*j);
                        }
                    }
                });
            // Sums are taken in this order, so it must not depend on the grid.
            neighbours[first..].sort_unstable();
        }
        self.starts.push(self.neighbours.len() as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clusters(time: Real) -> Vec<Cluster> {
        let point = |i: Real| {
            Vector::new(
                (i * 0.7 + time).sin(),
                (i * 1.3).cos(),
                (i * 2.1 - time).sin(),
            ) * 9.0
        };
        (0..200)
            .map(|i| Cluster {
                centre: point(i as Real),
                radius: 0.1 + 0.01 * (i % 7) as Real,
                start: i,
                end: i + 1,
            })
            .collect()
    }

    /// However far things move between steps, no pair in reach is ever missing.
    #[test]
    fn holds_every_pair_in_reach_while_things_move() {
        let (mut list, reach) = (VerletList::default(), 2.0);
        let mut made = 0;
        for step in 0..200 {
            let clusters = clusters(step as Real * 0.003);
            let before = list.made_for.clone();
            list.refresh(&clusters, reach);
            made += usize::from(before != list.made_for);
            for (i, a) in clusters.iter().enumerate() {
                for (j, b) in clusters.iter().enumerate().skip(i + 1) {
                    if (a.centre - b.centre).length() <= reach + a.radius + b.radius {
                        assert!(
                            list.later(i).contains(&(j as u32)),
                            "{i} misses {j} at {step}"
                        );
                    }
                }
            }
        }
        assert!((2..100).contains(&made), "made {made} times in 200 steps");
    }

    #[test]
    fn notices_growth_and_new_clumps() {
        let (mut list, reach) = (VerletList::default(), 2.0);
        list.refresh(&clusters(0.0), reach);
        let mut grown = clusters(0.0);
        grown[0].radius += 8.0;
        list.refresh(&grown, reach);
        assert_eq!(list.made_for, grown);
        grown.truncate(3);
        list.refresh(&grown, reach);
        assert_eq!(list.starts.len(), 4);
        list.refresh(&[], reach);
        assert_eq!(list.starts.len(), 1);
    }
}
