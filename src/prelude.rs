//! What most programs need: `use rapier3d_fields::prelude::*;` brings Rapier's own prelude along.

pub use crate::rapier::prelude::*;
pub use crate::{
    Anchor, Axis, ContactLaw, Coupling, Detection, Field, Fields, Operator, ProbeProperties,
    Reading, Region, Responder, Sample, Scheme, StepError, Tree, TreeError, WakePolicy,
};
