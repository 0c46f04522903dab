//! How well a method predicts what it has not seen.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::dynamics::{BaseParameters, Model};
use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::Experiment;
use crate::identification::given::options::IdimLsOptions;
use crate::identification::given::selection::Selection;
use crate::identification::judgement::estimate::{Estimate, Identification};
use crate::identification::observation::matrix::observation_matrix;
use crate::identification::observation::prefilter::{filtered_motion, filtered_torque};
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
/// [`IdentificationError::Blocks`], those of `identify`, and those of the filters.
pub fn cross_validate(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &IdimLsOptions,
    blocks: usize,
    identify: impl Fn(&Experiment) -> Result<Identification, IdentificationError>,
) -> Result<CrossValidation, IdentificationError> {
    let prediction = Prediction::new(robot, base, experiment, options)?;
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

    let whole = identify(experiment)?.estimate;
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
    base: &'a BaseParameters,
    /// The sample of each row of a joint.
    samples: Vec<usize>,
    matrix: DMatrix<f64>,
    torque: DVector<f64>,
}

impl<'a> Prediction<'a> {
    fn new(
        robot: &Robot,
        base: &'a BaseParameters,
        experiment: &Experiment,
        options: &IdimLsOptions,
    ) -> Result<Self, IdentificationError> {
        let decimation = options.decimation(true)?;
        let motion = filtered_motion(experiment, &options.position_filter)?;
        let selection = Selection::new(robot, base, None)?;
        let model = Model::new(robot);
        let matrix =
            observation_matrix(&model, &selection, &motion, &decimation, experiment.counted())?;
        let matrix = experiment.fitted_matrix(&decimation, matrix);
        let torque = filtered_torque(experiment, &decimation)?;
        Ok(Self { base, samples: experiment.fitted_samples(&decimation), matrix, torque })
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
            if let Some(index) = prediction.base.find(&parameter.name) {
                parameters[index] = parameter.value;
            }
        }
        let predicted = &prediction.matrix * parameters;
        let rows = prediction.samples.len();
        for (joint, [errors, torques]) in self.0.iter_mut().enumerate() {
            let kept = prediction.samples.iter().enumerate();
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
