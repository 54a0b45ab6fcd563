//! What `simulate` prints of the cross-check.

#[allow(unused_imports, reason = "one example uses it")]
pub use rapier3d_fields_lab::single::watch::print_cross_check;
