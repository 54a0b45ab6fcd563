//! Who answers which contact.

use std::collections::HashSet;

use super::{FieldContact, Responder};
use crate::math::{ColliderHandle, ColliderSet};
use crate::rapier::geometry::SolverFlags;
use crate::rapier::pipeline::{ActiveHooks, PairFilterContext, PhysicsHooks};

/// The responder of all contacts, and exceptions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rules {
    pub everywhere: Responder,
    /// Contacts between two of a set; the last that fits counts.
    pub among: Vec<(HashSet<ColliderHandle>, Responder)>,
}

impl Rules {
    pub(crate) fn of(&self, colliders: [ColliderHandle; 2]) -> Responder {
        let fits = |set: &HashSet<ColliderHandle>| colliders.iter().all(|c| set.contains(c));
        let rule = self.among.iter().rev().find(|(set, _)| fits(set));
        rule.map_or(self.everywhere, |(_, responder)| *responder)
    }

    /// Whether fields answer a contact.
    pub(crate) fn answers(&self, contact: &FieldContact) -> bool {
        self.of(contact.colliders) != Responder::Rapier
    }

    /// Whether solver groups cannot say who answers the contacts of a collider.
    pub(super) fn is_exceptional(&self, collider: ColliderHandle) -> bool {
        self.among.iter().any(|(set, _)| set.contains(&collider))
    }

    pub(super) fn listen(&self, colliders: &mut ColliderSet) {
        for handle in self.among.iter().flat_map(|(set, _)| set) {
            if let Some(collider) = colliders.get_mut(*handle) {
                let hooks = collider.active_hooks() | ActiveHooks::FILTER_CONTACT_PAIRS;
                collider.set_active_hooks(hooks);
            }
        }
    }
}

/// Tells Rapier which contacts not to solve, for [responders of
/// their own](crate::FieldsBuilder::responder_among); everything else it lets pass.
///
/// [`Fields::step`](crate::Fields::step) hands it over; around a pipeline of one's own, that is to
/// be given it, or hooks that ask it.
#[derive(Clone, Debug)]
pub struct ResponderHooks {
    pub(crate) rules: Rules,
    /// Colliders with a detection field.
    pub(crate) detecting: HashSet<ColliderHandle>,
}

impl PhysicsHooks for ResponderHooks {
    fn filter_contact_pair(&self, context: &PairFilterContext<'_>) -> Option<SolverFlags> {
        let pair = [context.collider1, context.collider2];
        let exceptional = pair.iter().any(|c| self.rules.is_exceptional(*c));
        let detected = pair.iter().all(|c| self.detecting.contains(c));
        if exceptional && detected && self.rules.of(pair) == Responder::Fields {
            return Some(SolverFlags::empty());
        }
        Some(SolverFlags::COMPUTE_RIGID_IMPULSES)
    }
}
