//! Detect and respond (§3.3): who touches whom, and what follows.

mod guard;
mod respond;
mod touch;

use crate::compile::Compiled;
use crate::eval::{Moment, Probes};
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, ColliderSet, Real, RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::geometry::{Group, InteractionGroups};

use guard::Guards;
use touch::Touch;

/// Who answers the contacts that fields detect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
pub enum Responder {
    /// Rapier's solver; fields only observe.
    Rapier,
    /// The fields, by their laws. Rapier still finds and reports contacts between two colliders
    /// that both have a detection field, but does not solve them: their `solver_groups` become
    /// [`Responder::groups`]. Contacts with all other colliders stay Rapier's.
    #[default]
    Fields,
    /// Both, each by its own rule.
    Both,
}

impl Responder {
    /// The solver groups of colliders whose contacts with each other the fields answer: members
    /// of the last group, which do not meet that group.
    pub fn groups() -> InteractionGroups {
        InteractionGroups {
            memberships: Group::GROUP_32,
            filter: Group::ALL - Group::GROUP_32,
            ..InteractionGroups::all()
        }
    }
}

/// A contact found by detection fields.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FieldContact {
    /// The colliders, in the order of their handles.
    pub colliders: [ColliderHandle; 2],
    /// Their bodies.
    pub bodies: [Option<RigidBodyHandle>; 2],
    /// The middle of the overlap.
    pub world_point: Vector,
    /// Unit vector from the first to the second.
    pub world_normal: Vector,
    /// How far they overlap; more than zero.
    pub depth: Real,
    /// How fast the two approached along the normal when found; negative if they parted.
    pub approach_speed: Real,
    /// The impulses that the fields gave the two bodies, fixed ones included; zero if the fields
    /// did not answer.
    pub impulses: [Vector; 2],
    /// The law of the pair.
    pub law: ContactLaw,
    /// Which of the two have a detection field.
    pub has_field: [bool; 2],
}

/// Finds contacts and answers them; keeps its buffers between calls.
#[derive(Debug)]
pub(crate) struct Detection {
    touch: Touch,
    guards: Guards,
    /// What touches what, in the order of the handles.
    pub contacts: Vec<FieldContact>,
}

impl Detection {
    pub(crate) fn new(compiled: &Compiled) -> Self {
        Detection {
            touch: Touch::new(compiled),
            guards: Guards::default(),
            contacts: Vec::new(),
        }
    }

    /// Finds all contacts at the present poses. `probes` fills in what a detection field under
    /// operators may ask of what approaches it.
    pub(crate) fn run(
        &mut self,
        compiled: &Compiled,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        moment: Moment,
        probes: impl FnOnce(&mut Probes),
    ) {
        self.contacts.clear();
        self.touch.gather(bodies, colliders);
        self.touch.find(bodies, &mut self.contacts);
        if compiled
            .detectors
            .iter()
            .any(|detector| detector.guard.is_some())
        {
            self.guards.refresh(compiled, bodies, colliders, probes);
            let (touch, guards) = (&self.touch, &mut self.guards);
            self.contacts.retain(|contact| {
                let [first, second] = contact.colliders;
                [(first, second), (second, first)]
                    .into_iter()
                    .any(|(owner, other)| {
                        let detectors = touch.detectors_of(owner).iter();
                        detectors.copied().any(|d| {
                            guards.lets_through(
                                compiled,
                                &compiled.detectors[d as usize],
                                other,
                                moment,
                            )
                        })
                    })
            });
        }
        let key = |contact: &FieldContact| contact.colliders.map(ColliderHandle::into_raw_parts);
        self.contacts.sort_unstable_by_key(key);
    }

    /// Answers the contacts by their laws; returns how many bodies were written.
    pub(crate) fn respond(&mut self, bodies: &mut RigidBodySet) -> usize {
        respond::respond(&mut self.contacts, bodies)
    }

    /// Gives the colliders of all detection fields the groups that keep Rapier from solving
    /// their contacts with each other.
    pub(crate) fn claim(compiled: &Compiled, colliders: &mut ColliderSet) {
        for detector in &compiled.detectors {
            let groups = colliders.get(detector.collider).map(|c| c.solver_groups());
            if groups.is_some_and(|groups| groups != Responder::groups())
                && let Some(collider) = colliders.get_mut(detector.collider)
            {
                collider.set_solver_groups(Responder::groups());
            }
        }
    }
}
