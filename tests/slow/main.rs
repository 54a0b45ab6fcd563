//! Tests that run too long for daily use, or need external data: all are ignored by default.
//!
//! `cargo test --release --test slow -- --ignored --nocapture` runs them.

#[cfg(feature = "f64")]
extern crate rapier3d_fields_f64 as rapier3d_fields;

#[cfg(feature = "f64")]
use rapier3d_fields_lab::double as lab;
#[cfg(feature = "f32")]
use rapier3d_fields_lab::single as lab;

#[path = "../it/support/mod.rs"]
#[allow(dead_code, reason = "shared with the daily tests")]
mod support;

mod drops;
mod fast_spin;
mod liquid;
mod long_runs;
mod nist_lj;
mod soak;
mod stability_map;
