//! What most programs need: `use rapier3d_fields::prelude::*;` brings Rapier's own prelude along.

pub use crate::rapier::prelude::*;
pub use crate::{
    Anchor, Axis, ContactLaw, Coupling, Detection, Field, Fields, Layer, Operator, ProbeProperties,
    Reading, Region, Responder, Sample, Sampling, Scalar, Scheme, StepError, StepWarning,
    Stiffness, Substeps, Tree, TreeError, WakePolicy,
};
