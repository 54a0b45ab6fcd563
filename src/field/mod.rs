//! Fields as data: regions, formulas and operators, and the trees and sets they form.

mod anchor;
mod any_shape;
mod axis;
mod border;
pub mod boundary;
mod closed_mesh;
mod closure;
mod constructors;
mod contact;
mod error;
mod expression_error;
mod formula;
mod ground;
mod handle;
mod layer;
mod leaf;
mod lifetime;
mod likeness;
mod linearised;
mod modifier;
mod nodes;
mod operator;
mod over_axes;
mod presets;
mod priority;
mod properties;
mod query;
mod region;
mod registry;
mod sampled;
mod sampling;
#[cfg(feature = "serde-serialize")]
mod saved;
mod scalar;
mod set;
mod sets;
mod solid;
mod solid_shape;
mod stack;
mod subtree;
mod sum;
mod surface;
mod tree;
mod validity;
pub mod visit;

pub use anchor::{Anchor, Frame, Frames};
pub use axis::Axis;
pub use closed_mesh::MeshFault;
pub use closure::Closure;
pub use contact::ContactLaw;
pub use error::{BuildError, FieldRef};
pub use expression_error::{ExpressionError, ExpressionErrorKind};
#[cfg(feature = "expression")]
pub use formula::Expression;
pub use formula::{
    Buoyancy, Coordinates, Drag, Formula, Grid, LinearKernel, Magnetic, Nearest, Path, Profile,
    Radial, Spring, Swirl, Turbulence, Uniform, Wind,
};
pub use handle::{FieldHandle, TreeHandle};
pub use layer::Layer;
pub use leaf::{Coupling, Field, ForceMode};
pub use lifetime::Lifetime;
pub(crate) use lifetime::Span;
pub use linearised::Linearised;
pub use operator::Operator;
pub use properties::{ColliderProperties, PropertyError};
pub use query::{Query, Sample, Touch};
pub use region::{Placement, Region};
pub use registry::Registry;
pub use sampling::Sampling;
pub use scalar::Scalar;
pub use set::{FieldKey, FieldSet};
pub use tree::Tree;

pub(crate) use border::Border;
pub(crate) use boundary::{Neighbourhood, Normal, Pieces};
pub(crate) use likeness::Fingerprint;
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
