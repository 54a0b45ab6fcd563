//! Error against run time: the accuracy of a method for the time it takes.
//!
//! A case (`single::cases`, `double::cases`) is a small world of known outcome. A [`Method`] moves it at some time
//! step, and a [`Run`] holds the errors and the time. [`compare()`] compares runs of different methods at equal error,
//! as speeds at unequal errors are not comparable. Runs that [diverged](Run::diverged) are kept.
//!
//! ```
//! use rapier3d_fields_lab::single::cases::{Case, spring};
//! use rapier3d_fields_lab::study::{Method, Metric, StudyError};
//! let case = spring();
//! let error = |method| Ok::<_, StudyError>(case.run(method, 1.0 / 64.0)?.errors[0].value);
//! assert!(error(Method::KickDriftKick)? < 0.1 * error(Method::AddForce)?);
//! # Ok::<(), StudyError>(())
//! ```

mod compare;
mod cost;
mod csv;
mod equal_error;
mod error;
mod machine;
mod method;
mod metric;
mod page;
mod report;
mod run;
mod stability;
mod state;
mod store;
mod table;

pub use compare::{OrderFit, Verdict, compare, fit_order, time_at_error};
pub use cost::{Ablation, Ceiling};
pub use csv::{from_csv, to_csv, to_table};
pub use error::StudyError;
pub use machine::Machine;
pub use method::Method;
pub use metric::Metric;
pub use report::{Advice, Report, Scene};
pub use run::{Measured, Run, Timing, quantile};
pub use stability::{StabilityCell, safe_turn};
pub use state::State;
pub use store::{Job, Outcome, Shard, Store, Work};
pub use table::{Row, Table};
