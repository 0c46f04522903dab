//! Least-squares solution with other signals, or for another arm.

use nalgebra::DVector;

use crate::identification::judgement::positive_parameter::{parameter, positive_quantity};
use crate::identification::observation::{
    Motion, filtered_motion, filtered_torque, fitted_matrix, torque_equation,
};
use crate::identification::problem::{Context, Experiment, IdentificationError, Method};
use crate::regression::{Observations, ResidualAnalysis, RowFilter, Solution};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{MotorIndex, ParameterKind, Robot};

/// Number of samples used. Wrong readings are present from the first sample on.
pub(super) const INSPECTED: usize = 1 << 14;

/// Residual of a joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointResidual {
    /// Root mean square of the residual, relative to that of the torque.
    pub(super) relative_error: f64,
    /// Root mean square of the torque \[N·m or N\].
    pub(super) torque: f64,
}

/// Least-squares solution with other signals.
pub(super) struct Refit<'a> {
    pub(super) context: Context<'a>,
    /// Filtered motion of all samples.
    pub(super) motion: Motion,
    /// Filtered torques (r).
    pub(super) torque: DVector<f64>,
    /// Residual of each joint; `None` if its torque is not recorded.
    pub(super) joints: Vec<Option<JointResidual>>,
    pub(super) solved: Solved,
}

/// Equation with its solution.
pub(super) struct Solved {
    equation: Observations,
    solution: Solution,
}

impl Solved {
    /// Returns θ.
    pub(super) fn parameters(&self) -> &DVector<f64> {
        &self.solution.parameters
    }

    /// Returns the places of the friction parameters of some drives that are negative by more than
    /// their uncertainty: such friction would drive the arm. Drive inertias are left out, because
    /// errors of the model make them negative on right recordings. `context` is that of the
    /// selected parameters.
    pub(super) fn negative_friction(
        &self,
        context: &Context<'_>,
        filter: &RowFilter,
        motors: &[MotorIndex],
    ) -> Vec<usize> {
        if motors.is_empty() {
            return Vec::new();
        }
        let analysis = self.analysis(filter);
        let deviations = context.options.limits.negative_deviations;
        let (values, variances) = (self.parameters(), analysis.covariance().diagonal());
        let regrouped = context.selection.regrouped();
        let is_negative = |k: &usize| values[*k] < -deviations * variances[*k].max(0.0).sqrt();
        let is_friction = |k: &usize| {
            let is_inertia = parameter(context, *k).kind == ParameterKind::Ia;
            !regrouped[*k] && !is_inertia && positive_quantity(context, *k).is_some()
        };
        let is_of_drive = |k: &usize| {
            let joint = parameter(context, *k).joint.position();
            motors.iter().any(|motor| motor.position() == joint)
        };
        let places = (0..values.len()).filter(is_of_drive);
        places.filter(is_negative).filter(is_friction).collect()
    }

    /// Returns the analysis of the residuals. `filter` is that of the rows.
    pub(super) fn analysis<'s>(&'s self, filter: &'s RowFilter) -> ResidualAnalysis<'s> {
        ResidualAnalysis::new(&self.equation, &self.solution, filter)
    }

    /// Returns the number of independent rows of each joint, by the autocorrelation of its
    /// residual. `configured` is the analysis of the configured reading.
    pub(super) fn effective_rows(&self, configured: &ResidualAnalysis<'_>) -> Vec<f64> {
        configured.effective_rows_of(&self.equation, &self.solution)
    }
}

impl<'a> Refit<'a> {
    /// Solves with other signals, for an arm with this model and its base parameters. `same_motion`
    /// is a solution with the same motion and model, if there is one.
    pub(super) fn new(
        context: &Context<'a>,
        (robot, base): (&'a Robot, &'a BaseParameters),
        experiment: &'a Experiment,
        model: &Model,
        same_motion: Option<&Refit<'_>>,
    ) -> Result<Self, IdentificationError> {
        let options = context.options;
        let mut context = Context::new(robot, base, experiment, options, Method::IdimLs)?;
        // Load-dependent friction keeps the same loads.
        context.model = model.clone();
        let (motion, matrix) = match same_motion {
            Some(of) => (of.motion.clone(), of.solved.equation.matrix().clone()),
            None => {
                let motion = filtered_motion(robot, experiment, &options.position_filter)?;
                let matrix = fitted_matrix(&context, &motion)?;
                (motion, matrix)
            }
        };
        let torque = filtered_torque(&context)?;
        let equation = torque_equation(&context, matrix, torque.clone(), &motion)?;
        let ordinary = equation.solve_ordinary().map_err(IdentificationError::Regression)?;
        let levels = equation.noise_levels(&ordinary.residuals);
        let solution = equation.solve_weighted(&levels).map_err(IdentificationError::Regression)?;
        let errors = equation.residual_statistics(&solution.residuals).relative_error_per_joint;
        let torques = equation.rms_per_joint(&torque);
        let residual = |joint: usize| {
            context
                .has_torque(joint)
                .then(|| JointResidual { relative_error: errors[joint], torque: torques[joint] })
        };
        let joints = (0..robot.joints()).map(residual).collect();
        let solved = Solved { equation, solution };
        Ok(Self { context, motion, torque, joints, solved })
    }
}
