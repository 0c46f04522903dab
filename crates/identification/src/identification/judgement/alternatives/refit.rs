//! Least-squares solution with other signals, or for another arm.

use nalgebra::DVector;

use super::gravity_columns::GravityColumns;
use super::lean::{Lean, better_gravity};
use super::normal_equations::NormalEquations;
use crate::identification::judgement::positive_parameter::{parameter, positive_quantity};
use crate::identification::observation::{
    Motion, filtered_motion, filtered_torque, fitted_matrix, torque_equation,
};
use crate::identification::problem::{Context, Experiment, Method, Options};
use crate::regression::{ObservationMatrix, Observations, ResidualAnalysis, RowFilter, Solution};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{MotorIndex, ParameterKind, Robot};

/// Number of samples used. Wrong readings are present from the first sample on.
const INSPECTED: usize = 1 << 14;

/// Smallest sample rate, as a multiple of the cut-off of the position filter. Central differences
/// of the positions that pass it are then right to 2 %, for each reading alike.
const RATE_OF_POSITIONS: f64 = 20.0;

/// The same, as a multiple of the rate of the rows. Nothing above 0.4 of it passes the decimation
/// filter.
const RATE_OF_ROWS: f64 = 5.0;

/// Added to the squared columns, which have length 1: more than the rounding errors of their
/// products, and less than the square of what data determine.
const ROUNDING: f64 = 1e-13;

/// Gauss-Newton steps that close a direction of gravity. The screening finds it to a few degrees.
const CLOSING_STEPS: usize = 3;

/// Samples on which readings are compared, at a rate that is no higher than necessary.
pub(super) struct Inspected {
    pub(super) samples: Experiment,
    options: Options,
}

impl Inspected {
    pub(super) fn new(context: &Context<'_>) -> Self {
        let samples = context.experiment.first_samples(INSPECTED);
        let mut options = context.options.clone();
        let rate_hz = samples.sample_rate_hz();
        let of_positions_hz = RATE_OF_POSITIONS * options.position_filter.cutoff_hz;
        let needed_hz = of_positions_hz.max(RATE_OF_ROWS * context.rows_hz());
        let factor = options.decimation_filter.factor;
        let is_enough =
            |count: &usize| factor.is_multiple_of(*count) && rate_hz / *count as f64 >= needed_hz;
        let count = (1..=factor).rev().find(is_enough).unwrap_or(1);
        options.decimation_filter.factor = factor / count;
        let samples = if count > 1 { samples.means_of(count) } else { samples };
        Self { samples, options }
    }

    /// Returns the context of these samples, with everything else as it is configured.
    pub(super) fn context<'c>(&'c self, context: &Context<'c>) -> Option<Context<'c>> {
        let Context { robot, base, model, .. } = context;
        context_of((robot, base), &self.samples, &self.options, model)
    }
}

/// Returns the context of samples for an arm with this model and its base parameters. `None` if
/// they permit no identification.
pub(super) fn context_of<'a>(
    (robot, base): (&'a Robot, &'a BaseParameters),
    samples: &'a Experiment,
    options: &'a Options,
    model: &Model,
) -> Option<Context<'a>> {
    let mut context = Context::new(robot, base, samples, options, Method::IdimLs).ok()?;
    // Load-dependent friction keeps the same loads.
    context.model = model.clone();
    Some(context)
}

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

/// Parts that a solution has in common with another one.
#[derive(Clone, Copy)]
pub(super) enum Shared<'s, 'a> {
    /// Nothing.
    Nothing,
    /// The motion.
    Motion(&'s Refit<'a>),
    /// Motion and model.
    Matrix(&'s Refit<'a>),
}

/// Equation with its weighted solution.
pub(super) struct Solved {
    equation: Observations,
    /// Normal equations of the same matrix, for other torques.
    normal: NormalEquations,
    noise_levels: Vec<f64>,
    parameters: DVector<f64>,
    /// y − X θ (r).
    residuals: DVector<f64>,
}

impl Solved {
    /// Solves with the noise levels of ordinary least squares. `None` if a value is not finite.
    fn new(equation: Observations, mut normal: NormalEquations) -> Option<Self> {
        let torque = equation.measurements().as_slice();
        let ordinary = normal.solve(torque, &vec![1.0; equation.joints()])?;
        let noise_levels = equation.noise_levels(&equation.residuals(&ordinary));
        let weights: Vec<f64> = noise_levels.iter().map(|level| level.powi(-2)).collect();
        let parameters = normal.solve(torque, &weights)?;
        let residuals = equation.residuals(&parameters);
        Some(Self { equation, normal, noise_levels, parameters, residuals })
    }

