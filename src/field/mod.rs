//! Define: regions, formulas, fields, operators, and the tree they make.

mod anchor;
mod axis;
pub mod boundary;
mod closure;
mod constructors;
mod contact;
mod error;
mod formula;
mod layer;
mod leaf;
mod linearised;
mod modifier;
mod number;
mod operator;
mod over_axes;
mod query;
mod region;
mod registry;
mod sampling;
#[cfg(feature = "serde-serialize")]
mod saved;
mod scalar;
mod solid;
mod tree;
mod validity;
pub mod visit;

pub use anchor::{Anchor, Frame, Frames};
pub use axis::Axis;
pub use closure::Closure;
pub use contact::ContactLaw;
pub use error::TreeError;
#[cfg(feature = "expression")]
pub use formula::Expression;
pub use formula::{
    Buoyancy, Coordinates, Drag, Formula, Grid, LinearKernel, Magnetic, Nearest, Path, Profile,
    Radial, Spring, Swirl, Turbulence, Uniform, Wind,
};
pub use layer::Layer;
pub use leaf::{Coupling, Field, ForceMode};
pub use linearised::Linearised;
pub use operator::Operator;
pub use query::{Query, Sample};
pub use region::{Placement, Region};
pub use registry::Registry;
pub use sampling::Sampling;
pub use scalar::Scalar;
pub use tree::Tree;

pub(crate) use boundary::{Neighbourhood, Normal, Pieces};
pub(crate) use layer::Override;
pub(crate) use modifier::Modifier;
pub(crate) use number::{Dual, Number, Vec3, constant, real};
pub(crate) use query::{LocalQuery, Motion};
pub(crate) use sampling::SamplingRule;
pub(crate) use tree::Node;
