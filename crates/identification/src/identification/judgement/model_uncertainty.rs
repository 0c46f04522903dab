//! Model errors that a result has to keep. They predict its error on another motion, and
//! distinguish model errors from a change of the arm.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use super::nuisance_parameters::{NuisanceColumns, NuisanceObservation, Observed};
use super::rows::MatrixRows;
use super::scaled_rows::ScaledRows;
use crate::identification::observation::{AuxiliaryObservation, Motion, torque_rates};
use crate::identification::problem::{Context, IdentificationError};
use crate::regression::{JointSolution, Observations, gram_matrix};

/// Joint information of the data on the parameters and on everything that the model assumes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct ModelUncertainty {
    pub(super) observed: Observed,
    /// Prior standard deviation of each nuisance parameter, which is its unit in mean and
    /// covariance (m).
    pub(super) deviations: Vec<f64>,
    /// Parameter changes with the nuisance parameters, then the nuisance parameters themselves (b +
    /// m).
    pub(super) mean: Vec<f64>,
    /// Lower triangle L of the covariance LLᵀ of `mean`, row by row: the scale of the row, and its
    /// numbers in base64 as 16-bit multiples of the scale, least significant byte first.
    #[schemars(with = "Vec<String>")]
    pub(super) covariance_factor: ScaledRows,
    /// K: sensitivity of each parameter to a unit of each nuisance parameter (b × m), in rows like
    /// those of `covariance_factor`. Empty in results of versions that did not store it.
    #[schemars(with = "Vec<String>")]
    pub(super) sensitivity: ScaledRows,
    /// Root mean square of each joint's residual torque with the nuisance parameters \[N·m or N\].
    pub(super) noise_nm: Vec<f64>,
}

/// A stored uncertainty, of this version or an earlier one.
#[derive(Deserialize)]
struct StoredUncertainty {
    observed: Observed,
    deviations: Vec<f64>,
    mean: Vec<f64>,
    #[serde(default)]
    covariance_factor: ScaledRows,
    #[serde(default)]
    sensitivity: ScaledRows,
    /// Lower triangle of the covariance, in results of schema 1.
    #[serde(default)]
    covariance: MatrixRows<f32>,
    /// K, in results of schema 1.
    #[serde(default)]
    influence: MatrixRows<f32>,
    noise_nm: Vec<f64>,
}

impl<'de> Deserialize<'de> for ModelUncertainty {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let stored = StoredUncertainty::deserialize(deserializer)?;
        let StoredUncertainty { mut covariance_factor, mut sensitivity, .. } = stored;
        let (size, nuisance_parameters) = (stored.mean.len(), stored.deviations.len());
        if stored.covariance.has_shape(size, |row| row + 1) && size > 0 {
            covariance_factor = ScaledRows::factor_of(&stored.covariance.symmetric_part(0..size));
        }
        let rows = stored.influence.len();
        if stored.influence.has_shape(rows, |_| nuisance_parameters) && rows > 0 {
            sensitivity =
                ScaledRows::from_matrix(&stored.influence.matrix(rows, nuisance_parameters));
        }
        let StoredUncertainty { observed, deviations, mean, noise_nm, .. } = stored;
        Ok(Self { observed, deviations, mean, covariance_factor, sensitivity, noise_nm })
    }
}

/// A [`ModelUncertainty`] in the layout of schema 1.
#[derive(Debug, Serialize)]
pub struct ModelUncertaintySchema1 {
    observed: Observed,
    deviations: Vec<f64>,
    mean: Vec<f64>,
    covariance: MatrixRows<f32>,
    influence: MatrixRows<f32>,
    noise_nm: Vec<f64>,
}

/// Error on a recording, predicted by the result before the recording is used. The prediction uses
/// the motion, and of the measured torque only its size. The actual error is as often larger as
/// smaller.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PredictedError {
    /// Over all joints, relative to the measured torque.
    pub relative_error: f64,
    /// One entry per joint.
    pub relative_error_per_joint: Vec<f64>,
}

