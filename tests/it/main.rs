//! The tests that run every day, as modules of one program: it links once, in each precision.
//!
//! `cargo test --test it laws::` runs one module. The package in `tests/f64/` builds them, too.

#[cfg(feature = "f64")]
extern crate rapier3d_fields_f64 as rapier3d_fields;

#[cfg(feature = "f64")]
use rapier3d_fields_lab::double as lab;
#[cfg(feature = "f32")]
use rapier3d_fields_lab::single as lab;

mod support;

mod abrupt;
mod adversarial;
mod adversarial_steps;
mod alarms;
mod algebra_laws;
mod any_bodies;
mod approach;
mod auto;
mod balances;
mod billiards;
mod bodies;
mod borders;
mod bounces;
mod changed_bodies;
mod close_passes;
mod closed_form;
mod contact_borders;
mod contact_fields;
mod contained;
mod controllers;
#[cfg(feature = "f64")]
mod convergence;
mod cross_check;
mod cut_samples;
mod damped;
mod debug_render;
mod derivatives;
mod detection;
mod displaced;
mod each_collider;
mod estimates;
mod evaluators_agree;
mod every_axis;
mod explain;
mod expressions;
mod far_away;
mod far_fields;
mod fast_turns;
mod faults;
mod figure_4;
mod force_lifetime;
mod formula_values;
mod ground;
mod halves;
mod handed_over;
mod impacts_under_force;
mod implosion;
mod inside_steps;
mod integrator_maps;
mod lasting;
mod laws;
#[cfg(feature = "f32")]
mod layering;
mod led_carriers;
mod live_edits;
mod loads;
mod mesh_regions;
mod met_within;
mod modes_of_others;
mod modifier_laws;
mod moving_frames;
#[cfg(feature = "f64")]
mod orders;
mod outcomes;
mod own_sampling;
#[cfg(feature = "f32")]
mod pages;
mod plans;
#[cfg(feature = "f64")]
mod potentials;
#[cfg(feature = "f32")]
mod public_face;
mod random_motions;
#[cfg(feature = "f32")]
mod readme;
mod reference_dimers;
mod regions_vs_parry;
mod riding;
mod rollback;
mod routes;
mod sampling;
mod saved_trees;
mod scalar_values;
mod scaled_bodies;
mod slanted_surfaces;
mod sleep;
mod snapshots;
mod soft_bodies;
mod spans;
mod stiff;
mod stiff_closed_forms;
mod study;
mod swept;
mod terminal_velocities;
#[cfg(feature = "parallel")]
mod threads;
mod timed;
mod traces;
mod uneven_ground;
mod waking;
mod warned;
mod watched;
mod weak;
mod whole_flights;
mod zones;
