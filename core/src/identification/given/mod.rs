//! What is given: an experiment, and what a person decides about its identification.

mod context;
mod error;
mod experiment;
mod limits;
mod method;
mod options;
mod selection;
mod simulation;

pub(crate) use context::Context;
pub use error::{Failure, IdentificationError};
pub use experiment::{Experiment, ExperimentError, SignalTiming, Signals};
pub use limits::{LimitError, VerdictLimits};
pub use method::{Method, UnknownMethod};
pub use options::{DecimationFilter, Options, PositionFilter};
pub use selection::Selection;
pub use simulation::{ConvergenceLimits, Optimiser, SensitivityMethod, SimulationOptions, Start};
