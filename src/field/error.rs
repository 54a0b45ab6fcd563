//! What can be wrong with a tree.

/// Why a tree was refused. Fields are named by their own name, or by their place in the tree.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TreeError {
    /// The tree is defined nowhere: it holds no field.
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
    /// A parameter of a field is out of its range.
    #[error("{field}: {quantity} must be {requirement}, but is {value}")]
    Parameter {
        /// The field.
        field: String,
        /// The parameter.
        quantity: &'static str,
        /// Its range.
        requirement: &'static str,
        /// The value found.
        value: f64,
    },
    /// A region or formula names an axis nobody declared.
    #[error("{field}: there is no axis `{axis}`; declared are: {declared}")]
    UnknownAxis {
        /// The field.
        field: String,
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
    /// A detection field stands where its vector would be changed, which says nothing about
    /// contacts.
    #[error("{field}: a detection field cannot be an operand of {operator}")]
    DetectionOperand {
        /// The field.
        field: String,
        /// The operator.
        operator: &'static str,
    },
    /// A detection field has nothing to touch with: it needs a collider, or a region in space.
    #[error("{field}: a detection field must be anchored to a collider")]
    DetectionAnchor {
        /// The field.
        field: String,
    },
}
