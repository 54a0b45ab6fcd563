//! Decides if a set of fields acts at centres of mass only, so that bodies need no samples.

use super::entries::{RadialBatch, Weighting};
use super::program::{Instruction, Program};
use crate::field::{Axis, Coupling, Cuts, Drag, Field, Formula, Sampling, SamplingRule};
use crate::math::Real;

/// The largest number of sources and instances that are tried one by one; more need an index.
const MOST: usize = 16;

/// The bodies whose samples are all at their centres of mass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AtCentres {
    /// All bodies: the fields are sampled there.
    Bodies,
    /// Bodies without colliders, or of one ball around the centre of mass.
    Balls,
}

impl AtCentres {
    /// The bodies on which these fields can be evaluated at centres of mass; `None` if the fields need samples
    /// or an index.
    pub(super) fn of<'a>(
        radials: impl Iterator<Item = &'a RadialBatch>,
        programs: impl Iterator<Item = &'a Program>,
    ) -> Option<Self> {
        let (mut instances, mut bodies) = (0, AtCentres::Bodies);
        let (mut resting, mut flowing) = (false, 0);
        for batch in radials {
            instances += batch.sources.len();
            if instances > MOST || !batch.acts_at_centres() {
                return None;
            }
            if batch.sampling_rule.sampling != Sampling::Centre {
                bodies = AtCentres::Balls;
            }
        }
        for program in programs.filter(|program| program.has_force) {
            instances += program.instances.len();
            let drag = program.as_drag();
            let is_quadratic = drag.is_some_and(|drag| drag.quadratic != 0.0);
            if is_quadratic && matches!(program.leaves[0].formula, Formula::Drag(_)) {
                resting = true;
            } else if is_quadratic {
                flowing += program.instances.len();
            }
            let solved = !program.reads_velocity || drag.is_some();
            if instances > MOST || !solved || !program.acts_at_centres() {
                return None;
            }
            if program.sampling_rule.sampling != Sampling::Centre {
                bodies = AtCentres::Balls;
            }
        }
        // Quadratic drag has an axis, its velocity relative to the medium, and a `Slowing` has at most one axis.
        let axes = usize::from(resting) + flowing;
        (axes <= 1).then_some(bodies)
    }
}

impl RadialBatch {
    /// Returns true if it can be evaluated at centres of mass, where bodies allow it.
    fn acts_at_centres(&self) -> bool {
        let Weighting {
            groups, coupling, ..
        } = &self.weighting;
        is_sampled_once(self.sampling_rule) && groups.is_none() && is_of_mass(coupling)
    }
}

/// Returns true if a body of one ball is sampled at its centre only, whatever the properties of its collider.
fn is_sampled_once(rule: SamplingRule) -> bool {
    let spares_balls = match rule.sampling {
        Sampling::Centre | Sampling::Parts => true,
        _ => rule.auto,
    };
    spares_balls && rule.cuts == Cuts::Never && !rule.apart
}

/// Returns true if the coupling depends on no property of a body but its mass.
fn is_of_mass(coupling: &Coupling) -> bool {
    match coupling {
        Coupling::Share | Coupling::Each => true,
        Coupling::Axis(axis) => *axis == Axis::Mass,
    }
}

impl Program {
    /// Returns true if it can be evaluated at centres of mass, where bodies allow it.
    fn acts_at_centres(&self) -> bool {
        let of_mass = |leaf: &Field| is_of_mass(&leaf.coupling) && leaf.groups.is_none();
        is_sampled_once(self.sampling_rule)
            && self.in_lanes
            && !self.reacts
            && self.leaves.iter().all(of_mass)
    }

    /// The law, if the program is one drag or wind whose coefficients are not negative and whose force depends
    /// only on the velocity relative to the medium. Such a force has closed forms.
    pub(crate) fn as_drag(&self) -> Option<&Drag> {
        let ([Instruction::Leaf(0)], [leaf]) = (&self.steps[..], &self.leaves[..]) else {
            return None;
        };
        let drag = match &leaf.formula {
            Formula::Drag(drag) => drag,
            Formula::Wind(wind) => {
                let follows = wind.speed_cap == Real::INFINITY && !wind.flow.reads_velocity();
                follows.then_some(&wind.drag)?
            }
            _ => return None,
        };
        let even = leaf.scale.is_none() && leaf.limit.is_none();
        let shared = leaf.coupling == Coupling::Share;
        let slows = drag.linear >= 0.0 && drag.quadratic >= 0.0;
        (even && shared && slows).then_some(drag)
    }
}
