//! What errors are errors of.

/// What an error is an error of. Chaotic scenes are not judged by where their bodies end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Metric {
    /// Of positions and velocities at the end.
    FinalState,
    /// Of attitudes at the end.
    Attitude,
    /// Of the energy, at its worst.
    Energy,
    /// Of the positions of atoms at the end.
    AtomPosition,
    /// Of the velocities after an impact: half of the pairs are better.
    Velocity,
    /// Of the velocities after an impact: 95 % of the pairs are better.
    Velocity95,
    /// Of the velocities after an impact: the worst pair.
    VelocityWorst,
    /// Of the time of an impact: half of the pairs are better.
    ContactTime,
    /// Share of impacts that were not answered.
    Missed,
    /// Share of the events of the exact run that are not reproduced in order.
    EventOrder,
    /// Of the height of a bounce, at its worst.
    Apex,
    /// How deep what rests lies in what it rests on.
    Overlap,
    /// How far what rests has moved.
    Slip,
}

use Metric::*;

impl Metric {
    /// All metrics.
    pub const ALL: [Metric; 13] = [
        FinalState,
        Attitude,
        Energy,
        AtomPosition,
        Velocity,
        Velocity95,
        VelocityWorst,
        ContactTime,
        Missed,
        EventOrder,
        Apex,
        Overlap,
        Slip,
    ];

    /// The name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            FinalState => "final state",
            Attitude => "attitude",
            Energy => "energy",
            AtomPosition => "atom position",
            Velocity => "velocity median",
            Velocity95 => "velocity 95 %",
            VelocityWorst => "velocity worst",
            ContactTime => "contact time",
            Missed => "missed",
            EventOrder => "events out of order",
            Apex => "apex",
            Overlap => "overlap at rest",
            Slip => "slip",
        }
    }

    /// The metric of that [name](Self::name).
    pub fn named(name: &str) -> Option<Metric> {
        Self::ALL.into_iter().find(|metric| metric.name() == name)
    }

    /// The unit; 1 if it is a ratio.
    pub fn unit(self) -> &'static str {
        match self {
            Attitude => "rad",
            AtomPosition => "Å",
            ContactTime => "flight times",
            _ => "1",
        }
    }

    /// How the error is worked out and what it is divided by.
    pub fn definition(self) -> &'static str {
        match self {
            FinalState => {
                "root mean square over the bodies of |(dx / length, dv / speed)| at the end, with the length and \
                 speed of the scene, against the reference"
            }
            Attitude => "largest angle between an attitude at the end and the reference",
            Energy => {
                "largest |E - E(0)| over all steps, over the kinetic energy of length and speed of the scene"
            }
            AtomPosition => {
                "root mean square distance of the atoms at the end from the reference trajectory"
            }
            Velocity => {
                "largest |dv| of the two spheres / largest speed before or after, median over pairs"
            }
            Velocity95 => {
                "largest |dv| of the two spheres / largest speed before or after, 95 % of pairs"
            }
            VelocityWorst => {
                "largest |dv| of the two spheres / largest speed before or after, worst pair"
            }
            ContactTime => {
                "|time of the answer - exact time of contact| / flight time, median over pairs; \
                 infinite for a pair that was not answered"
            }
            Missed => "share of pairs whose velocities never changed",
            EventOrder => {
                "share of the first 60 collisions of the exact run that come after the first which is missing, \
                 invented or out of order"
            }
            Apex => "largest |height of an apex / height of the exact one - 1|",
            Overlap => "deepest overlap of two neighbours at the end / their size",
            Slip => "farthest that a body moved sideways / its size",
        }
    }

    /// Why scenes are judged by it.
    pub fn reason(self) -> &'static str {
        match self {
            FinalState | Attitude | AtomPosition => {
                "where errors grow slowly, the end holds those of all steps"
            }
            Energy => {
                "bounded for a good scheme however long the run; what grows becomes visible heat"
            }
            Velocity | Velocity95 | VelocityWorst => "what an impact is for",
            ContactTime => "discrete detection is late by half a step in the mean",
            Missed => "one that is missed is a bug, not a statistic",
            EventOrder => "the billiard is chaotic: the order of its events is what survives",
            Apex => "a bounce that gains or loses is seen by everyone",
            Overlap | Slip => "what rests should lie on its ground, and stay there",
        }
    }
}
