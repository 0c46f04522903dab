//! How well a method predicts what it has not seen.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::given::{Context, Experiment, IdentificationError, Method, Options};
use super::identify::identify;
use super::judgement::Estimate;
use super::observation::{filtered_motion, filtered_torque, fitted_matrix};
use crate::dynamics::BaseParameters;
use crate::robot::Robot;

/// Rows that the filters smear a sample over, to either side: a spike of one sample shows in some eight.
const REACH_ROWS: usize = 10;

/// Errors of one joint or of all, pooled over the blocks: ‖y − Xθ‖ / ‖y‖.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictionError {
    /// Over all joints.
    pub relative_error: f64,
    /// Of every joint.
    pub relative_error_per_joint: Vec<f64>,
}

/// What came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossValidation {
    /// Torques of the blocks, each predicted with parameters that were found without it.
    pub held_out: PredictionError,
    /// Torques of the same blocks, predicted with the parameters that were found with all of them.
    pub in_sample: PredictionError,
    /// The samples of each block.
    pub blocks: Vec<Range<usize>>,
    /// What was found without each block.
    pub estimates: Vec<Estimate>,
}

/// Splits the counted samples into `blocks` consecutive parts of equal length, identifies without each
/// in turn, and predicts it.
///
/// The prediction is the same for every method: the inverse dynamic model with the estimate, along the
/// filtered measured motion, both sides behind the parallel filter of `options`. So methods can be
/// compared by it. Rows within ten of a block are not fitted either, because the filters mix them with
/// those of the block.
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
    let guard = REACH_ROWS * options.decimation_filter.factor;
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
    let whole = identify(experiment)?.estimate;
    // Of all base parameters, whichever are identified.
    let options = Options { parameters: None, ..options.clone() };
    let context = Context::new(robot, base, experiment, &options, Method::IdimLs)?;
    let prediction = Prediction::new(&context)?;
    let (mut held_out, mut in_sample) = (Sums::new(robot.joints()), Sums::new(robot.joints()));
    let mut estimates = Vec::with_capacity(blocks);
    for range in &ranges {
        let margins =
            range.start.saturating_sub(guard)..(range.end + guard).min(experiment.samples());
        let without = experiment.clone().with_held_out(margins);
        let estimate = identify(&without.map_err(IdentificationError::HeldOut)?)?.estimate;
        held_out.add(&prediction, range, &estimate);
        in_sample.add(&prediction, range, &whole);
        estimates.push(estimate);
    }
    let (held_out, in_sample) = (held_out.error(), in_sample.error());
    Ok(CrossValidation { held_out, in_sample, blocks: ranges, estimates })
}

/// The rows of the inverse dynamic model with all base parameters.
struct Prediction<'a> {
    context: &'a Context<'a>,
    matrix: DMatrix<f64>,
    torque: DVector<f64>,
}

impl<'a> Prediction<'a> {
    fn new(context: &'a Context<'a>) -> Result<Self, IdentificationError> {
        let motion = filtered_motion(context.experiment, &context.options.position_filter)?;
        let matrix = fitted_matrix(context, &motion)?;
        Ok(Self { context, matrix, torque: filtered_torque(context)? })
    }
}

/// ‖y − Xθ‖² and ‖y‖² of every joint.
struct Sums(Vec<[f64; 2]>);

impl Sums {
    fn new(joints: usize) -> Self {
        Self(vec![[0.0; 2]; joints])
    }

    /// Adds the rows of these samples.
    fn add(&mut self, prediction: &Prediction<'_>, samples: &Range<usize>, estimate: &Estimate) {
        let mut parameters = DVector::zeros(prediction.matrix.ncols());
        for parameter in &estimate.parameters {
            if let Some(index) = prediction.context.base.find(&parameter.name) {
                parameters[index] = parameter.value;
            }
        }
        let predicted = &prediction.matrix * parameters;
        let rows = prediction.context.samples.len();
        for (joint, [errors, torques]) in self.0.iter_mut().enumerate() {
            let kept = prediction.context.samples.iter().enumerate();
            for (row, _) in kept.filter(|(_, sample)| samples.contains(sample)) {
                let torque = prediction.torque[joint * rows + row];
                *errors += (torque - predicted[joint * rows + row]).powi(2);
                *torques += torque * torque;
            }
        }
    }

    fn error(&self) -> PredictionError {
        let all = self.0.iter().fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
        let relative = |[errors, torques]: &[f64; 2]| (errors / torques).sqrt();
        PredictionError {
            relative_error: relative(&all),
            relative_error_per_joint: self.0.iter().map(relative).collect(),
        }
    }
}