impl ModelUncertainty {
    /// `sensitivity` is K.
    pub(super) fn new(
        columns: &NuisanceColumns<'_>,
        noise_nm: Vec<f64>,
        solution: &JointSolution,
        sensitivity: &DMatrix<f64>,
    ) -> Self {
        Self {
            observed: columns.observed().clone(),
            deviations: columns.deviations().into_iter().map(rounded).collect(),
            mean: solution
                .parameter_change
                .iter()
                .chain(&solution.nuisance_parameters)
                .map(|value| rounded(*value))
                .collect(),
            covariance_factor: ScaledRows::factor_of(&solution.covariance),
            sensitivity: ScaledRows::from_matrix(sensitivity),
            noise_nm,
        }
    }

    /// Returns the standard deviations of the differences from an earlier result of the same arm,
    /// due to model errors \[in the unit of each\]. Both results have the same errors, which cancel
    /// as far as the motions are alike. Returns `None` if either result lacks this information.
    ///
    /// A unit of each nuisance parameter moves the parameters by K and K₀. The earlier result knows
    /// mean μ and covariance P of the nuisance parameters: `(K − K₀)(μμᵀ + P)(K − K₀)ᵀ`. If the
    /// motions differ so much that their nuisance parameters are not the same, nothing cancels.
    /// Each result then counts separately.
    pub fn difference_deviations(&self, earlier: &Self) -> Option<Vec<f64>> {
        let (now, then) = (self.sensitivity()?, earlier.sensitivity()?);
        if now.nrows() != then.nrows() {
            return None;
        }
        let alike = now.ncols() == then.ncols() && self.observed.is_like(&earlier.observed);
        if !alike {
            let [now, then] =
                [(self, now), (earlier, then)].map(|(of, shifted)| of.shift_variances(&shifted));
            return Some(now.iter().zip(then).map(|(now, then)| (now + then).sqrt()).collect());
        }
        // In units of the earlier result. A nuisance parameter without size has no effect.
        let unit = |k: usize| match self.deviations[k] {
            0.0 => 0.0,
            deviation => earlier.deviations[k] / deviation,
        };
        let difference = DMatrix::from_fn(now.nrows(), now.ncols(), |row, k| {
            now[(row, k)] * unit(k) - then[(row, k)]
        });
        Some(earlier.shift_variances(&difference).into_iter().map(f64::sqrt).collect())
    }

    /// Returns the uncertainty for versions that read schema 1 only.
    pub fn to_schema_1(&self) -> ModelUncertaintySchema1 {
        let factor = self.covariance_factor.matrix(self.mean.len());
        let covariance = MatrixRows::lower_triangle(&(&factor * factor.transpose()));
        let sensitivity = MatrixRows::from_matrix(&self.sensitivity.matrix(self.deviations.len()));
        ModelUncertaintySchema1 {
            observed: self.observed.clone(),
            deviations: self.deviations.clone(),
            mean: self.mean.clone(),
            covariance: covariance.to_single(),
            influence: sensitivity.to_single(),
            noise_nm: self.noise_nm.clone(),
        }
    }

    /// Returns K, if every matrix has the matching shape.
    fn sensitivity(&self) -> Option<DMatrix<f64>> {
        let (own, nuisance_parameters) = (self.sensitivity.len(), self.deviations.len());
        let width = own + nuisance_parameters;
        let is_whole = own > 0
            && self.mean.len() == width
            && self.sensitivity.has_shape(own, |_| nuisance_parameters)
            && self.covariance_factor.has_shape(width, |row| row + 1);
        is_whole.then(|| self.sensitivity.matrix(nuisance_parameters))
    }

    /// Returns the covariance of the nuisance parameters, of which there are `count` (m × m).
    fn posterior(&self, count: usize) -> DMatrix<f64> {
        let factor = self.covariance_factor.matrix(self.mean.len());
        let own = factor.rows(self.mean.len() - count, count);
        own * own.transpose()
    }

    /// Returns the diagonal of `M (μμᵀ + P) Mᵀ`, where M maps the nuisance parameters to shifts.
    fn shift_variances(&self, shifted: &DMatrix<f64>) -> Vec<f64> {
        let width = self.mean.len() - shifted.ncols();
        let mean = shifted * DVector::from_column_slice(&self.mean[width..]);
        let posterior = shifted * self.posterior(shifted.ncols());
        let variance = |k: usize| mean[k].powi(2) + posterior.row(k).dot(&shifted.row(k));
        (0..shifted.nrows()).map(|k| variance(k).max(0.0)).collect()
    }

