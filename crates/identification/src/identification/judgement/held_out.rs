//! Prediction error on held-out data: folds of the motion, each predicted with parameters that were
//! identified without it.
//!
//! The regressor is that of the result. The rows of a fold are removed from the equation, and no
//! loop is simulated again.

use crate::stored_value::numbers;
use nalgebra::{Cholesky, DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::folds::{Folds, samples_within};
use super::quantiles::ResidualQuantiles;
use crate::identification::observation::Motion;
use crate::identification::problem::{Context, IdentificationError};
use crate::regression::{Observations, relative_errors};

/// Time on either side of a fold that is not fitted either \[s\].
const MARGIN_S: f64 = 0.2;

/// Smallest number of rows on either side: the filters mix a row mainly with these.
const MIN_MARGIN_ROWS: usize = 2;

/// Shortest fold \[s\].
const MIN_FOLD_S: f64 = 2.0 * MARGIN_S;

/// Returns the number of samples on either side of a fold that are not fitted, with this number of
/// samples per row.
pub(crate) fn margin_samples(sample_rate_hz: f64, samples_per_row: usize) -> usize {
    samples_within(MARGIN_S, sample_rate_hz).max(MIN_MARGIN_ROWS * samples_per_row)
}

/// Prediction error of the held-out folds. Each fold is predicted with parameters that were
/// identified without it and without similar motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct HeldOut {
    /// ‖y − Xθ‖ / ‖y‖ over all joints; `None` if the motion is too short or too poor to hold out
    /// folds.
    pub relative_error: Option<f64>,
    /// ‖y − Xθ‖ / ‖y‖ of each joint.
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub relative_error_per_joint: Vec<f64>,
    /// Quantiles of each joint's residuals at the sample rate \[N·m or N\].
    pub quantiles_per_joint: Vec<ResidualQuantiles>,
}

impl HeldOut {
    /// Computes the held-out errors, and the standard deviation of each parameter from the
    /// disagreement of the folds; `None` if no fold can be held out. `residuals` are the residuals
    /// of the parameters in the rows of `torque`.
    pub(super) fn new(
        context: &Context<'_>,
        motion: &Motion,
        folds: &Folds,
        torque: &Observations,
        parameters: &DVector<f64>,
        residuals: &DVector<f64>,
    ) -> Result<(Self, Option<DVector<f64>>), IdentificationError> {
        let margin = margin_samples(context.rows_hz(), 1);
        let Some(changes) = without_each(folds, margin, torque, residuals) else {
            return Ok((Self::default(), None));
        };
        let (rows, measured) = (torque.rows_per_joint(), torque.measured_values());
        let mut sums = vec![[0.0; 2]; torque.joints()];
        for (piece, change) in changes.iter().enumerate() {
            let remainder = residuals - torque.matrix().times_parameters(change);
            for (joint, [errors, torques]) in sums.iter_mut().enumerate() {
                let piece_rows =
                    folds.fold_of_row.iter().enumerate().filter(|(_, of)| **of == piece);
                for (row, _) in piece_rows {
                    *errors += remainder[joint * rows + row].powi(2);
                    *torques += measured[joint * rows + row].powi(2);
                }
            }
        }
        let (relative_error, relative_error_per_joint) = relative_errors(&sums);
        let without: Vec<_> = changes.iter().map(|change| parameters + change).collect();
        let piece_of = |sample: usize| {
            let next = context.samples.partition_point(|&row| row < sample);
            folds.fold_of_row[next.min(folds.fold_of_row.len() - 1)]
        };
        let held_out = Self {
            relative_error: Some(relative_error),
            relative_error_per_joint,
            quantiles_per_joint: ResidualQuantiles::per_joint(
                context, motion, &without, &piece_of,
            )?,
        };
        Ok((held_out, Some(jackknife_deviations(&changes))))
    }
}

