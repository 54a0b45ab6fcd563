//! A log of single fields at one sample: the force of each before any operator, and whether it is part of the
//! composite's force.

use crate::math::{DVec3, RigidBodyHandle};

/// The forces that the composite's force at one sample is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// The force, in world axes; `None` where the composite is not defined.
    pub force: Option<DVec3>,
    /// One for each field, in the order of the walk. A field of a prototype has one for each instance.
    pub contributions: Vec<Contribution>,
}

/// The force of one field at one sample, and whether it counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Contribution {
    /// The number of the field's node in the tree.
    pub place: u32,
    /// The field's own force, in world axes, before any operator; `None` where the field does not act.
    pub force: Option<DVec3>,
    /// The potential energy of the sample in the field (J), where the field has a potential.
    pub potential: Option<f64>,
    /// The body that carries the field.
    pub carrier: Option<RigidBodyHandle>,
    /// [`Fate::Counts`] if the force is part of the result; otherwise the reason why it is not.
    pub fate: Fate,
}

impl Trace {
    /// The trace with forces and energies multiplied by `weight`, for a sample that stands for that fraction of
    /// a part.
    pub(crate) fn times(mut self, weight: f64) -> Self {
        let scale = |force: &mut Option<DVec3>| *force = force.map(|force| force * weight);
        scale(&mut self.force);
        for contribution in &mut self.contributions {
            scale(&mut contribution.force);
            contribution.potential = contribution.potential.map(|energy| energy * weight);
        }
        self
    }
}

impl Contribution {
    /// The contribution of a field that does not act.
    pub(super) fn none(place: u32, fate: Fate) -> Self {
        Contribution {
            place,
            force: None,
            potential: None,
            carrier: None,
            fate,
        }
    }
}

/// Whether the force of one field is part of the composite's force, or the reason why it is not.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fate {
    /// It is part of the composite's force.
    Counts,
    /// The sample is not in its region.
    OutsideRegion,
    /// The sample belongs to the body that carries the field.
    OwnBody,
    /// Its groups and those of the collider do not interact.
    OtherGroups,
    /// It is disabled, or not within its lifetime.
    Off,
    /// The body or collider it is anchored to is gone.
    AnchorGone,
    /// Other fields replaced it.
    Overruled {
        /// The operator.
        operator: &'static str,
        /// The numbers of the nodes of those fields.
        by: Vec<u32>,
    },
    /// It is an operand of an intersection whose other operand is not defined at the sample.
    Unmatched {
        /// The operator.
        operator: &'static str,
    },
    /// Only its region counts: the field is the subtrahend of a difference.
    Cuts,
}
