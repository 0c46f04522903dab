//! Convergence of an iteration: its steps, checked against the limits.

use nalgebra::DVector;

use crate::identification::judgement::ConvergenceStep;
use crate::identification::problem::{ConvergenceLimits, IdentificationError, IterationError};

/// Relative error that is small for any arm. Changes of smaller errors are compared with this
/// value, because without noise the error would decrease without limit.
const SMALL_ERROR: f64 = 1e-3;

/// Steps of an iteration so far.
pub(super) struct Convergence<'a> {
    limits: ConvergenceLimits,
    names: &'a [String],
    pub(super) steps: Vec<ConvergenceStep>,
    /// Index of the parameter that the last step changed most.
    most_changed: usize,
}

impl<'a> Convergence<'a> {
    pub(super) fn new(limits: ConvergenceLimits, names: &'a [String]) -> Self {
        Self { limits, names, steps: Vec::new(), most_changed: 0 }
    }

    /// Records the step that follows a simulation and returns whether the parameters have
    /// converged. `changes` are in standard deviations. A second step from the same simulation,
    /// with other weights, is not recorded; its relative error counts as unchanged.
    pub(super) fn record_step(
        &mut self,
        simulation: u32,
        halvings: u32,
        relative_error: f64,
        changes: &DVector<f64>,
    ) -> bool {
        let limits = &self.limits;
        let again = self.steps.last().is_some_and(|last| last.simulation == simulation);
        let last = self.steps.last().map(|step| step.relative_error);
        let relative_error_change =
            last.map(|last| (relative_error - last).abs() / last.max(SMALL_ERROR));
        self.most_changed = changes.icamax();
        let parameter_change = changes[self.most_changed].abs();
        let settled = again
            || relative_error_change.is_some_and(|change| change <= limits.relative_error_change);
        let stands = settled && parameter_change <= limits.parameter_change;
        if !again {
            self.steps.push(ConvergenceStep {
                simulation,
                relative_error,
                relative_error_change,
                parameter_change,
                halvings,
            });
        }
        stands
    }

    /// Returns the name of the parameter that the last step changed most.
    pub(super) fn most_changed_name(&self) -> String {
        self.names.get(self.most_changed).cloned().unwrap_or_default()
    }

    /// Returns the change of that parameter in standard deviations.
    pub(super) fn parameter_change(&self) -> Option<f64> {
        self.steps.last().map(|step| step.parameter_change)
    }

    /// Checks that another simulation is permitted after `counted` simulations. If not, the error
    /// reports the changes of the last step.
    pub(super) fn check_left(
        &self,
        counted: u32,
        simulations: u32,
    ) -> Result<(), IdentificationError> {
        if counted < self.limits.max_simulations {
            return Ok(());
        }
        Err(IterationError::NotConverged {
            simulations,
            relative_error_change: self.steps.last().and_then(|step| step.relative_error_change),
            parameter_change: self.parameter_change().unwrap_or(f64::INFINITY),
            parameter: self.most_changed_name(),
        }
        .into())
    }
}
