//! The errors of fields and trees that are not valid.

use std::fmt;

use super::closed_mesh::MeshFault;
use super::expression_error::ExpressionError;
use super::handle::FieldHandle;
use crate::math::{Pose, Real, Vector, to_f64};

/// The field that an error, a warning or an answer is about. It is displayed as its label, and equal to a text that is
/// the same as its label.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct FieldRef {
    /// Its handle, if it is in a [`FieldSet`](crate::FieldSet). An operation of a tree has none.
    pub handle: Option<FieldHandle>,
    /// Its own name, or its place and formula.
    pub label: Box<str>,
}

impl From<&str> for FieldRef {
    fn from(label: &str) -> Self {
        FieldRef {
            handle: None,
            label: label.into(),
        }
    }
}

impl From<String> for FieldRef {
    fn from(label: String) -> Self {
        FieldRef::from(label.as_str())
    }
}

impl PartialEq<&str> for FieldRef {
    fn eq(&self, label: &&str) -> bool {
        *self.label == **label
    }
}

impl fmt::Display for FieldRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.label)
    }
}

/// The reason why fields were refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// A closure was read by its name, and its function was not looked up.
    #[error(
        "{field}: the {kind} `{closure}` is a closure that was read by name: give its function in a \
         `Registry` to `Tree::resolve`"
    )]
    Unresolved {
        /// The field.
        field: FieldRef,
        /// The kind of closure: a formula, a scalar or a predicate.
        kind: &'static str,
        /// Its name.
        closure: String,
    },
    /// A closure was read by a name that is not in the registry.
    #[error("{field}: the registry has no {kind} of the name `{closure}`")]
    UnknownClosure {
        /// The field.
        field: FieldRef,
        /// The kind of closure: a formula, a scalar or a predicate.
        kind: &'static str,
        /// Its name.
        closure: String,
    },
    /// The tree is defined nowhere: it has no field.
    #[error("the tree is empty: it needs at least one field")]
    Empty,
    /// Operators are nested too deeply. Chains of one associative operator count as one level.
    #[error("the tree is {depth} levels deep; at most {limit} are supported")]
    TooDeep {
        /// Levels of operators above the deepest field.
        depth: usize,
        /// The limit.
        limit: usize,
    },
    /// Instances within instances make more fields than can be evaluated.
    #[error("the tree makes {fields} fields; at most {limit} are supported")]
    TooLarge {
        /// Fields, those of each instance counted.
        fields: usize,
        /// The limit.
        limit: usize,
    },
    /// A setter was used on a field whose formula has no such setting.
    #[error("{field}: `{setter}` does not apply to a {formula} formula")]
    Misfit {
        /// The field.
        field: FieldRef,
        /// The setter.
        setter: &'static str,
        /// The formula.
        formula: &'static str,
    },
    /// An expression cannot be read.
    #[error("{field}: {error}")]
    Expression {
        /// The field.
        field: FieldRef,
        /// The fault in the text, and its place.
        error: Box<ExpressionError>,
    },
    /// A parameter of a field is out of its range.
    #[error("{field}: {quantity} must be {requirement}, but is {value}")]
    Parameter {
        /// The field.
        field: FieldRef,
        /// The parameter.
        quantity: &'static str,
        /// Its range.
        requirement: &'static str,
        /// The value found.
        value: f64,
    },
    /// A region is the inside of a mesh that is not the surface of a solid.
    #[error("{field}: the mesh of the region is not the surface of a solid: {fault}")]
    MeshRegion {
        /// The field.
        field: FieldRef,
        /// The fault of the mesh.
        fault: MeshFault,
    },
    /// A region is a surface or a line, or has one among its parts: it has no points inside.
    #[error("{field}: the region is a {shape}, which has no volume, so nothing is inside it")]
    FlatRegion {
        /// The field.
        field: FieldRef,
        /// The kind of shape.
        shape: &'static str,
    },
    /// A region or formula names an axis that is not declared.
    #[error("{field}: there is no axis `{axis}`; declared are: {declared}")]
    UnknownAxis {
        /// The field.
        field: FieldRef,
        /// The axis it names.
        axis: String,
        /// The axes that exist.
        declared: String,
    },
    /// An axis is declared twice, or under the name of a built-in one.
    #[error("the axis `{axis}` exists already")]
    DuplicateAxis {
        /// The axis.
        axis: String,
    },
    /// A field is to react on the body that carries it, but its term of the tree is carried by no body or by
    /// several, or has fields that do not react.
    #[error(
        "{field}: to react, all fields of its term must react and be anchored to the same body or \
         collider"
    )]
    Reaction {
        /// The field.
        field: FieldRef,
    },
    /// A detection field is an operand where its vector would be changed, but its law has no vector, as it acts on both
    /// parts at once. The paper's laws have vectors.
    #[error(
        "{field}: a detection field cannot be an operand of {operator}, unless its law is the paper's"
    )]
    DetectionOperand {
        /// The field.
        field: FieldRef,
        /// The operator.
        operator: &'static str,
    },
    /// A detection field has no collider: it is neither anchored to one, nor in the prototype of
    /// [instances](crate::Tree::instances) that are all anchored to one.
    #[error("{field}: a detection field must be anchored to a collider, or be an instance at one")]
    DetectionAnchor {
        /// The field.
        field: FieldRef,
    },
}

