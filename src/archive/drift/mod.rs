//! Drift: how the parameters of later results differ from those of a baseline.
//!
//! What is decided here is pure: a [`Tracker`] takes the lines of the history in their order and says
//! what changed, so that a service that was restarted, and a command that reads the history, come to
//! the same alarms.

mod alarm;
mod baseline;
mod change;
mod choose;
mod comparable;
mod days;
mod judged_history;
mod options;
mod status;
mod tracker;
mod trend;
mod wording;

pub use alarm::{Alarm, AlarmEvent};
pub use baseline::{BASELINE_SCHEMA, Baseline, BaselineError, BaselineWatch};
pub use change::Change;
pub use choose::{ChooseError, set_baseline};
pub use comparable::{NotComparable, comparable};
pub use judged_history::{Entry, JudgedHistory};
pub use options::{DriftOptionError, DriftOptions};
pub use status::{AlarmStatus, DriftStatus, ParameterDrift};
pub use tracker::{Comparison, Tracker};
pub use trend::{Trend, trend};
pub use wording::{FORECAST_SPANS, forecast, sentence};

#[cfg(test)]
mod tests;
