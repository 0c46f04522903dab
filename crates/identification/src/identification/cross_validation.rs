//! Prediction error of a method on held-out data.

use core::ops::Range;

use nalgebra::DVector;

use super::identify::identify;
use super::judgement::{Estimate, margin_samples};
use super::observation::{filtered_motion, filtered_torque, fitted_matrix, torque_equation};
use super::prediction::PredictionError;
use super::problem::{Context, Experiment, IdentificationError, Method, Options};
use crate::regression::{Observations, relative_errors};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// Result of a cross-validation.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossValidation {
    /// Prediction error of the blocks, each predicted with parameters that were identified without
    /// it.
    pub held_out: PredictionError,
    /// Prediction error of the same blocks with the parameters of all blocks.
    pub in_sample: PredictionError,
    /// Samples of each block.
    pub blocks: Vec<Range<usize>>,
    /// Estimate without each block.
    pub fold_estimates: Vec<Estimate>,
}

/// Splits the counted samples into `blocks` consecutive parts of equal length. Identifies without
/// each block in turn, and predicts the omitted block.
///
/// The prediction is the same for every method: the inverse dynamic model with the estimate, along
/// the filtered measured motion, with both sides filtered by the parallel filter of `options`. So
/// methods can be compared by this error. Samples within 0.2 s, and within two rows, of the omitted
/// block are not fitted either, because the filters mix them with its rows.
///
/// # Errors
/// [`IdentificationError::Blocks`], and those of [`identify`].
pub fn cross_validate(
    method: Method,
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
    blocks: usize,
) -> Result<CrossValidation, IdentificationError> {
    let counted = experiment.counted();
    let guard = margin_samples(experiment.sample_rate_hz(), options.decimation_filter.factor);
    let length = counted.len() / blocks.max(1);
    if blocks < 2 || length <= guard {
        return Err(IdentificationError::Blocks { blocks, samples: counted.len(), guard });
    }
    let end = |block: usize| match block + 1 {
        last if last == blocks => counted.end,
        next => counted.start + next * length,
    };
    let ranges: Vec<Range<usize>> =
        (0..blocks).map(|block| counted.start + block * length..end(block)).collect();

    let identify = |experiment: &_| identify(method, robot, base, experiment, options);
    let full_estimate = identify(experiment)?.estimate;
    // The prediction uses all base parameters, including those that are not identified.
    let options = Options { parameters: None, keep_nominal: None, ..options.clone() };
    let context = Context::new(robot, base, experiment, &options, Method::IdimLs)?;
    let rows = FoldRows::new(&context)?;
    // If friction depends on the load, each estimate predicts with its own load.
    let add = |errors: &mut FoldErrors, range: &Range<usize>, estimate: &Estimate| {
        let values = values(estimate);
        if !context.model.feels_loads() {
            return errors.add(&rows, range, &values);
        }
        let names = context.selection.names().iter();
        let value =
            |name: &String| values.iter().find(|(own, _)| own == name).map(|(_, value)| *value);
        let parameters = names.map(|name| value(name).unwrap_or(0.0)).collect::<Vec<f64>>();
        let judged = context.with_final_loads(&DVector::from_vec(parameters));
        errors.add(&FoldRows::new(&judged)?, range, &values)
    };
    let (mut held_out, mut in_sample) =
        (FoldErrors::new(robot.joints()), FoldErrors::new(robot.joints()));
    let mut estimates = Vec::with_capacity(blocks);
    for range in &ranges {
        let margins =
            range.start.saturating_sub(guard)..(range.end + guard).min(experiment.samples());
        let without = experiment.clone().with_held_out(margins);
        let estimate = identify(&without.map_err(IdentificationError::HeldOut)?)?.estimate;
        add(&mut held_out, range, &estimate)?;
        add(&mut in_sample, range, &full_estimate)?;
        estimates.push(estimate);
    }
    let (held_out, in_sample) = (held_out.relative_error(), in_sample.relative_error());
    Ok(CrossValidation { held_out, in_sample, blocks: ranges, fold_estimates: estimates })
}

fn values(estimate: &Estimate) -> Vec<(&str, f64)> {
    let fixed = estimate.nominal.iter().map(|p| (p.name.as_str(), p.value));
    estimate.parameters.iter().map(|p| (p.name.as_str(), p.value)).chain(fixed).collect()
}

/// Rows of the inverse dynamic model with all base parameters.
struct FoldRows<'a> {
    context: &'a Context<'a>,
    equation: Observations,
}

impl<'a> FoldRows<'a> {
    fn new(context: &'a Context<'a>) -> Result<Self, IdentificationError> {
        let motion =
            filtered_motion(context.robot, context.experiment, &context.options.position_filter)?;
        let matrix = fitted_matrix(context, &motion)?;
        let equation = torque_equation(context, matrix, filtered_torque(context)?, &motion)?;
        Ok(Self { context, equation })
    }
}

/// Sums ‖y − Xθ‖² and ‖y‖² of every joint, and the number of rows.
struct FoldErrors {
    sums_of_squares: Vec<[f64; 2]>,
    row_counts: usize,
}

impl FoldErrors {
    fn new(joints: usize) -> Self {
        Self { sums_of_squares: vec![[0.0; 2]; joints], row_counts: 0 }
    }

    /// Adds the errors of the rows of these samples.
    fn add(
        &mut self,
        rows: &FoldRows<'_>,
        samples: &Range<usize>,
        parameters: &[(&str, f64)],
    ) -> Result<(), IdentificationError> {
        let FoldRows { context, equation } = rows;
        let mut values = DVector::zeros(equation.matrix().ncols());
        for (name, value) in parameters {
            let index = context.base.find(name).ok_or_else(|| {
                let names = context.base.names().to_vec();
                IdentificationError::UnknownParameter { name: (*name).to_owned(), available: names }
            })?;
            values[index] = *value;
        }
        let (remainder, torque) = (equation.residuals(&values), equation.measured_values());
        let count = context.samples.len();
        let fold_rows: Vec<usize> = (context.samples.iter().enumerate())
            .filter(|(_, sample)| samples.contains(sample))
            .map(|(row, _)| row)
            .collect();
        for (joint, [errors, torques]) in self.sums_of_squares.iter_mut().enumerate() {
            for row in fold_rows.iter().map(|row| joint * count + row) {
                *errors += remainder[row].powi(2);
                *torques += torque[row].powi(2);
            }
        }
        self.row_counts += fold_rows.len();
        Ok(())
    }

    fn relative_error(&self) -> PredictionError {
        let (relative_error, relative_error_per_joint) = relative_errors(&self.sums_of_squares);
        // A joint without a recorded torque has no error.
        let rms = |[errors, torques]: &[f64; 2]| match *torques > 0.0 {
            true => (errors / self.row_counts as f64).sqrt(),
            false => f64::NAN,
        };
        PredictionError {
            relative_error,
            relative_error_per_joint,
            rms_error_per_joint_nm: self.sums_of_squares.iter().map(rms).collect(),
        }
    }
}
