//! From an experiment to an estimate: the identification methods.
//!
//! Each method takes an [`Experiment`] and returns an [`Estimate`]; adding one touches one file and
//! the list of methods.

mod estimate;
mod experiment;

pub use estimate::{Estimate, ParameterEstimate, SingularValues, Verdict};
pub use experiment::{Experiment, SignalTiming};
