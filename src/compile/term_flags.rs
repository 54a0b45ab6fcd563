//! Flags of single terms, and the number of terms that have each flag, which a change of one term updates without
//! visiting the others.

use super::requirements::{PartSampling, SamplingRequirements};
use crate::field::{Anchor, Axis, Nodes, Points};

/// Flags of a term, one bit for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct TermFlags(u32);

impl TermFlags {
    /// Depends on velocities.
    pub(super) const READS_VELOCITY: u32 = 0;
    /// Names one of the user's axes.
    pub(super) const READS_USER_AXES: u32 = 1;
    /// Changes with time by itself.
    pub(super) const READS_TIME: u32 = 2;
    /// Is anchored, at least in part, to a body or collider.
    pub(super) const MOVES: u32 = 3;
    /// Can turn a body.
    pub(super) const TURNS: u32 = 4;
    /// Gives forces that differ from place to place.
    pub(super) const VARIES: u32 = 5;
    /// Gives forces at any distance.
    pub(super) const UNBOUNDED: u32 = 6;
    /// Has a field that can never act.
    pub(super) const LEFT_OUT: u32 = 7;
    /// This and the next four are the fields of [`SamplingRequirements`] with these names.
    const PARTS: u32 = 8;
    const DISPLACED: u32 = 9;
    const PIECES: u32 = 10;
    const POINTS: u32 = 11;
    const APART: u32 = 12;
    /// Depends on velocities, and is not drag or wind in closed form.
    pub(super) const READS_VELOCITY_OTHERWISE: u32 = 13;
    /// Does not depend on velocities.
    pub(super) const IGNORES_VELOCITY: u32 = 14;
    /// Samples parts other than balls at the first of [`Points::ALL`]; the next flags are for the other points.
    const SEVERAL: u32 = 15;
    /// The same for balls, too.
    const SEVERAL_OF_BALLS: u32 = Self::SEVERAL + Points::ALL.len() as u32;
    const COUNT: usize = Self::SEVERAL_OF_BALLS as usize + Points::ALL.len();

    pub(super) fn set(&mut self, flag: u32) {
        self.0 |= 1 << flag;
    }

    pub(super) fn set_if(&mut self, flag: u32, holds: bool) {
        self.0 |= u32::from(holds) << flag;
    }

    pub(super) fn holds(self, flag: u32) -> bool {
        self.0 & (1 << flag) != 0
    }

    /// Adds the sampling requirements of a term.
    pub(super) fn require(&mut self, wanted: &SamplingRequirements) {
        self.set_if(Self::PARTS, wanted.parts);
        for (flag, sampling) in (0..).zip(wanted.several) {
            self.set_if(Self::SEVERAL + flag, sampling >= PartSampling::AllButBalls);
            self.set_if(Self::SEVERAL_OF_BALLS + flag, sampling == PartSampling::All);
        }
        self.set_if(Self::DISPLACED, wanted.displaced);
        self.set_if(Self::PIECES, wanted.pieces);
        self.set_if(Self::POINTS, wanted.points);
        self.set_if(Self::APART, wanted.apart);
    }

    /// The flags that follow from the axes, code and anchors at the nodes of a term.
    pub(super) fn of_nodes(nodes: Nodes<'_>, below: &[u32]) -> TermFlags {
        let mut flags = TermFlags::default();
        let moves = |anchor: &Anchor| !matches!(anchor, Anchor::World { .. });
        for place in below {
            for axis in nodes.axes_at(*place) {
                flags.set_if(Self::READS_VELOCITY, axis.reads_velocity());
                flags.set_if(Self::READS_TIME, *axis == Axis::Time);
                flags.set_if(Self::READS_USER_AXES, matches!(axis, Axis::User(_)));
            }
            let by_code = nodes.scale(*place).is_some_and(|scale| scale.has_code());
            flags.set_if(Self::READS_TIME, by_code);
            if let Some(field) = nodes.field(*place).filter(|field| field.enabled) {
                flags.set_if(Self::READS_VELOCITY, field.reads_velocity());
                flags.set_if(Self::READS_TIME, field.reads_time());
            }
            flags.set_if(Self::MOVES, nodes.anchors_at(*place).iter().any(moves));
        }
        flags.set_if(Self::IGNORES_VELOCITY, !flags.holds(Self::READS_VELOCITY));
        flags
    }
}

/// For each flag, the number of terms that have it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct FlagCounts([u32; TermFlags::COUNT]);

impl FlagCounts {
    /// Counts the new flags of a term in place of its old ones.
    pub(super) fn replace(&mut self, old: TermFlags, new: TermFlags) {
        for (flag, count) in (0..).zip(&mut self.0) {
            *count += u32::from(new.holds(flag));
            *count -= u32::from(old.holds(flag));
        }
    }

    /// Returns true if any term has the flag.
    pub(super) fn any(&self, flag: u32) -> bool {
        self.0[flag as usize] > 0
    }

    /// The sampling requirements of all terms together.
    pub(super) fn wanted(&self) -> SamplingRequirements {
        let several = |points: usize| {
            let of = |first: u32| self.any(first + points as u32);
            match (of(TermFlags::SEVERAL), of(TermFlags::SEVERAL_OF_BALLS)) {
                (_, true) => PartSampling::All,
                (true, _) => PartSampling::AllButBalls,
                _ => PartSampling::None,
            }
        };
        SamplingRequirements {
            parts: self.any(TermFlags::PARTS),
            several: std::array::from_fn(several),
            displaced: self.any(TermFlags::DISPLACED),
            pieces: self.any(TermFlags::PIECES),
            points: self.any(TermFlags::POINTS),
            apart: self.any(TermFlags::APART),
        }
    }
}
