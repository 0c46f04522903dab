//! Torque uncertainty outside the recorded motion.

use crate::stored_value::{number, numbers};
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::nuisance_parameters::NuisanceColumns;
use super::reached::ReachedRange;
use crate::identification::observation::{Motion, known_at, regressor_rows};
use crate::identification::problem::{Context, IdentificationError};
use crate::regression::{JointSolution, relative_errors};

/// Number of states. The figure of six-axis arms is then within 2 % of that of 20,000 random
/// states, as with twice as many random ones.
const STATE_COUNT: usize = 750;

/// Steps of the fixed-point iteration for φ; each reduces the error by more than half.
const ROOT_STEPS: usize = 60;

/// Torque uncertainty outside the recorded motion, as root mean squares over evenly spread states.
/// Positions are anywhere within the arm's limits, velocities and accelerations within the ranges
/// of the record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Extrapolation {
    /// Torque error over all joints, relative to the torque in these states.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub relative_error: f64,
    /// Torque error of each joint, relative to its torque in these states.
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub relative_error_per_joint: Vec<f64>,
    /// Torque error of each joint \[N·m or N\].
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub error_per_joint_nm: Vec<f64>,
}

impl Extrapolation {
    /// Computes the difference between the fitted model and the model with the nuisance parameters,
    /// including their posterior uncertainty. Errors that stay with the arm, such as an encoder's
    /// zero error, are in both and cancel.
    pub(super) fn new(
        context: &Context<'_>,
        motion: &Motion,
        columns: &NuisanceColumns<'_>,
        parameters: &DVector<f64>,
        solution: &JointSolution,
    ) -> Result<Self, IdentificationError> {
        let mut squares = vec![[0.0; 2]; context.robot.joints()];
        for states in in_blocks(&states(context, motion)) {
            let rows = regressor_rows(&context.model, context.selection.columns(), &states)?;
            let nuisance_columns = columns.at_states(&states, &columns.left_out_at(&states)?);
            let mut predicted = &rows * parameters;
            if let Some(known_torque) = known_at(context, &states)? {
                predicted += known_torque;
            }
            let count = states.position.nrows();
            for (joint, [error, torque]) in squares.iter_mut().enumerate() {
                let [own, further] =
                    [&rows, &nuisance_columns].map(|of| of.rows(joint * count, count));
                *error += solution.squared_error(own, further) / STATE_COUNT as f64;
                *torque += predicted.rows(joint * count, count).norm_squared() / STATE_COUNT as f64;
            }
        }
        let (relative_error, relative_error_per_joint) = relative_errors(&squares);
        Ok(Self {
            relative_error,
            relative_error_per_joint,
            error_per_joint_nm: (squares.iter().enumerate())
                .map(|(joint, [error, _])| match context.has_torque(joint) {
                    true => error.sqrt(),
                    false => f64::NAN,
                })
                .collect(),
        })
    }
}

/// Returns the states in blocks, so that their matrices fit in the nearest caches.
fn in_blocks(states: &Motion) -> impl Iterator<Item = Motion> {
    /// Number of states in a block; it divides the number of all states.
    const BLOCK_SAMPLES: usize = 250;
    let all_states = states.matrices();
    (0..STATE_COUNT).step_by(BLOCK_SAMPLES).map(move |first| {
        let [position, velocity, acceleration] =
            all_states.each_ref().map(|of| of.rows(first, BLOCK_SAMPLES).into_owned());
        Motion::from_matrices(position, velocity, acceleration)
    })
}

/// Returns evenly spread states: positions within the limits of the robot, velocities and
/// accelerations within the ranges of the counted samples. Each quantity is an additive recurrence
/// with a power of 1/φ, where φ is the root of `φⁿ⁺¹ = φ + 1` for n quantities: the golden ratio
/// for one (M. Roberts, *The unreasonable effectiveness of quasirandom sequences*, 2018).
fn states(context: &Context<'_>, motion: &Motion) -> Motion {
    let joints = context.robot.joints();
    let exponent = 1.0 / (3.0 * joints as f64 + 1.0);
    let root = (0..ROOT_STEPS).fold(2.0, |root: f64, _| (1.0 + root).powf(exponent));
    let mut step = 1.0;
    let mut spread = |ranges: &[[f64; 2]]| {
        let mut values = DMatrix::zeros(STATE_COUNT, joints);
        for (mut column, [low, high]) in values.column_iter_mut().zip(ranges) {
            step /= root;
            let width = if (high - low).is_finite() { high - low } else { 0.0 };
            for (k, value) in (1..).zip(&mut column) {
                *value = low + (0.5 + step * f64::from(k)).fract() * width;
            }
        }
        values
    };
    let positions: Vec<[f64; 2]> =
        (context.robot.limits()).map(|limits| [limits.position_min, limits.position_max]).collect();
    let reached = ReachedRange::from_context(context, motion);
    let column_of =
        |quantity: fn(&ReachedRange) -> [f64; 2]| reached.iter().map(quantity).collect::<Vec<_>>();
    let position = spread(&positions);
    let velocity = spread(&column_of(|reached| reached.velocity));
    let acceleration = spread(&column_of(|reached| reached.acceleration));
    Motion::from_matrices(position, velocity, acceleration)
}
