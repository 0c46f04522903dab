//! Every method on one experiment, side by side.
//!
//! [`compare`] identifies with each method, behind the decimation filter and, where that is of
//! interest, without it; the result is a [`Comparison`], which [`report`](crate::report) renders.
//! [`Published`] figures can stand beside it, and [`Limits`] say what must come out.

mod agreement;
mod comparison;
mod held_out;
mod input;
mod limits;
mod published;
mod result;
mod run;
mod trial;

pub(crate) use agreement::lies_in;
pub use agreement::{Agreement, SIGMAS};
pub use comparison::{Comparison, SCHEMA, TrueParameter};
pub use held_out::{HeldOut, TorqueErrors};
pub use input::ComparisonInput;
pub(crate) use limits::mean;
pub use limits::{Figure, Limit, Limits, Outcome};
pub use published::{Published, PublishedErrors, PublishedFigures, PublishedSingularValues};
pub use result::MethodResult;
pub use run::{Progress, Task, compare, tasks};
pub use trial::{Framework, Trial, title, trials};
