//! The bridge to Rapier: the walk over bodies that a step reads, and the only module that writes into Rapier's sets.

mod constrained;
mod error;
mod outlived;
mod read;
mod restless;
mod rollback;
mod sleep;
mod soft;
mod soft_load;
mod soft_volume;
mod stepped;
mod undo;
mod visit;
mod world;
mod write;

pub use error::StepError;
pub use sleep::WakePolicy;
pub use world::{WorldMut, WorldRef};

pub(crate) use constrained::Constraints;
pub(crate) use outlived::Outlived;
pub(crate) use read::{Reader, Walk, Wanted, are_few, is_movable, most_sleep};
pub(crate) use restless::{Balance, Drowsing};
pub(crate) use rollback::Rollback;
pub(crate) use sleep::{Resting, WakeRule};
pub(crate) use soft::SoftBodies;
pub(crate) use soft_load::{LentForces, SoftFlight, give_back};
pub(crate) use stepped::{Made, StepMark, Stepped};
pub(crate) use undo::Undo;
pub(crate) use visit::Visit;
pub(crate) use write::{
    ForceOverride, Push, apply, finish, let_precess, place, push, quarantine, restore, rouse,
    set_hooks, weigh, write,
};
