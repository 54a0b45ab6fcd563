//! One rigid body, mostly in 64-bit precision: its state, inertia and free rotation, the wrench on it, and its
//! response to a wrench. Rapier's sets are read through [`Lookup`] only.

mod body;
mod body_set;
mod impact;
mod lookup;
mod mobility;
mod ordered;
mod principal_inertia;
mod rotation;
mod slowing;
mod small_turn;
mod state;
mod taylor_rotation;
mod tops;
mod wrench;

pub use wrench::Wrench;

pub(crate) use body::{
    Body, PartsMark, SMALLEST_TIME, drowsy, is_sound, origin_velocity, world_com,
};
pub(crate) use body_set::BodySet;
pub(crate) use impact::MidStepImpact;
pub(crate) use lookup::{Lookup, local_pose, world_pose};
pub(crate) use mobility::{
    Mobility, cross_matrix, eigen, join, of_wrench, pair, rounded, six, velocities,
};
pub(crate) use ordered::{find, find_by, find_next, find_next_place, is_in_order, sort_by_body};
pub(crate) use principal_inertia::PrincipalInertia;
pub(crate) use rotation::{COMPOSED_ENERGY_ERROR, ENERGY_ERROR, Inertia, steady_angvel};
pub(crate) use slowing::{Slowing, phi1, stopped};
pub(crate) use state::{RigidState, Turning};
pub(crate) use taylor_rotation::{Rotor, Top};
pub(crate) use tops::FreeTop;
