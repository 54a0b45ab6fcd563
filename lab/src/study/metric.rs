//! The metrics of errors.

/// The quantity of an error. [`definition`](Self::definition) gives the formula. Chaotic scenes do not use final
/// positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Metric {
    /// Error of positions and velocities at the end.
    FinalState,
    /// Error of attitudes at the end.
    Attitude,
    /// Largest error of the energy.
    Energy,
    /// Error of the positions of atoms at the end.
    AtomPosition,
    /// Error of the velocities after an impact: median of the pairs.
    Velocity,
    /// Error of the velocities after an impact: 95th percentile of the pairs.
    Velocity95,
    /// Error of the velocities after an impact: largest of the pairs.
    VelocityWorst,
    /// Error of the time of an impact: median of the pairs.
    ContactTime,
    /// Share of impacts that were not answered.
    Missed,
    /// Share of the events of the exact run that are not reproduced in order.
    EventOrder,
    /// Largest error of the height of a bounce.
    Apex,
    /// Depth of overlap between bodies at rest.
    Overlap,
    /// Distance by which a resting body has moved.
    Slip,
    /// Share of near misses that were answered.
    Invented,
    /// Error of the number of collisions.
    Count,
    /// Error of the rate of collisions between two bodies.
    CollisionRate,
    /// Distance of the distribution of speeds from the exact one.
    Speeds,
    /// Rate of the drift of energy.
    EnergyDrift,
    /// Error of the angular momentum.
    AngularMomentum,
    /// Error of the temperature.
    Temperature,
    /// Error of the ratio of the energies of translation and rotation.
    Equipartition,
    /// Error of the distribution of distances.
    PairDistances,
    /// Speed of bodies that should rest.
    Unrest,
    /// Time at which a heap has come to rest.
    Settling,
    /// Error of positions at the end, relative to the scene's own converged run.
    OwnPosition,
    /// Error of attitudes at the end, relative to the scene's own converged run.
    OwnAttitude,
}

use Metric::*;

impl Metric {
    /// All metrics.
    pub const ALL: [Metric; 26] = [
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
        Invented,
        Count,
        CollisionRate,
        Speeds,
        EnergyDrift,
        AngularMomentum,
        Temperature,
        Equipartition,
        PairDistances,
        Unrest,
        Settling,
        OwnPosition,
        OwnAttitude,
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
            Invented => "invented",
            Count => "number of collisions",
            CollisionRate => "collision rate",
            Speeds => "speeds",
            EnergyDrift => "energy drift rate",
            AngularMomentum => "angular momentum",
            Temperature => "temperature",
            Equipartition => "equipartition",
            PairDistances => "g(r)",
            Unrest => "unrest",
            Settling => "settling time",
            OwnPosition => "own position",
            OwnAttitude => "own attitude",
        }
    }

    /// The metric of that [name](Self::name).
    pub fn named(name: &str) -> Option<Metric> {
        Self::ALL.into_iter().find(|metric| metric.name() == name)
    }

    /// The unit; `1` for a ratio.
    pub fn unit(self) -> &'static str {
        match self {
            Attitude | OwnAttitude => "rad",
            AtomPosition => "Å",
            ContactTime => "flight times",
            EnergyDrift => "1/time unit",
            Unrest => "m/s",
            Settling => "s",
            _ => "1",
        }
    }

    /// How the error is computed, and by what it is divided.
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
            Invented => "share of pairs that pass without touching whose velocities changed",
            Count => "|collisions / those of the exact run - 1|",
            CollisionRate => {
                "|collisions of two in a unit of time / those of an exact run of 60,000 events, at the same mean square \
                 speed, - 1|"
            }
            Speeds => {
                "largest distance (Kolmogorov-Smirnov) of the distribution of v^2 / sum v^2 from Beta(3/2, 3(N-1)/2), \
                 sampled every 5 mean free times"
            }
            EnergyDrift => {
                "|slope of the straight line through E(t)| / kinetic energy at the start, per unit of time"
            }
            AngularMomentum => {
                "largest |L - L(0)| about the centre / sum of |m x cross v| + |I w| at the start"
            }
            Temperature => {
                "|mean kinetic energy over the second half / that of the run in f64 at the smallest step - 1|"
            }
            Equipartition => {
                "|kinetic energy of translation / of rotation, means over the second half, / that of the run in f64 at the \
                 smallest step - 1|"
            }
            PairDistances => {
                "half the sum of |differences| of the histograms (bins of 0.25 Å, mean over the second half) from \
                 that of the run in f64 at the smallest step"
            }
            Unrest => "largest speed of a body in the last second",
            Settling => "when the last body was faster than 0.1 m/s",
            OwnPosition => {
                "root mean square distance of the bodies at the end from the run in f64 at the smallest step / root mean \
                 square way that they go in it"
            }
            OwnAttitude => {
                "largest angle between an attitude at the end and the run in f64 at the smallest step"
            }
        }
    }

    /// Why scenes are compared by it.
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
            Invented => "a contact that is not there stops what should pass",
            Count => "it is a digit string of pi: one impact too few, and all after it are wrong",
            CollisionRate => {
                "late, missed and doubled contacts change it, and it is what a gas is made for: its pressure and its mixing"
            }
            Speeds => {
                "the exact law for hard spheres at constant energy, however chaotic their paths"
            }
            EnergyDrift => "what heats or cools a long run, apart from what swings and comes back",
            AngularMomentum => "kept by all forces of the scene: errors of torques show here first",
            Temperature | PairDistances => {
                "means that survive chaos, and what such runs are made for"
            }
            Equipartition => "shows rotation that is damped or heated apart from motion",
            Unrest | Settling => "a heap should come to rest, soon, and stay so",
            OwnPosition | OwnAttitude => "nothing else is known of a scene of one's own",
        }
    }
}
