//! Force fields for the [Rapier](rapier) physics engine: write vector fields and compose them in one tree. In every
//! step, each awake dynamic body gets the force and torque that the tree adds up to at the body's sample points.
//!
//! # Terms
//!
//! - A **field** is a formula for a vector at a point, on a **region** of space, anchored to the world,
//!   a body or a collider. Outside its region a field is *not defined*, which is not the same as zero.
//! - A **tree** composes fields by [operators](Operator), of which seven are from the paper cited below; it is one
//!   composite field.
//! - A **sample** is a point of a body at which the tree is evaluated: the centre of mass for uniform
//!   fields, the centre of each collider, points of its volume or surface, or the centres of the
//!   pieces into which a border cuts it; see [`Sampling`].
//! - The **wrench** is the force on a body and the torque about its centre of mass, summed over its
//!   samples. A **[scheme](Scheme)** turns it into motion.
//! - A **detection field** finds the colliders that touch the one it is anchored to, and may *answer*
//!   these contacts, by impulses or spring forces.
//!
//! Units are yours, as in Rapier: the crate assumes none. Vectors are in world axes
//! unless a name says `local`. Angles are in radians.
//!
//! # A first program
//!
//! ```
//! use rapier3d_fields::prelude::*;
//!
//! let mut world = PhysicsWorld::new();
//! world.gravity = Vector::ZERO;
//! let ball = RigidBodyBuilder::dynamic().translation(Vector::new(8.0, 0.0, 0.0));
//! let (ball, _) = world.insert(ball, ColliderBuilder::ball(0.5));
//!
//! let planet = Field::point_gravity(50.0).within(Region::ball(20.0));
//! let wind = Field::uniform(Vector::Z * 2.0).within(Region::cuboid(Vector::splat(5.0)));
//! let mut fields = Fields::new(planet.sum_union(wind))?;
//! for _ in 0..60 {
//!     fields.step(&mut world)?; // in place of world.step()
//! }
//! assert!(world.bodies[ball].translation().x < 8.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Composing
//!
//! Figure 4 of the paper from which the algebra comes, *A Unified Framework for Collision Detection,
//! Avoidance, and Response*: three balls, each with a large attraction, which a collision field replaces where they
//! touch. They attract one another until they collide, and bounce.
//!
//! ```
//! use rapier3d_fields::prelude::*;
//! # let mut world = PhysicsWorld::new();
//! # let handles = [0.0, 1.0, 2.0].map(|x| {
//! #     let body = RigidBodyBuilder::dynamic().translation(Vector::X * (5.0 * x));
//! #     world.insert(body, ColliderBuilder::ball(0.5))
//! # });
//! let pull = Field::radial(-1.0, 0.0).within(Region::ball(8.0));
//! let bounce = Field::contact(ContactLaw::elastic()).within(Region::ball(1.0));
//! let three = Tree::instances(pull.replace_union(bounce), handles.map(|(_, ball)| ball));
//! let mut fields = Fields::new(three)?;
//! println!("{}", fields.plan());
//! let wrench = fields.sample(handles[0].0, &world)?;
//! assert_eq!(wrench.unwrap().force.x, 1.0, "pulled by its neighbour, out of reach of the other");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Around a pipeline of your own
//!
//! [`Fields::begin`] and [`Fields::finish`] borrow the sets they need, before and after your own call
//! of `PhysicsPipeline::step`. The [`recipes`] have a whole program.
//!
//! # Formulas
//!
#![doc = include_str!("../docs/formulas.md")]
//!
//! # Detecting collisions
//!
//! A [contact](Field::contact) field on a collider finds the colliders that touch it, and answers by a
//! [law](ContactLaw). [`FieldsBuilder::cross_check`] compares its contacts with Rapier's own.
//!
//! ```
//! use rapier3d_fields::prelude::*;
//! # let mut world = PhysicsWorld::new();
//! # world.gravity = Vector::ZERO;
//! # let mut ball = |x: Real, v: Real| {
//! #     let body = RigidBodyBuilder::dynamic().translation(Vector::X * x).linvel(Vector::X * v);
//! #     world.insert(body, ColliderBuilder::ball(0.5))
//! # };
//! # let (left, right) = (ball(-1.0, 1.0), ball(1.0, 0.0));
//! let elastic = ContactLaw::elastic();
//! let around = |collider: ColliderHandle| Field::contact(elastic).at(collider);
//! let mut fields = Fields::new(around(left.1).sum_union(around(right.1)))?;
//! for _ in 0..90 {
//!     fields.step(&mut world)?;
//! }
//! assert_eq!(world.bodies[left.0].linvel().x, 0.0, "equal masses exchange their velocities");
//! assert_eq!(world.bodies[right.0].linvel().x, 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Detection at the end of a step misses bodies that pass through a collider within the step.
//! [`Detection::Swept`] finds the time and place of the first touch of each pair, and answers it there:
//!
//! ```
//! use rapier3d_fields::prelude::*;
//! # let mut world = PhysicsWorld::new();
//! # world.gravity = Vector::ZERO;
//! # world.integration_parameters.dt = 0.1;
//! # let mut ball = |x: Real, v: Real| {
//! #     let body = RigidBodyBuilder::dynamic().translation(Vector::X * x).linvel(Vector::X * v);
//! #     world.insert(body, ColliderBuilder::ball(0.5))
//! # };
//! # let (bullet, target) = (ball(-5.0, 100.0), ball(0.0, 0.0));
//! let around = |collider: ColliderHandle| Field::contact(ContactLaw::elastic()).at(collider);
//! let tree = around(bullet.1).sum_union(around(target.1));
//! let mut fields = Fields::builder(tree).detection(Detection::Swept).build()?;
//! fields.step(&mut world)?; // of 0.1, in which the bullet flies 10
//! let touched = fields.contacts()[0].time_of_impact.unwrap();
//! assert!((touched - 0.04).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The [`recipes`] answer "how do I …": zones, wind, water, moving fields, sleeping bodies, rollback.
//!
//! # Precision
//!
//! `rapier3d-fields` computes in `f32` on top of `rapier3d`. Its twin `rapier3d-fields-f64` is the
//! same source on top of `rapier3d-f64`. In both, the [reference](reference::Reference) evaluates the tree
//! node by node in `f64`; every faster evaluator is tested against it.
//!
//! # Features
//!
//! - `expression`: formulas given as text: `field::Expression`.
//! - `serde-serialize`: trees, settings and state are plain data for any of serde's formats. Scene
//!   files are in a crate of their own, `rapier3d-fields-scene`.
//! - `parallel`: fields are evaluated on the threads of Rapier's pool, with the same bits on any number of threads.
//! - `debug-render`: `FieldDebugRenderPipeline` draws fields through the backends of Rapier's debug-renderer.
//! - `tracing`: the stages of a step are spans of the crate `tracing`, with target `rapier3d_fields` and level TRACE.
//! - `simd8` (in `f32`), `enhanced-determinism`: Rapier's own.

