//! The hooks of a Bevy app as an implementation of Rapier's trait.

use bevy_rapier3d::prelude::{
    BevyPhysicsHooks, ContactModificationContextView, PairFilterContextView,
};
use bevy_rapier3d::rapier::geometry::SolverFlags;
use bevy_rapier3d::rapier::pipeline::{
    ContactModificationContext, PairFilterContext, PhysicsHooks,
};

/// Passes Rapier's calls on to the hooks of an app.
pub(crate) struct AppHooks<H>(pub H);

impl<H: BevyPhysicsHooks> PhysicsHooks for AppHooks<H> {
    fn filter_contact_pair(&self, context: &PairFilterContext<'_>) -> Option<SolverFlags> {
        self.0
            .filter_contact_pair(PairFilterContextView { raw: context })
    }

    fn filter_intersection_pair(&self, context: &PairFilterContext<'_>) -> bool {
        self.0
            .filter_intersection_pair(PairFilterContextView { raw: context })
    }

    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        self.0
            .modify_solver_contacts(ContactModificationContextView { raw: context });
    }
}
