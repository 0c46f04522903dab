//! Why the iteration of a method that simulates ends without a result.

use thiserror::Error;

use super::failure::Failure;
use didim_dynamics::simulation::SimulationError;

/// Why an iteration ends; each message ends with the remedy.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum IterationError {
    /// The closed loop cannot be simulated with the parameters to start from. Remedy: another
    /// start, or a controller that holds the arm.
    #[error(
        "the first simulation failed: {cause}; choose another start, or check gains, timing and \
         substeps of the simulated controller"
    )]
    FirstSimulation {
        /// Cause, with joint and time.
        cause: SimulationError,
    },
    /// Even the shortest step leads to parameters that cannot be simulated. Remedy: fewer
    /// parameters, another start, or a controller that holds the arm.
    #[error(
        "simulation {simulations} failed after halving the step {halvings} times: {cause}; \
         identify fewer parameters, choose another start, or check the simulated controller"
    )]
    NoStep {
        /// Simulations run.
        simulations: u32,
        /// Halvings tried.
        halvings: u32,
        /// Last cause, with joint and time.
        cause: SimulationError,
    },
    /// The estimates still change. Remedy: allow more simulations, leave out the parameter that
    /// moves most, or check reference and controller.
    #[error(
        "not converged after {simulations} simulations: the relative error changed by {}, \
         {parameter} by {parameter_change:.2e} standard deviations; allow more simulations, leave \
         {parameter} out, or check the reference and the simulated controller",
        relative_error_change.map_or("an unknown amount".to_owned(), |c| format!("{c:.1e}"))
    )]
    NotConverged {
        /// Simulations run.
        simulations: u32,
        /// Last change of the relative error, when there were two steps.
        relative_error_change: Option<f64>,
        /// Last change of the parameter that moves most, in standard deviations.
        parameter_change: f64,
        /// That parameter.
        parameter: String,
    },
    /// No step lowers the error, though the parameters are not at its minimum: the sensitivities do
    /// not describe the simulation. Remedy: a smooth sign model, more substeps, or fewer
    /// parameters.
    #[error(
        "no step lowers the error after {simulations} simulations, though {parameter} should move \
         by {parameter_change:.2e} standard deviations; choose a smooth sign model, more substeps, \
         or leave {parameter} out"
    )]
    NoDescent {
        /// Simulations run.
        simulations: u32,
        /// The parameter that the linear step moves furthest.
        parameter: String,
        /// Size of the step, in standard deviations.
        parameter_change: f64,
    },
    /// The simulated signal does not depend on some parameters, or only on combinations of them.
    /// Remedy: leave some of them out, move along a richer trajectory, or compare the torques.
    #[error(
        "the simulated {signal} does not distinguish {}; leave some out, move along a richer \
         trajectory, or identify from the torques (clie)",
        parameters.join(", ")
    )]
    Insensitive {
        /// The signal whose error is minimised.
        signal: &'static str,
        /// Every parameter that takes part.
        parameters: Vec<String>,
    },
}

impl IterationError {
    /// Returns how the identification failed.
    pub(super) fn failure(&self) -> Failure {
        match self {
            Self::FirstSimulation { .. } | Self::NoStep { .. } => Failure::Diverged,
            Self::Insensitive { .. } => Failure::Insensitive,
            Self::NotConverged { .. } | Self::NoDescent { .. } => Failure::NotConverged,
        }
    }
}
