//! The names that most programs need, with those of Rapier's own prelude: `use rapier3d_fields::prelude::*;`.

pub use crate::field::Turbulence;
pub use crate::pipeline::{FieldPipeline, FieldSettings, FieldState, OpenStep};
pub use crate::rapier::prelude::*;
pub use crate::{
    Anchor, Axis, BuildError, ColliderProperties, ContactLaw, Coupling, Detection, FaultPolicy,
    Field, FieldHandle, FieldSet, Fields, ForceMode, Layer, Lifetime, Operator, PropertyError,
    Region, Responder, Sample, Sampling, Scalar, Scheme, StepError, StepWarning, Stiffness,
    Substeps, Tree, TreeHandle, WakePolicy, WorldMut, WorldRef,
};
