//! The errors of a study.

/// The reason why a study is impossible. A step that fails is no such error: its run has
/// [diverged](super::Run::diverged).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A case cannot be moved by that method.
    #[error("case `{case}` cannot be moved by {method}")]
    Method {
        /// The case.
        case: String,
        /// Name of the method.
        method: &'static str,
    },
    /// A time step that does not fit into the case.
    #[error("dt is {dt}, must divide the {simulated} of case `{case}`")]
    TimeStep {
        /// The case.
        case: String,
        /// The step.
        dt: f64,
        /// The time to be simulated.
        simulated: f64,
    },
    /// A table lacks a line or a column.
    #[error("the table has no {what}")]
    Missing {
        /// The missing part.
        what: String,
    },
    /// A cell that cannot be read.
    #[error("line {line}, column `{column}`: `{cell}` is no {expected}")]
    Cell {
        /// The line, counted from 1.
        line: usize,
        /// The name of the column.
        column: String,
        /// Its content.
        cell: String,
        /// The expected kind of content.
        expected: &'static str,
    },
    /// The fields of a case, or the properties of its colliders, were not accepted.
    #[error("{0}")]
    Fields(String),
}
