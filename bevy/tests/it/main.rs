//! Apps without a window, against closed forms and against the crate without Bevy.

mod support;

mod changes;
mod events;
mod frames;
mod gizmos;
mod hooks;
mod logged;
mod modes;
mod refused;
mod saved;
mod snapshots;
mod zones;
