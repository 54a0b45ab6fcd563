//! What most programs need: `use rapier3d_fields::prelude::*;` brings Rapier's own prelude along.

pub use crate::field::{
    Anchor, Axis, ContactLaw, Coupling, Field, Operator, Reading, Region, Sample, Tree, TreeError,
};
pub use crate::rapier::prelude::*;
