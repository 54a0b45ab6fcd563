//! Contacts of detection fields: which colliders touch, and how the fields answer (§3.3 of the paper *A Unified
//! Framework for Collision Detection, Avoidance, and Response*).
//!
//! `detector.rs` is the entry: `discrete.rs` finds overlaps at the end of a step, `sweep.rs` touches within it.
//! `ownership.rs` decides which side answers a pair: `solve.rs` answers contacts by their laws, `hooks.rs` keeps Rapier's
//! solver from answering the same contacts, and `hand_over.rs` returns those that do not separate to it.

mod approach;
mod capability;
mod conservative_advancement;
mod contact_body;
mod deeper;
mod detector;
mod discrete;
mod event;
mod field_contact;
mod field_mask;
mod hand_over;
mod hook_filter;
mod hooked;
mod hooks;
mod impact;
mod jointed;
mod laws;
mod lcp;
mod meet;
pub(crate) mod modes;
mod moving_shape;
mod near_pairs;
mod overlap;
mod ownership;
mod paper_push;
mod respond;
mod resting;
mod rules;
mod separation;
mod shape_gap;
mod solve;
mod starts;
mod sweep;
mod swept_body;
mod swept_parts;
mod time_of_impact;
mod touch_points;
mod touch_record;
mod trajectory;

pub use capability::{Capability, ContactPlan};
pub use event::ContactEvent;
pub use field_contact::FieldContact;
pub use hooks::StepHooks;

pub(crate) use detector::{Detector, SweptStep};
pub(crate) use event::report;
pub(crate) use hand_over::{Given, HandOver};
pub(crate) use hook_filter::HookFilter;
pub(crate) use hooked::HookedColliders;
pub(crate) use hooks::{HookLog, PairOutcomes, to_ask, was_to_ask};
pub(crate) use jointed::Joints;
pub(crate) use modes::{Detection, Responder};
pub(crate) use overlap::has_voxels;
pub(crate) use ownership::{Ownership, OwnershipRules, PairOwner};
pub(crate) use resting::HeldPairs;
pub(crate) use rules::{Pairs, ResponderRules, in_order};
pub(crate) use starts::{Arrival, KickShare, Starts};
pub(crate) use touch_record::{TouchRecord, TouchWay};
