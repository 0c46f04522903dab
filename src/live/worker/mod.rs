//! From samples to results, outside the bus thread: windows, their rejection and their
//! identification.
//!
//! The worker has three threads. One follows the stream and cuts it into windows. One identifies
//! the windows, so that a long identification cannot make the stream overflow. One identifies the
//! load in the last seconds of motion. The window boundaries depend on sequence numbers only, never
//! on arrival times.

mod command;
mod configuration;
mod identify;
mod load;
mod load_status;
mod log_rate;
mod open;
mod run;
mod setup;
mod silence;
mod state;
mod time_of_day;
mod unstored;
mod window;
mod windower;

pub use command::{Command, Commands, SubmitError};
pub use configuration::{Configuration, FindLoad, IdentifiedWindow, Identify, Refusal};
pub use load_status::{LoadState, LoadStatus};
pub use run::{Worker, WorkerEnd};
pub use setup::{WorkerError, WorkerOptions};
pub use state::{EstimateSummary, EstimationStatus, SharedEstimation, UseSummary, WindowState};
pub use time_of_day::TimeOfDay;
pub use window::{Loss, RejectedWindow, Rejection, WindowEvent};
pub use windower::{CommandError, Windower};
