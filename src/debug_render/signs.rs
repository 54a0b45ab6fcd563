//! The solids of a region, with the sign by which each is added or cut away.

use crate::field::region::Region;
use crate::field::visit::{RegionStep, Solid};
use crate::math::Pose;

/// A solid of a region.
pub(super) struct SignedSolid<'a> {
    pub solid: &'a Solid,
    /// Its frame in that of the field.
    pub local_pose: Pose,
    /// True if the solid is cut away, so that the region lies outside of it.
    pub is_cut: bool,
}

/// The solids of a region, in the order in which they were given.
pub(super) fn signed_solids(region: &Region) -> Vec<SignedSolid<'_>> {
    let mut solids: Vec<SignedSolid<'_>> = Vec::new();
    // Where the solids of each set on the stack begin. They reach to where those of the next one begin.
    let mut starts: Vec<usize> = Vec::new();
    for step in region.steps() {
        match step {
            RegionStep::Complement => {
                let start = starts.last().copied().unwrap_or_default();
                turn(&mut solids[start..]);
            }
            RegionStep::Union | RegionStep::Intersection => {
                starts.pop();
            }
            RegionStep::Difference => {
                let start = starts.pop().unwrap_or_default();
                turn(&mut solids[start..]);
            }
            set => {
                starts.push(solids.len());
                if let RegionStep::Solid(solid, local_pose) = set {
                    solids.push(SignedSolid {
                        solid,
                        local_pose: *local_pose,
                        is_cut: false,
                    });
                }
            }
        }
    }
    solids
}

fn turn(solids: &mut [SignedSolid<'_>]) {
    for solid in solids {
        solid.is_cut = !solid.is_cut;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vector;

    #[test]
    fn differences_and_complements_turn_the_sign() {
        let ball = |radius| Region::ball(radius).at(Vector::X * radius);
        let shell = ball(1.0).difference(ball(2.0).union(ball(3.0).complement()));
        let during = Region::interval("time", 0.0, 1.0);
        let region = shell.intersection(during).complement();
        let solids = signed_solids(&region);
        let cut: Vec<bool> = solids.iter().map(|solid| solid.is_cut).collect();
        assert_eq!(cut, [true, false, true]);
        let places: Vec<_> = solids
            .iter()
            .map(|solid| solid.local_pose.translation.x)
            .collect();
        assert_eq!(places, [1.0, 2.0, 3.0]);
    }
}
