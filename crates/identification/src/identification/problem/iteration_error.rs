//! Reasons why the iteration of a method that simulates ends without a result.

use thiserror::Error;

use super::failure::Failure;
use didim_dynamics::simulation::SimulationError;

/// Reason why an iteration ends without a result; each message ends with the remedy.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum IterationError {
    /// The closed loop cannot be simulated with the start parameters. Remedy: choose another start,
    /// or a controller that stabilises the arm.
    #[error(
        "the first simulation failed: {cause}; choose another start, or check gains, timing and \
         substeps of the simulated controller"
    )]
    FirstSimulation {
        /// Cause, with joint and time.
        cause: SimulationError,
    },
    /// Even the shortest step leads to parameters that cannot be simulated. Remedy: identify fewer
    /// parameters, choose another start, or a controller that stabilises the arm.
    #[error(
        "simulation {simulations} failed after halving the step {halvings} times: {cause}; \
         identify fewer parameters, choose another start, or check the simulated controller"
    )]
    NoStep {
        /// Number of simulations.
        simulations: u32,
        /// Number of halvings.
        halvings: u32,
        /// Last cause, with joint and time.
        cause: SimulationError,
    },
    /// The estimates still change after the last permitted simulation. Remedy: allow more
    /// simulations, leave out the parameter that changes most, or check reference and controller.
    #[error(
        "not converged after {simulations} simulations: the relative error changed by {}, \
         {parameter} by {parameter_change:.2e} standard deviations; allow more simulations, leave \
         {parameter} out, or check the reference and the simulated controller",
        relative_error_change.map_or("an unknown amount".to_owned(), |c| format!("{c:.1e}"))
    )]
    NotConverged {
        /// Simulations run.
        simulations: u32,
        /// Last change of the relative error; `None` after a single step.
        relative_error_change: Option<f64>,
        /// Last change of the parameter that changes most, in standard deviations.
        parameter_change: f64,
        /// Name of that parameter.
        parameter: String,
    },
    /// No step lowers the error, although the parameters are not at its minimum. The sensitivities
    /// do not describe the simulation. Remedy: choose a smooth sign model, more substeps, or fewer
    /// parameters.
    #[error(
        "no step lowers the error after {simulations} simulations, though {parameter} should move \
         by {parameter_change:.2e} standard deviations; choose a smooth sign model, more substeps, \
         or leave {parameter} out"
    )]
    NoDescent {
        /// Simulations run.
        simulations: u32,
        /// Parameter that the linear step changes most, in standard deviations.
        parameter: String,
        /// Change of this parameter in the step, in standard deviations.
        parameter_change: f64,
    },
    /// The simulated signal does not depend on some parameters, or only on combinations of them.
    /// Remedy: leave some of them out, record a richer trajectory, or use a method that fits
    /// torques.
    #[error(
        "the simulated {signal} does not distinguish {}; leave some out, move along a richer \
         trajectory, or identify from the torques (clie)",
        parameters.join(", ")
    )]
    Insensitive {
        /// Signal whose error is minimised.
        signal: &'static str,
        /// Names of all affected parameters.
        parameters: Vec<String>,
    },
}

impl IterationError {
    /// Returns the kind of failure of the identification.
    pub(super) fn failure(&self) -> Failure {
        match self {
            Self::FirstSimulation { .. } | Self::NoStep { .. } => Failure::Diverged,
            Self::Insensitive { .. } => Failure::Insensitive,
            Self::NotConverged { .. } | Self::NoDescent { .. } => Failure::NotConverged,
        }
    }
}
