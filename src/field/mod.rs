//! Define: regions, formulas, fields, operators, and the tree they make.

mod anchor;
mod axis;
pub mod boundary;
mod contact;
mod error;
mod formula;
mod leaf;
mod operator;
mod query;
mod region;
mod solid;
mod tree;

pub use anchor::{Anchor, Frame, Frames};
pub use axis::Axis;
pub use contact::ContactLaw;
pub use error::TreeError;
pub use formula::{Closure, Formula, Profile, Radial};
pub use leaf::{Coupling, Field, Reading};
pub use operator::Operator;
pub use query::{Query, Sample};
pub use region::{Placement, Region};
pub use tree::Tree;

pub(crate) use boundary::{Neighbourhood, Normal, Pieces};
pub(crate) use query::LocalQuery;
pub(crate) use tree::Node;
