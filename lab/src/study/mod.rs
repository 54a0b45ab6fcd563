//! Error against run time: what accuracy a method gives for the time it takes.
//!
//! A case (`single::cases`, `double::cases`) is a small world of known outcome; a [`Method`] moves
//! it in steps of some length; a [`Run`] says how far off it ended and how long it took.
//! [`compare()`] sets the runs of different methods side by side, at equal error: speed at unequal
//! errors says nothing. Runs that came to nothing are kept, and [say so](Run::diverged).
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
