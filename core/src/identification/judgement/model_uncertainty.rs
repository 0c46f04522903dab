//! What a result has to keep, so that its error on another motion can be foretold.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::freedoms::{Columns, Observed};
use crate::identification::given::{Context, IdentificationError};
use crate::identification::observation::{BesideObservation, Motion};
use crate::regression::{JointSolution, Observations, relative_errors};

/// What the data say of the parameters and of all that the model takes for known, together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelUncertainty {
    pub(super) observed: Observed,
    /// Standard deviation of each freedom beforehand, which is its unit in mean and covariance (m).
    pub(super) deviations: Vec<f64>,
    /// How the parameters would change with the freedoms, and these (b + m).
    pub(super) mean: Vec<f64>,
    /// Their covariance, the rows of its lower triangle. Sizes: single precision is plenty.
    #[serde(with = "rows")]
    pub(super) covariance: Vec<f32>,
    /// Root mean square of what is left of each joint's torque with the freedoms \[N·m or N\].
    pub(super) noise_nm: Vec<f64>,
}

/// The error on a recording, as the result expected it before that was looked at: by the motion, with nothing of
/// the measured torque but its size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Foretold {
    /// Over all joints, relative to the measured torque.
    pub relative_error: f64,
    /// Of every joint.
    pub relative_error_per_joint: Vec<f64>,
}

impl ModelUncertainty {
    pub(super) fn new(columns: &Columns<'_>, noise_nm: Vec<f64>, solution: &JointSolution) -> Self {
        let of = |k: usize| solution.covariance.row(k).columns(0, k + 1).into_owned();
        #[expect(clippy::cast_possible_truncation, reason = "to single precision")]
        let covariance = (0..solution.covariance.nrows())
            .flat_map(|k| of(k).iter().map(|value| *value as f32).collect::<Vec<_>>())
            .collect();
        Self {
            observed: columns.observed().clone(),
            deviations: columns.deviations(),
            mean: solution.change.iter().chain(&solution.freedoms).copied().collect(),
            covariance,
            noise_nm,
        }
    }

    /// The error of these parameters along a motion; none where the freedoms of the context are others, or nothing finite comes of
    /// it.
    pub(crate) fn foretold(
        &self,
        context: &Context<'_>,
        motion: &Motion,
        beside: &BesideObservation,
        observations: &Observations,
        parameters: &DVector<f64>,
    ) -> Result<Option<Foretold>, IdentificationError> {
        let (own, freedoms) = (parameters.len(), self.deviations.len());
        let all = own + freedoms;
        let fits = self.mean.len() == all
            && self.covariance.len() == all * (all + 1) / 2
            && self.noise_nm.len() == observations.joints()
            && self.observed.fits(context);
        if !fits {
            return Ok(None);
        }
        let columns = Columns::new(context, parameters, self.observed.clone());
        let Some(columns) = columns.with_deviations(&self.deviations) else { return Ok(None) };
        let along = columns.along(motion, beside, observations)?;
        let solution = JointSolution {
            change: DVector::from_column_slice(&self.mean[..own]),
            freedoms: DVector::from_column_slice(&self.mean[own..]),
            covariance: DMatrix::from_fn(all, all, |i, j| {
                let (row, column) = (i.max(j), i.min(j));
                f64::from(self.covariance[row * (row + 1) / 2 + column])
            }),
            noise: DMatrix::zeros(0, 0),
            colour: 1.0,
        };
        let measured = observations.measured();
        let squares: Vec<[f64; 2]> = (0..observations.joints())
            .map(|joint| {
                let rows = observations.joint_rows(joint);
                let [x, c] = [observations.matrix(), &along].map(|of| of.rows_range(rows.clone()));
                let noise = rows.len() as f64 * self.noise_nm[joint].powi(2);
                let torque = measured.rows_range(rows).norm_squared();
                [solution.squared_error(x, c) + noise, torque]
            })
            .collect();
        let (relative_error, relative_error_per_joint) = relative_errors(&squares);
        let foretold = Foretold { relative_error, relative_error_per_joint };
        // What stands in a file may be anything.
        Ok(relative_error.is_finite().then_some(foretold))
    }
}

/// The rows of a lower triangle as one text each: numbers apart would take three times the room in an indented
/// file.
mod rows {
    use core::fmt::Write as _;

    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(
        triangle: &[f32],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let mut rest = triangle;
        let rows = (1..).map_while(|length: usize| {
            let (row, after) = rest.split_at_checked(length)?;
            rest = after;
            let mut text = String::new();
            for (k, value) in row.iter().enumerate() {
                // Writing to a String cannot fail.
                let _ = write!(text, "{}{value:e}", if k > 0 { " " } else { "" });
            }
            Some(text)
        });
        serializer.collect_seq(rows)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<f32>, D::Error> {
        let rows = Vec::<String>::deserialize(deserializer)?;
        let numbers = rows.iter().flat_map(|row| row.split_whitespace());
        let number = |text: &str| {
            text.parse()
                .map_err(|_| D::Error::custom(format!("`{text}` in a covariance is no number")))
        };
        numbers.map(number).collect()
    }
}
