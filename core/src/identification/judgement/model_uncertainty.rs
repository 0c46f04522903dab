//! What a result has to keep of the model's errors: to foretell its error on another motion, and to tell them from a change of
//! the arm.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::freedoms::{Along, Columns, Observed};
use super::rows::Rows;
use crate::identification::given::{Context, IdentificationError};
use crate::identification::observation::{BesideObservation, Motion};
use crate::regression::{JointSolution, Observations, gram};

/// What the data say of the parameters and of all that the model takes for known, together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelUncertainty {
    pub(super) observed: Observed,
    /// Standard deviation of each freedom beforehand, which is its unit in mean and covariance (m).
    pub(super) deviations: Vec<f64>,
    /// How the parameters would change with the freedoms, and these (b + m).
    pub(super) mean: Vec<f64>,
    /// Their covariance, the rows of its lower triangle. Sizes: single precision is plenty.
    pub(super) covariance: Rows<f32>,
    /// K: how far a unit of each freedom moves each parameter (b × m). Nothing in results of versions that did not
    /// keep it.
    #[serde(default)]
    pub(super) influence: Rows<f32>,
    /// Root mean square of what is left of each joint's torque with the freedoms \[N·m or N\].
    pub(super) noise_nm: Vec<f64>,
}

/// The error on a recording, as the result expected it before that was looked at: by the motion, with nothing of
/// the measured torque but its size. It is as often larger as smaller.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Foretold {
    /// Over all joints, relative to the measured torque.
    pub relative_error: f64,
    /// Of every joint.
    pub relative_error_per_joint: Vec<f64>,
}

impl ModelUncertainty {
    /// `influence` is K.
    pub(super) fn new(
        columns: &Columns<'_>,
        noise_nm: Vec<f64>,
        solution: &JointSolution,
        influence: &DMatrix<f64>,
    ) -> Self {
        let covariance = Rows::<f32>::of(&solution.covariance, |k| k + 1);
        let influence = Rows::<f32>::of(influence, |_| influence.ncols());
        Self {
            observed: columns.observed().clone(),
            deviations: columns.deviations(),
            mean: solution.change.iter().chain(&solution.freedoms).copied().collect(),
            covariance,
            influence,
            noise_nm,
        }
    }

    /// What errors of the model make of the differences between these parameters and those of an earlier result of the same
    /// arm: their standard deviations \[in the unit of each\]. Both results have the same errors, which cancel as far as the
    /// motions are alike. None where either does not say.
    ///
    /// A unit of each freedom moves the parameters by K and K₀, and the earlier result knows mean μ and covariance P of
    /// the freedoms: `(K − K₀)(μμᵀ + P)(K − K₀)ᵀ`. Where the motions are so different that their freedoms are not the
    /// same, nothing cancels, and each result counts by itself.
    pub fn difference_deviations(&self, earlier: &Self) -> Option<Vec<f64>> {
        let (now, then) = (self.moved()?, earlier.moved()?);
        if now.nrows() != then.nrows() {
            return None;
        }
        let alike = now.ncols() == then.ncols() && self.observed.is_like(&earlier.observed);
        if !alike {
            let [now, then] =
                [(self, now), (earlier, then)].map(|(of, moved)| of.variances(&moved));
            return Some(now.iter().zip(then).map(|(now, then)| (now + then).sqrt()).collect());
        }
        // In units of the earlier one. What has no size does nothing.
        let unit = |k: usize| match self.deviations[k] {
            0.0 => 0.0,
            deviation => earlier.deviations[k] / deviation,
        };
        let apart = DMatrix::from_fn(now.nrows(), now.ncols(), |row, k| {
            now[(row, k)] * unit(k) - then[(row, k)]
        });
        Some(earlier.variances(&apart).into_iter().map(f64::sqrt).collect())
    }

    /// K, where all is there that goes with it.
    fn moved(&self) -> Option<DMatrix<f64>> {
        let (own, freedoms) = (self.influence.len(), self.deviations.len());
        let all = own + freedoms;
        let is_whole = own > 0
            && self.mean.len() == all
            && self.influence.has_shape(own, |_| freedoms)
            && self.covariance.has_shape(all, |row| row + 1);
        is_whole.then(|| DMatrix::from_fn(own, freedoms, |row, k| self.influence.at(row, k)))
    }

    /// `M (μμᵀ + P) Mᵀ` on the diagonal, for rows M that move by the freedoms.
    fn variances(&self, moved: &DMatrix<f64>) -> Vec<f64> {
        let own = self.mean.len() - moved.ncols();
        let told = moved * DVector::from_column_slice(&self.mean[own..]);
        let open = moved * self.covariance.symmetric(own..self.mean.len());
        let variance = |k: usize| told[k].powi(2) + open.row(k).dot(&moved.row(k));
        (0..moved.nrows()).map(|k| variance(k).max(0.0)).collect()
    }