#![forbid(unsafe_code)]
#![deny(rustdoc::broken_intra_doc_links)]

#[cfg(not(any(feature = "f32", feature = "f64")))]
compile_error!(
    "the precision is missing: with `default-features = false`, turn on the feature `f32` of \
     `rapier3d-fields`, or `f64` of `rapier3d-fields-f64`"
);
#[cfg(all(feature = "f32", feature = "f64"))]
compile_error!("a package has one precision: turn on `f32` or `f64`, not both");

#[cfg(feature = "f32")]
pub extern crate rapier3d as rapier;
#[cfg(feature = "f64")]
pub extern crate rapier3d_f64 as rapier;

// For the derives, as in Rapier's own crates.
#[cfg(feature = "serde-serialize")]
#[macro_use]
extern crate serde;

// In the order in which data flows. ARCHITECTURE.md says which module may use which.
pub mod math;

mod threads;

mod number;

mod neighbors;

mod rigid;

pub mod field;

pub mod reference;

mod compile;

mod sample;

mod eval;

mod integrate;

mod bridge;

pub mod contact;

pub mod cross_check;

pub mod diagnose;

pub mod pipeline;

mod fields;

#[cfg(feature = "debug-render")]
pub mod debug_render;

pub mod prelude;

#[doc = include_str!("../docs/recipes.md")]
pub mod recipes {}

pub use bridge::{StepError, WakePolicy, WorldMut, WorldRef};
pub use compile::plan;
pub use contact::modes::{Detection, Responder};
pub use field::anchor::Anchor;
pub use field::axis::Axis;
pub use field::contact::ContactLaw;
pub use field::error::BuildError;
pub use field::handle::{FieldHandle, TreeHandle};
pub use field::layer::Layer;
pub use field::leaf::{Coupling, Field, ForceMode};
pub use field::lifetime::Lifetime;
pub use field::operator::Operator;
pub use field::properties::{ColliderProperties, PropertyError};
pub use field::query::Sample;
pub use field::region::Region;
pub use field::sampling::Sampling;
pub use field::scalar::Scalar;
pub use field::set::FieldSet;
pub use field::tree::Tree;
pub use fields::{ErrorEstimate, Fields, FieldsBuilder, Prediction};
pub use integrate::{FaultPolicy, Scheme, StepWarning, Stiffness, Substeps};
pub use rigid::Wrench;

/// The programs of the README and the guide run as tests.
#[cfg(all(doctest, feature = "f32"))]
#[doc = include_str!("../README.md")]
#[doc = include_str!("../docs/guide.md")]
struct Pages;
