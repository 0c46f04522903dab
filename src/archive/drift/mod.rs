//! Drift: the differences between the parameters of later results and those of a baseline.
//!
//! The decisions of this module are pure functions. A [`Tracker`] takes the lines of the history in
//! order and reports the changes. A restarted service and a command that reads the history
//! therefore find the same alarms.

mod alarm;
mod baseline;
mod change;
mod choose;
mod comparable;
mod days;
mod entry;
mod judged_history;
mod limits;
mod options;
mod status;
mod thinned_history;
mod tracker;
mod trend;
mod wording;

pub use alarm::{Alarm, AlarmEvent};
pub use baseline::{BASELINE_SCHEMA, Baseline, BaselineError, BaselineWatch};
pub use change::Change;
pub use choose::{ChooseError, set_baseline};
pub use comparable::{NotComparable, check_comparable};
pub use entry::Entry;
pub use judged_history::JudgedHistory;
pub use limits::DriftLimits;
pub use options::{DriftOptionError, DriftOptions};
pub use status::{AlarmStatus, DriftStatus, ParameterDrift};
pub use tracker::{Comparison, Tracker};
pub use trend::{Trend, trend};
pub use wording::{band_exit, change_sentence};

#[cfg(test)]
mod tests;
