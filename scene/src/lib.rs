//! Scenes of rigid bodies in composed force fields as JSON files, for [`rapier3d_fields`], and the
//! program `simulate` that runs them.
//!
//! Everything exists in two precisions: [`single`] (`f32`) on top of [`rapier3d_fields`], and [`double`] (`f64`) on top
//! of [`rapier3d_fields_f64`].
//!
//! - [`SceneFile`](single::SceneFile): a world with its fields. `examples/simulate.rs` runs one; the scenes of this
//!   project are in `examples/scenes/`.
//! - `simulate scene.json --html page.html` writes a page that replays the run in a browser. Other programs make such
//!   pages with a [`Recorder`](single::Recorder) and a [`Page`](page::Page), with the feature `replay`.
//! - [`Document`](single::Document): a [`Tree`](rapier3d_fields::Tree), [`Field`](rapier3d_fields::Field), [`Region`](rapier3d_fields::Region),
//!   [`Scalar`](rapier3d_fields::Scalar) or [`ColliderProperties`](rapier3d_fields::ColliderProperties) by itself. These
//!   types also implement serde's traits.
//!
//! # The schema, version 1
//!
//! ```
//! use rapier3d_fields_scene::single::{Document, SceneFile};
//! let text = r#"{
//!   "version": 1,
//!   "about": "A ball between a spring and a gust, above a floor.",
//!   "gravity": [0, -9.81, 0],
//!   "parameters": { "dt": 0.01, "num-solver-iterations": 6 },
//!   "bodies": [
//!     { "name": "floor", "type": "fixed", "colliders": [
//!       { "shape": { "cuboid": { "half-extents": [9, 0.5, 9] } }, "friction": 0.8 }
//!     ] },
//!     { "name": "ball", "at": [0, 3, 0], "rotation": [1, 0, 0, 0], "velocity": [1, 0, 0],
//!       "colliders": [
//!         { "shape": { "ball": { "radius": 0.5 } }, "mass": 2, "restitution": 0.5,
//!           "probe": { "charge": -1, "axes": { "heat": 20 } } }
//!       ] }
//!   ],
//!   "fields": {
//!     "axes": { "heat": 15 },
//!     "scheme": { "auto": { "tolerance": 0.001 } },
//!     "cross-check": true,
//!     "tree": { "sum-union": [
//!       { "field": { "name": "spring", "formula": { "spring": { "stiffness": 40, "damping": 1 } },
//!                    "at": { "at": [0, 4, 0] }, "limited-to": 100 } },
//!       { "replace-union": [
//!         { "field": { "name": "lift", "formula": { "uniform": { "vector": [0, 1, 0] } },
//!                      "coupled-to": { "axis": "heat" } } },
//!         { "field": { "name": "gust", "formula": { "uniform": { "vector": [3, 0, 0] } },
//!                      "within": { "intersection": [
//!                        { "cuboid": { "half-extents": [2, 5, 2] } },
//!                        { "interval": { "axis": "time", "min": 1, "max": 2 } } ] },
//!                      "scaled-by": [{ "axis": "time" }, { "smooth": [1, 2] }] } }
//!       ] },
//!       { "field": { "formula": { "contact": { "law": "observe" } }, "at": { "body": 1, "part": 0 } } }
//!     ] }
//!   }
//! }"#;
//! let mut scene = SceneFile::from_json(text)?.build()?;
//! for _ in 0..200 {
//!     scene.fields.step(&mut scene.world)?;
//! }
//! assert_eq!(scene.fields.cross_check().unwrap().steps, 200);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Comments (`// …` and `/* … */`) are allowed wherever white space is. `schema.json` in this crate's
//! folder is the JSON Schema, for editors.
//!
//! Names are those of the constructors and setters of [`rapier3d_fields`] and of Rapier, with hyphens. A key
//! that is left out has the default there; unknown names are errors. A choice is an
//! object with one key, `{ "ball": { "radius": 2 } }`, or just its name where it has no settings,
//! `"everywhere"`. Numbers are finite, vectors `[x, y, z]`, rotations quaternions `[w, x, y, z]` of
//! length one. Brackets are nested at most 127 deep; a chain of one operator is one list.
//!
//! | object | its keys |
//! |---|---|
//! | scene | `version` (1), `about`, `gravity`, `parameters`, `bodies`, `fields` |
//! | parameters | those of Rapier's `IntegrationParameters`: `dt`, `num-solver-iterations`, `length-unit`, `max-ccd-substeps`, `contact-recycling`, `normalized-max-linear-velocity`, … |
//! | body | `name`, `type` (`dynamic`, `fixed`, `kinematic-velocity-based`, `kinematic-position-based`), `at`, `rotation`, `velocity`, `angular-velocity`, `force`, `torque`, `gravity-scale`, `linear-damping`, `angular-damping`, `added-mass` (`{"mass": m}` or `{"properties": …}`), `locked` (of `x`, `y`, `z`, `rotation-x`, `rotation-y`, `rotation-z`), `dominance`, `enabled`, `can-sleep`, `sleeping`, `ccd`, `soft-ccd-prediction`, `allow-fast-rotation`, `gyroscopic-forces`, `additional-solver-iterations`, `sampling`, `colliders` |
//! | collider | `shape`, `at`, `rotation`, one of `density`, `mass` and `mass-properties`, `friction`, `friction-rule`, `restitution`, `restitution-rule` (`average`, `min`, `multiply`, `max`, `clamped-sum`, `geometric-mean`), `sensor`, `enabled`, `collision-groups`, `solver-groups`, `contact-skin`, `probe` |
//! | mass properties | `mass`, `centre`, `inertia` (three principal moments), `axes` (their rotation) |
//! | groups | `memberships`, `filter`: 32 bits each; `either`: it is enough that the filter of one side accepts the other |
//! | probe | `charge`, `mass`, `axes` (values on the user's axes) |
//! | fields | `axes` (declared, with the world's values), `scheme`, `wake`, `on-fault`, `responder` (`rapier`, `fields`, `both`), `responder-among` (a list of `parts` and `responder`), `detection` (`discrete`, `swept`), `cross-check`, `audit`, `time`, `definitions` (trees by name), `tree` |
//! | scheme | `kick-drift-kick`, `kick`, `external-force`, `linearly-implicit`, `forward4`, `{"substep": {"fixed": n}}`, `{"substep": {"per-body": {"tolerance": t}}}`, `{"auto": {"tolerance": t}}` |
//! | wake | `never`, `always`, `{"on-change": {"fraction": f}}` |
//! | on-fault | `leave-out`, `quarantine`, `refuse` |
//! | field | `name`, `formula`, `within` (a region), `at` (an anchor), `force-mode` (also `read-as`; `force`, `acceleration`, `velocity-change`), `coupled-to` (`share`, `each`, `{"axis": a}`), `scaled-by` (a scalar), `limited-to`, `groups`, `reacting`, `sampled` |
//! | sampling | `auto`, `centre`, `parts`, `volume`, `surface` |
//! | anchor | `body`: its number from 0, in the order of the file, or its name; `part`: the number of its collider, from 0; without both, the anchor is the world; `at`, `rotation`: the pose in that frame. A tree by itself has `body-handle` and `collider-handle` instead, each `[index, generation]` |
//!
//! | tree | is |
//! |---|---|
//! | `{"field": …}`, `"empty"` | a leaf; a tree without fields |
//! | `{"use": name}` | the tree of that name in `definitions`; a definition cannot use another |
//! | `{"sum-union": [trees]}`, and `sum-intersection`, `cross-union`, `cross-intersection`, `replace-union`, `replace-intersection`, `difference`, `strongest`, `weakest`, `minimum`, `maximum` | the [operator](rapier3d_fields::Operator) applied to all of them, from left to right |
//! | `{"instances": {"prototype": tree, "at": [anchors]}}` | a copy at each anchor |
//! | `{"scaled": {"tree": …, "by": scalar, "at": anchor}}` | the force, times a number that depends on the sample |
//! | `{"limited": {"tree": …, "to": length}}` | the force, shortened to that length where it is longer |
//! | `{"layers": [{"tree": …, "priority": 0, "replacing": false, "stopping": false}]}` | [layers](rapier3d_fields::Tree::layers) |
//!
//! | formula | its settings |
//! |---|---|
//! | `uniform` | `vector` |
//! | `radial` | `strength`, `power`, `softening` |
//! | `point-gravity`, `coulomb` | `mu`; `constant`, `charge`; each with `softening` |
//! | `lennard-jones`, `yukawa`, `morse` | `epsilon`, `sigma`; `strength`, `screening`; `depth`, `stiffness`, `rest-length` |
//! | `gaussian`, `hertz` | `height`, `width`; `stiffness`, `diameter` |
//! | all radial ones above | `shifted-to-zero-at`, `no-nearer-than`, `limited-to` |
//! | `radial`, `point-gravity`, `coulomb` | `opening-angle`, if none of the three settings above is given |
//! | `around` | `shape`, `formula`: a radial one, from the nearest point of the shape |
//! | `spring`, `drag` | `stiffness`, `damping`, `rest-length`; `linear`, `quadratic` |
//! | `wind` | `flow` (a formula), `linear`, `quadratic`, `speed-cap` |
//! | `magnetic`, `buoyancy` | `field`; `density`, `gravity` |
//! | `swirl` | `around`, `inward`, `along`, `power`, `core`: spin, vortex and updraft |
//! | `turbulence` | `seed`, `speed`, `size`, `detail`, `turnover` |
//! | `path` | `points`, `closed`, `speed`, `look-ahead`, `stiffness`, `damping` |
//! | `grid` | `low`, `high`, `counts`, `values` |
//! | `linear-kernel` | the fields of [`LinearKernel`](rapier3d_fields::field::LinearKernel) |
//! | `expression` | a list of three texts; needs the feature `expression` |
//! | `contact` | `law`: `observe`, `paper`, `paper-relative`, `{"penalty": {"stiffness", "damping"}}`, `{"impulse": {"restitution", "friction"}}` |
//!
//! | region | its settings |
//! |---|---|
//! | `"everywhere"`, `ball`, `cuboid` | –; `radius`; `half-extents` |
//! | `cylinder`, `cone`, `capsule` | `half-height`, `radius` |
//! | `half-space` | `outward`, `offset` |
//! | `interval` | `axis`, `min`, `max`; an end that is left out is infinite |
//! | `half-space-over` | `coefficients` (a list of `[axis, number]`), `offset` |
//! | `ball-over` | a list of `axis`, `centre`, `radius` |
//! | `shape` | a shape |
//! | `moved` | `region`, `at`, `rotation` |
//! | `union`, `intersection`, `difference` | a list of regions |
//! | `complement` | a region |
//!
//! | shape | its settings |
//! |---|---|
//! | `ball`, `cuboid`, `cylinder`, `cone` | as the regions |
//! | `capsule`, `segment`, `triangle` | `from`, `to`, `radius`; `from`, `to`; `corners` |
//! | `half-space` | `outward` |
//! | `convex-hull`, `mesh` | `points`; `points`, `triangles` |
//! | `compound` | a list of `shape`, `at`, `rotation` |
//!
//! As a region, a mesh must be closed and wound one way, inwards or outwards; the region is the enclosed volume.
//!
//! A scalar is a list of steps: first a source (`{"constant": c}`, `{"axis": a}`, `"distance"`,
//! `{"depth": region}`), then operations on its value, in order: `ramp` and `smooth`
//! (`[from, to]`), `power`, `exponential`, `gaussian` (a number), `table` (a list of `[x, y]`), and
//! `plus`, `times`, `min`, `max` (another scalar).
//!
//! An axis is `x`, `y`, `z`, `time`, `speed`, `radius`, `mass`, `charge`, or one that was declared.
//!
//! # Content that a file cannot hold
//!
//! Closures and predicates are code: writing them is a [`FileError::Code`](single::FileError::Code) that names the field.
//! An expression can often take their place. Joints, soft bodies, colliders without a body, height
//! fields, voxels and rounded shapes, sleeping thresholds, cross-checks of some pairs only, and
//! numbers that are not finite are refused as well. Coordinates of positions and velocities are at most 10¹⁵, sizes
//! of shapes from 10⁻⁶ to 10⁶.

#![forbid(unsafe_code)]
#![deny(rustdoc::broken_intra_doc_links)]

mod choice;
pub mod double;
#[cfg(feature = "replay")]
pub mod page;
#[cfg(feature = "simulate")]
pub mod program;
pub mod single;
mod text;