/// Returns the jackknife standard deviations (J. W. Tukey, *Bias and confidence in not quite large
/// samples*, 1958) from the parameter changes without each fold. They assume nothing about the
/// residuals and include disturbances that occur in one fold only.
fn jackknife_deviations(changes: &[DVector<f64>]) -> DVector<f64> {
    let count = changes.len() as f64;
    let deviation = |k: usize| {
        let mean = changes.iter().map(|change| change[k]).sum::<f64>() / count;
        let squares: f64 = changes.iter().map(|change| (change[k] - mean).powi(2)).sum();
        (squares * (count - 1.0) / count).sqrt()
    };
    DVector::from_fn(changes.first().map_or(0, DVector::len), |k, _| deviation(k))
}

/// Returns the change of the parameters without each fold; `None` if a fold cannot be left out.
/// `margin` is the number of rows on either side of a fold, in the same recording, that are left
/// out as well.
fn without_each(
    folds: &Folds,
    margin: usize,
    torque: &Observations,
    residuals: &DVector<f64>,
) -> Option<Vec<DVector<f64>>> {
    if folds.distinct_s < folds.count as f64 * MIN_FOLD_S {
        return None;
    }
    let (rows, columns) = (torque.rows_per_joint(), torque.matrix().ncols());
    // Bit mask of the folds that contain each row or are close to it.
    let mut near = vec![0_u64; rows];
    for recording in &folds.recordings {
        for row in recording.clone() {
            let first = row.saturating_sub(margin).max(recording.start);
            let around = first..(row + margin + 1).min(recording.end);
            near[around].iter_mut().for_each(|near| *near |= 1 << folds.fold_of_row[row]);
        }
    }
    let levels = torque.noise_levels(residuals);
    // Normal equation of all rows with the same bit mask, which several folds share.
    let of_kind = |kind: u64| {
        let joint_rows: Vec<usize> = (0..rows).filter(|row| near[*row] == kind).collect();
        let (mut normal, mut right) =
            (DMatrix::<f64>::zeros(columns, columns), DVector::<f64>::zeros(columns));
        for (joint, level) in levels.iter().enumerate() {
            let x = torque.matrix().selected_rows_of(joint, &joint_rows) / *level;
            let of_joint: Vec<usize> = joint_rows.iter().map(|row| joint * rows + row).collect();
            let remainder = residuals.select_rows(&of_joint) / *level;
            let (products, along) = (x.tr_mul(&x), x.tr_mul(&remainder));
            for (i, &row) in torque.matrix().columns_of(joint).iter().enumerate() {
                right[row] += along[i];
                for (j, &column) in torque.matrix().columns_of(joint).iter().enumerate() {
                    normal[(row, column)] += products[(i, j)];
                }
            }
        }
        (normal, right, joint_rows.len())
    };
    let mut kinds = near.clone();
    kinds.sort_unstable();
    kinds.dedup();
    let equations: Vec<_> = kinds.into_iter().map(|kind| (kind, of_kind(kind))).collect();
    (0..folds.count)
        .map(|piece: usize| {
            let (mut normal, mut right) =
                (DMatrix::zeros(columns, columns), DVector::zeros(columns));
            let mut count = 0;
            let others = equations.iter().filter(|(kind, _)| kind & (1 << piece) == 0);
            for (_, (of_kind, right_of_kind, rows)) in others {
                normal += of_kind;
                right += right_of_kind;
                count += rows;
            }
            if count * torque.matrix().joints_with_equation() <= columns {
                return None;
            }
            // Scaling of the parameters, whose magnitudes differ.
            let scale = normal.diagonal().map(|square| 1.0 / square.sqrt());
            if !scale.iter().all(|scale| scale.is_finite()) {
                return None;
            }
            let scaled =
                DMatrix::from_fn(columns, columns, |i, j| scale[i] * normal[(i, j)] * scale[j]);
            let solved = Cholesky::new(scaled)?.solve(&right.component_mul(&scale));
            Some(solved.component_mul(&scale))
        })
        .collect()
}
