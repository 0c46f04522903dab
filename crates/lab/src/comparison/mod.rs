//! Comparison of all methods on one experiment.
//!
//! [`compare`] identifies with each method after the decimation filter and, if requested, again
//! without the filter for the methods that have a strict framework. The result is a [`Comparison`],
//! which [`report`](crate::report) renders. [`Published`] figures can be shown next to the results,
//! and [`Limits`] define the required outcome.

mod agreement;
mod held_out;
mod input;
mod limits;
mod method_comparison;
mod published;
mod result;
mod run;
mod trial;

pub(crate) use agreement::lies_in;
pub use agreement::{Agreement, INTERVAL_DEVIATIONS};
pub use held_out::{HeldOut, TorqueErrors};
pub use input::ComparisonInput;
pub(crate) use limits::mean;
pub use limits::{Figure, Limit, LimitOutcome, Limits};
pub use method_comparison::{Comparison, SCHEMA, TrueParameter};
pub use published::{Published, PublishedErrors, PublishedFigures, PublishedSingularValues};
pub use result::MethodResult;
pub use run::{Progress, Task, compare, list_tasks};
pub use trial::{Framework, Trial, title, trials};