    /// Returns θ.
    pub(super) fn parameters(&self) -> &DVector<f64> {
        &self.parameters
    }

    /// Returns the same solution with its covariance.
    pub(super) fn with_covariance(&self) -> Option<Solution> {
        self.equation.solve_weighted(&self.noise_levels).ok()
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
        let Some(solution) = self.with_covariance() else { return Vec::new() };
        let analysis = self.analysis(&solution, filter);
        let deviations = context.options.limits.negative_deviations;
        let (values, variances) = (&solution.parameters, analysis.covariance().diagonal());
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
    pub(super) fn analysis<'s>(
        &'s self,
        solution: &'s Solution,
        filter: &'s RowFilter,
    ) -> ResidualAnalysis<'s> {
        ResidualAnalysis::new(&self.equation, solution, filter)
    }

    /// Returns the number of independent rows of each joint, by the autocorrelation of its
    /// residual. `configured` is the analysis of the configured reading.
    pub(super) fn effective_rows(&self, configured: &ResidualAnalysis<'_>) -> Vec<f64> {
        configured.effective_rows_of(&self.equation, &self.residuals)
    }
}

impl<'a> Refit<'a> {
    /// Returns a turn of gravity after Gauss-Newton steps on the fitted rows, with its solution.
    /// This is the solution with the turn.
    pub(super) fn closer(&self, lean: Lean) -> Option<(Lean, Self)> {
        let Self { context, motion, torque: measured, solved: Solved { equation, .. }, .. } = self;
        let columns = GravityColumns::fitted(context, motion, equation.matrix().clone())?;
        let torque = equation.measurements();
        let rms = equation.rms_per_joint(torque);
        let weights: Vec<f64> =
            rms.iter().map(|of| if *of > 0.0 { of.powi(-2) } else { 0.0 }).collect();
        let mut gravity_m_s2 = lean.gravity_m_s2();
        for _ in 0..CLOSING_STEPS {
            gravity_m_s2 = better_gravity(&columns, gravity_m_s2, torque, &weights)?;
        }
        let mut context = context.clone();
        context.model = context.model.with_gravity(gravity_m_s2);
        let matrix = columns.matrix(gravity_m_s2);
        let normal = NormalEquations::new(&matrix, ROUNDING);
        let closer = Self::solve(context, motion.clone(), measured.clone(), (matrix, normal))?;
        Some((Lean::between(lean.configured_m_s2, gravity_m_s2)?, closer))
    }

    /// Solves with the samples of a context. `None` if there is no solution.
    pub(super) fn new(context: Context<'a>, shared: Shared<'_, '_>) -> Option<Self> {
        let motion = match shared {
            Shared::Nothing => {
                let filter = &context.options.position_filter;
                filtered_motion(context.robot, context.experiment, filter).ok()?
            }
            Shared::Motion(other) | Shared::Matrix(other) => other.motion.clone(),
        };
        let sides = match shared {
            Shared::Nothing | Shared::Motion(_) => {
                let matrix = fitted_matrix(&context, &motion).ok()?;
                let normal = NormalEquations::new(&matrix, ROUNDING);
                (matrix, normal)
            }
            Shared::Matrix(Refit { solved: of, .. }) => {
                (of.equation.matrix().clone(), of.normal.clone())
            }
        };
        let torque = filtered_torque(&context).ok()?;
        Self::solve(context, motion, torque, sides)
    }

    /// Solves for filtered torques with a matrix and its normal equations.
    fn solve(
        context: Context<'a>,
        motion: Motion,
        torque: DVector<f64>,
        (matrix, normal): (ObservationMatrix, NormalEquations),
    ) -> Option<Self> {
        let equation = torque_equation(&context, matrix, torque.clone(), &motion).ok()?;
        let solved = Solved::new(equation, normal)?;
        let equation = &solved.equation;
        let errors = equation.residual_statistics(&solved.residuals).relative_error_per_joint;
        let torques = equation.rms_per_joint(&torque);
        let residual = |joint: usize| {
            context
                .has_torque(joint)
                .then(|| JointResidual { relative_error: errors[joint], torque: torques[joint] })
        };
        let joints = (0..context.robot.joints()).map(residual).collect();
        Some(Self { context, motion, torque, joints, solved })
    }
}
