//! The problem: an experiment, and the options of its identification.

mod closed_loop_limits;
mod context;
mod error;
mod experiment;
mod experiment_error;
mod failure;
mod fixed;
mod iteration_error;
mod limits;
mod method;
mod options;
mod payload_limits;
mod search;
mod selection;
mod simulation;
mod tolerances;
mod uses;

pub use closed_loop_limits::ClosedLoopLimits;
pub(crate) use context::Context;
pub use error::IdentificationError;
pub use experiment::{Experiment, SignalDelays};
pub(crate) use experiment::{
    change_motor_positions, change_motor_torques, to_joint_torques, to_motor_torques,
};
pub use experiment_error::ExperimentError;
pub use failure::Failure;
pub use fixed::KeptParameters;
pub use iteration_error::IterationError;
pub use limits::{LimitError, VerdictLimits};
pub use method::{Method, UnknownMethod};
pub use options::{DecimationFilter, Options, PositionFilter};
pub use payload_limits::PayloadLimits;
pub use search::{CutoffSearch, FrictionSearch};
pub use selection::Selection;
pub use simulation::{
    BodiesFrom, ConvergenceLimits, Optimiser, SensitivityMethod, SimulationOptions, Start,
};
pub use tolerances::{ToleranceError, Tolerances};
pub use uses::Use;