    /// Returns the columns of the nuisance parameters along a record, each scaled by its prior
    /// standard deviation. Returns `None` if the context has other nuisance parameters.
    fn columns<'a>(
        &self,
        context: &'a Context<'a>,
        observations: &Observations,
        parameters: &'a DVector<f64>,
    ) -> Option<NuisanceColumns<'a>> {
        let width = parameters.len() + self.deviations.len();
        let fits = self.mean.len() == width
            && self.covariance_factor.has_shape(width, |row| row + 1)
            && self.noise_nm.len() == observations.joints()
            && self.observed.belongs_to(context);
        let columns =
            fits.then(|| NuisanceColumns::new(context, parameters, self.observed.clone()))?;
        columns.with_deviations(&self.deviations)
    }

    /// Returns the effect of model errors on the predicted torques of a record. The columns belong
    /// to independent unknowns of standard deviation 1 (r × m). With C the columns of the nuisance
    /// parameters along the record,
    ///
    /// ```text
    /// y − X β̂ = X δβ + (C − X K) η,   η ~ (0, μμᵀ + P)
    /// ```
    ///
    /// The errors cancel as far as the motion is like that of the result. `parameters` are those of
    /// the moving arm, which may have a payload. Returns `None` if the context has other nuisance
    /// parameters, or the result lacks this information.
    pub(crate) fn errors_along(
        &self,
        context: &Context<'_>,
        motion: &Motion,
        auxiliary: &AuxiliaryObservation,
        observations: &Observations,
        parameters: &DVector<f64>,
    ) -> Result<Option<DMatrix<f64>>, IdentificationError> {
        let Some(shifted) = self.sensitivity() else { return Ok(None) };
        let columns = self.columns(context, observations, parameters);
        let Some(columns) = columns.filter(|_| shifted.nrows() == parameters.len()) else {
            return Ok(None);
        };
        let rates = torque_rates(context, motion, parameters)?;
        let along = NuisanceObservation::new(&columns, motion, auxiliary, observations, rates)?
            .dense_columns();
        let mean = DVector::from_column_slice(&self.mean[shifted.nrows()..]);
        let posterior = self.posterior(shifted.ncols());
        // Rounding may move a small eigenvalue below 0.
        let eigen = (posterior + &mean * mean.transpose()).symmetric_eigen();
        let deviations = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
        let root = eigen.eigenvectors * DMatrix::from_diagonal(&deviations);
        let errors = (along - observations.matrix().dense() * shifted) * root;
        // A file may contain any values.
        Ok(errors.iter().all(|value| value.is_finite()).then_some(errors))
    }

    /// Returns the predicted error of these parameters along a motion. Returns `None` if the
    /// context has other nuisance parameters, or if the error is not finite.
    pub(crate) fn expected_error(
        &self,
        context: &Context<'_>,
        motion: &Motion,
        auxiliary: &AuxiliaryObservation,
        observations: &Observations,
        parameters: &DVector<f64>,
    ) -> Result<Option<PredictedError>, IdentificationError> {
        let (own, all) = (parameters.len(), parameters.len() + self.deviations.len());
        let Some(columns) = self.columns(context, observations, parameters) else {
            return Ok(None);
        };
        let rates = torque_rates(context, motion, parameters)?;
        let along = NuisanceObservation::new(&columns, motion, auxiliary, observations, rates)?;
        let solution = JointSolution {
            parameter_change: DVector::from_column_slice(&self.mean[..own]),
            nuisance_parameters: DVector::from_column_slice(&self.mean[own..]),
            covariance: self.posterior(all),
            noise: DMatrix::zeros(0, 0),
            colour_factor: 1.0,
        };
        let measured = observations.measured_values();
        let (mut total, mut sums) = (DMatrix::zeros(all, all), [0.0; 2]);
        let mut relative_error_per_joint = Vec::new();
        for joint in 0..observations.joints() {
            let rows = observations.joint_rows(joint);
            let of_joint = gram_matrix(observations.matrix(), &along, joint);
            let noise = rows.len() as f64 * self.noise_nm[joint].powi(2);
            let torque = measured.rows_range(rows).norm_squared();
            let error = solution.median_squared_error(&of_joint) + noise;
            relative_error_per_joint.push((error / torque).sqrt());
            total += of_joint;
            sums = [sums[0] + noise, sums[1] + torque];
        }
        let error = solution.median_squared_error(&total) + sums[0];
        let relative_error = (error / sums[1]).sqrt();
        let predicted = PredictedError { relative_error, relative_error_per_joint };
        // A file may contain any values.
        Ok(relative_error.is_finite().then_some(predicted))
    }
}