    /// The freedoms along a record, each in its standard deviation beforehand; none where the freedoms of
    /// the context are others.
    fn columns<'a>(
        &self,
        context: &'a Context<'a>,
        observations: &Observations,
        parameters: &'a DVector<f64>,
    ) -> Option<Columns<'a>> {
        let all = parameters.len() + self.deviations.len();
        let fits = self.mean.len() == all
            && self.covariance.has_shape(all, |row| row + 1)
            && self.noise_nm.len() == observations.joints()
            && self.observed.fits(context);
        let columns = fits.then(|| Columns::new(context, parameters, self.observed.clone()))?;
        columns.with_deviations(&self.deviations)
    }

    /// What errors of the model make of the torques of a record that the result predicts, as columns of independent
    /// unknowns of standard deviation 1 (r × m): with C the freedoms' columns along it,
    ///
    /// ```text
    /// y − X β̂ = X δβ + (C − X K) η,   η ~ (0, μμᵀ + P)
    /// ```
    ///
    /// so that they cancel as far as the motion is alike to that of the result. `parameters` are those of what moves, which may carry a
    /// load. None where the freedoms of the context are others, or the result does not say.
    pub(crate) fn errors_along(
        &self,
        context: &Context<'_>,
        motion: &Motion,
        beside: &BesideObservation,
        observations: &Observations,
        parameters: &DVector<f64>,
    ) -> Result<Option<DMatrix<f64>>, IdentificationError> {
        let Some(moved) = self.moved() else { return Ok(None) };
        let columns = self.columns(context, observations, parameters);
        let Some(columns) = columns.filter(|_| moved.nrows() == parameters.len()) else {
            return Ok(None);
        };
        let along = Along::new(&columns, motion, beside, observations)?.dense();
        let mean = DVector::from_column_slice(&self.mean[moved.nrows()..]);
        let open = self.covariance.symmetric(moved.nrows()..self.mean.len());
        // Single precision may take a small eigenvalue below 0.
        let eigen = (open + &mean * mean.transpose()).symmetric_eigen();
        let deviations = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
        let root = eigen.eigenvectors * DMatrix::from_diagonal(&deviations);
        let errors = (along - observations.matrix().dense() * moved) * root;
        // What stands in a file may be anything.
        Ok(errors.iter().all(|value| value.is_finite()).then_some(errors))
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
        let (own, all) = (parameters.len(), parameters.len() + self.deviations.len());
        let Some(columns) = self.columns(context, observations, parameters) else {
            return Ok(None);
        };
        let along = Along::new(&columns, motion, beside, observations)?;
        let solution = JointSolution {
            change: DVector::from_column_slice(&self.mean[..own]),
            freedoms: DVector::from_column_slice(&self.mean[own..]),
            covariance: self.covariance.symmetric(0..all),
            noise: DMatrix::zeros(0, 0),
            colour: 1.0,
        };
        let measured = observations.measured();
        let (mut total, mut sums) = (DMatrix::zeros(all, all), [0.0; 2]);
        let mut relative_error_per_joint = Vec::new();
        for joint in 0..observations.joints() {
            let rows = observations.joint_rows(joint);
            let of_joint = gram(observations.matrix(), &along, joint);
            let noise = rows.len() as f64 * self.noise_nm[joint].powi(2);
            let torque = measured.rows_range(rows).norm_squared();
            let error = solution.median_squared_error(&of_joint) + noise;
            relative_error_per_joint.push((error / torque).sqrt());
            total += of_joint;
            sums = [sums[0] + noise, sums[1] + torque];
        }
        let error = solution.median_squared_error(&total) + sums[0];
        let relative_error = (error / sums[1]).sqrt();
        let foretold = Foretold { relative_error, relative_error_per_joint };
        // What stands in a file may be anything.
        Ok(relative_error.is_finite().then_some(foretold))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One parameter that a unit of one freedom, or of more, moves by k; of each it knows 2 ± 2.
    fn result(k: f32, deviation: f64, freedoms: usize) -> ModelUncertainty {
        let row = |row: usize| (0..=row).map(|j| if j == row { 4.0 } else { 0.0 }).collect();
        ModelUncertainty {
            observed: Observed::default(),
            deviations: vec![deviation; freedoms],
            mean: vec![2.0; 1 + freedoms],
            covariance: Rows::from((0..=freedoms).map(row).collect::<Vec<_>>()),
            influence: Rows::from(vec![vec![k; freedoms]]),
            noise_nm: Vec::new(),
        }
    }

    #[test]
    fn errors_of_the_model_cancel_as_far_as_two_results_have_the_same() {
        let close = |found: Option<Vec<f64>>, expected: f64| {
            assert!((found.unwrap()[0] - expected).abs() < 1e-12, "{expected}");
        };
        let earlier = result(1.0, 1.0, 1);
        close(result(1.0, 1.0, 1).difference_deviations(&earlier), 0.0);
        // (3 − 1)² (2² + 4), and with a unit twice as large (3/2 − 1)² (2² + 4).
        close(result(3.0, 1.0, 1).difference_deviations(&earlier), 32_f64.sqrt());
        close(result(3.0, 2.0, 1).difference_deviations(&earlier), 2_f64.sqrt());
        // Other freedoms: nothing cancels. 8 of the one, and (2 + 2)² + 4 + 4 of the other.
        close(result(1.0, 1.0, 2).difference_deviations(&earlier), 32_f64.sqrt());
        let silent = ModelUncertainty { influence: Rows::default(), ..earlier.clone() };
        assert_eq!(silent.difference_deviations(&earlier), None);
        assert_eq!(earlier.difference_deviations(&silent), None);
    }
}
