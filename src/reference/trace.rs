//! The fate of each field on the way to the root.

use crate::math::{DVec3, RigidBodyHandle};

/// How the force at one sample came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// The force, in world axes; `None` where the composite is not defined.
    pub force: Option<DVec3>,
    /// One for each field, in the order of the walk; those of prototypes once for each instance.
    pub contributions: Vec<Contribution>,
}

/// One field at one sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Contribution {
    /// The field's place in the tree.
    pub place: u32,
    /// Its own force, in world axes, before any operator; `None` where it is not defined.
    pub force: Option<DVec3>,
    /// The potential energy of the sample in it, where the field has a potential.
    pub potential: Option<f64>,
    /// The body that carries the field.
    pub carrier: Option<RigidBodyHandle>,
    /// Whether it counts, and if not, why.
    pub fate: Fate,
}

impl Trace {
    /// The same, of something that stands for that part of what was asked.
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
    /// Of a field that does not act.
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

/// The fate of the force of one field.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fate {
    /// It is part of the result.
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
    /// Other fields took its place.
    Overruled {
        /// The operator.
        operator: &'static str,
        /// The places of those fields.
        by: Vec<u32>,
    },
    /// An intersection whose other operand is not defined here.
    Unmatched {
        /// The operator.
        operator: &'static str,
    },
    /// Only its region counts: it cuts a difference.
    Cuts,
}
