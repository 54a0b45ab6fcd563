//! Fields as data: regions, formulas and operators, and the trees and sets they form.

pub(crate) mod anchor;
mod any_shape;
pub(crate) mod axis;
mod border;
pub mod boundary;
mod closed_mesh;
mod closure;
mod constructors;
pub(crate) mod contact;
mod dedup_key;
pub(crate) mod error;
mod expression_error;
mod formula;
mod ground;
pub(crate) mod handle;
pub(crate) mod layer;
pub(crate) mod leaf;
pub(crate) mod lifetime;
mod linearised;
mod modifier;
mod nodes;
pub(crate) mod operator;
mod over_axes;
mod presets;
mod priority;
pub(crate) mod properties;
pub(crate) mod query;
pub(crate) mod region;
mod registry;
mod sampled;
pub(crate) mod sampling;
#[cfg(feature = "serde-serialize")]
mod saved;
pub(crate) mod scalar;
pub(crate) mod set;
mod sets;
mod solid;
mod solid_shape;
mod stack;
mod subtree;
mod sum;
mod surface;
pub(crate) mod tree;
mod validity;
pub mod visit;

pub use anchor::{Frame, Frames};
pub use closed_mesh::MeshFault;
pub use closure::Closure;
pub use error::FieldRef;
pub use expression_error::{ExpressionError, ExpressionErrorKind};
#[cfg(feature = "expression")]
pub use formula::Expression;
pub use formula::{
    Buoyancy, Coordinates, Drag, Formula, Grid, LinearKernel, Magnetic, Nearest, Path, Profile,
    Radial, Spring, Swirl, Turbulence, Uniform, Wind,
};
pub use linearised::Linearised;
pub use query::{Query, Touch};
pub use region::Placement;
pub use registry::Registry;
pub use set::FieldKey;

// Those that users find at the root of the crate.
pub(crate) use anchor::Anchor;
pub(crate) use axis::Axis;
pub(crate) use contact::ContactLaw;
pub(crate) use error::BuildError;
pub(crate) use handle::FieldHandle;
pub(crate) use leaf::{Coupling, Field, ForceMode};
pub(crate) use lifetime::{Lifetime, Span};
pub(crate) use operator::Operator;
pub(crate) use properties::{ColliderProperties, PropertyError};
pub(crate) use sampling::Sampling;
pub(crate) use set::FieldSet;
pub(crate) use tree::Tree;

pub(crate) use border::Border;
pub(crate) use boundary::{Neighbourhood, Normal, Pieces};
pub(crate) use dedup_key::Fingerprint;
pub(crate) use modifier::Modifier;
pub(crate) use nodes::{Node, Nodes};
pub(crate) use priority::Override;
pub(crate) use query::{
    LocalQuery, Motion, Numbers, POINT, Queries, QueryNumber, QueryProperties, Single,
};
pub(crate) use sampling::{Cuts, Points, SamplingRule};
pub(crate) use set::{Change, Term};
pub(crate) use sets::{Open, Sets};
pub(crate) use stack::Stack;
pub(crate) use surface::Face;