impl BuildError {
    /// The same error, about a field of a set.
    pub(super) fn of(mut self, field: Option<FieldHandle>) -> Self {
        match &mut self {
            BuildError::Unresolved { field: culprit, .. }
            | BuildError::UnknownClosure { field: culprit, .. }
            | BuildError::Misfit { field: culprit, .. }
            | BuildError::Expression { field: culprit, .. }
            | BuildError::Parameter { field: culprit, .. }
            | BuildError::MeshRegion { field: culprit, .. }
            | BuildError::FlatRegion { field: culprit, .. }
            | BuildError::UnknownAxis { field: culprit, .. }
            | BuildError::Reaction { field: culprit }
            | BuildError::DetectionOperand { field: culprit, .. }
            | BuildError::DetectionAnchor { field: culprit } => culprit.handle = field,
            _ => {}
        }
        self
    }
}

pub(super) const POSITIVE: &str = "positive and finite";
pub(super) const FINITE: &str = "finite";

/// The error for a parameter out of range, unless it `fits`.
pub(crate) fn require(
    fits: bool,
    field: &str,
    quantity: &'static str,
    requirement: &'static str,
    value: f64,
) -> Result<(), BuildError> {
    if fits {
        return Ok(());
    }
    Err(BuildError::Parameter {
        field: field.into(),
        quantity,
        requirement,
        value,
    })
}

/// Checks that a parameter is positive and finite.
pub(crate) fn positive(field: &str, quantity: &'static str, value: Real) -> Result<(), BuildError> {
    let fits = value > 0.0 && value.is_finite();
    require(fits, field, quantity, POSITIVE, to_f64(value))
}

/// Checks that a parameter is finite.
pub(crate) fn finite(field: &str, quantity: &'static str, value: Real) -> Result<(), BuildError> {
    require(value.is_finite(), field, quantity, FINITE, to_f64(value))
}

/// Checks that a pose is finite and its rotation of length one.
pub(crate) fn rigid(field: &str, quantity: &'static str, pose: &Pose) -> Result<(), BuildError> {
    require(pose.is_finite(), field, quantity, FINITE, f64::NAN)?;
    let length = pose.rotation.length();
    let fits = (length - 1.0).abs() <= 1e-3;
    let unit = "a rigid motion, its rotation of length one";
    require(fits, field, quantity, unit, to_f64(length))
}

pub(crate) fn validate_interval(field: &str, min: Real, max: Real) -> Result<(), BuildError> {
    let (quantity, below) = ("the lower end of an interval", "less than its upper end");
    require(min < max, field, quantity, below, to_f64(min))
}

/// Checks that parameters are finite.
pub(crate) fn all_finite(field: &str, values: &[(&'static str, Real)]) -> Result<(), BuildError> {
    let mut values = values.iter();
    values.try_for_each(|(quantity, value)| finite(field, quantity, *value))
}

/// Checks that a vector is finite.
pub(crate) fn finite_vector(
    field: &str,
    quantity: &'static str,
    vector: Vector,
) -> Result<(), BuildError> {
    let mut components = vector.to_array().into_iter();
    components.try_for_each(|x| finite(field, quantity, x))
}

/// Checks that a parameter is zero or more, and finite.
pub(crate) fn not_negative(
    field: &str,
    quantity: &'static str,
    value: Real,
) -> Result<(), BuildError> {
    let fits = value >= 0.0 && value.is_finite();
    let zero_or_more = "zero or more, and finite";
    require(fits, field, quantity, zero_or_more, to_f64(value))
}