/// Rounds to seven significant digits. The covariance has five.
fn rounded(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rounded_value_has_seven_digits() {
        for (value, expected) in
            [(-1.234_567_89e-7, -1.234_568e-7), (0.0, 0.0), (f64::INFINITY, f64::INFINITY)]
        {
            assert!(rounded(value).total_cmp(&expected).is_eq(), "{value}");
        }
    }

    /// Returns a result with one parameter, which a unit of each nuisance parameter moves by `k`.
    /// Each nuisance parameter is known as 2 ± 2.
    fn result(k: f64, deviation: f64, nuisance_parameters: usize) -> ModelUncertainty {
        let width = 1 + nuisance_parameters;
        let sensitivity = DMatrix::from_element(1, nuisance_parameters, k);
        let covariance = DMatrix::from_diagonal_element(width, width, 4.0);
        ModelUncertainty {
            observed: Observed::default(),
            deviations: vec![deviation; nuisance_parameters],
            mean: vec![2.0; 1 + nuisance_parameters],
            covariance_factor: ScaledRows::factor_of(&covariance),
            sensitivity: ScaledRows::from_matrix(&sensitivity),
            noise_nm: Vec::new(),
        }
    }

    #[test]
    fn errors_of_the_model_cancel_as_far_as_two_results_have_the_same() {
        let close = |found: Option<Vec<f64>>, expected: f64| {
            assert!((found.unwrap()[0] - expected).abs() < 1e-6, "{expected}");
        };
        let earlier = result(1.0, 1.0, 1);
        close(result(1.0, 1.0, 1).difference_deviations(&earlier), 0.0);
        // (3 − 1)² (2² + 4), and with a unit twice as large (3/2 − 1)² (2² + 4).
        close(result(3.0, 1.0, 1).difference_deviations(&earlier), 32_f64.sqrt());
        close(result(3.0, 2.0, 1).difference_deviations(&earlier), 2_f64.sqrt());
        // Different nuisance parameters: nothing cancels. One result contributes 8, the other (2 +
        // 2)² + 4 + 4.
        close(result(1.0, 1.0, 2).difference_deviations(&earlier), 32_f64.sqrt());
        let silent = ModelUncertainty { sensitivity: ScaledRows::default(), ..earlier.clone() };
        assert_eq!(silent.difference_deviations(&earlier), None);
        assert_eq!(earlier.difference_deviations(&silent), None);
    }

    #[test]
    fn an_uncertainty_of_schema_1_is_read() {
        let common = "observed = { torque_nm = [], highest_speed = [], left_out_shares = [] }
            deviations = [1.0]
            mean = [2.0, 2.0]
            noise_nm = []\n";
        let rows = "covariance = ['4e0', '0e0 4e0']\ninfluence = ['3e0']";
        let mut expected = result(3.0, 1.0, 1);
        let read: ModelUncertainty = toml::from_str(&(common.to_owned() + rows)).unwrap();
        expected.observed = read.observed.clone();
        assert_eq!(read, expected);
        // And written again.
        let again = toml::to_string(&read.to_schema_1()).unwrap();
        assert_eq!(toml::from_str::<ModelUncertainty>(&again).unwrap(), read);
        let silent: ModelUncertainty = toml::from_str(common).unwrap();
        assert_eq!(silent.difference_deviations(&expected), None);
        // A negative variance has no factor.
        let negative = "covariance = ['4e0', '0e0 -4e0']\ninfluence = ['3e0']";
        let negative: ModelUncertainty = toml::from_str(&(common.to_owned() + negative)).unwrap();
        assert_eq!(negative.difference_deviations(&expected), None);
    }
}
