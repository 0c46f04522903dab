//! Least squares by Householder QR (Golub & Van Loan, *Matrix Computations*, section 5.3).

use didim_dynamics::robot::JointIndex;
use nalgebra::{DMatrix, DVector};

use super::error::RegressionError;
use super::observations::Observations;
use super::products::matrix_product;
use super::triangles::TriangularFactor;

/// Parameters with their covariance, and the singular values of the solved matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Parameters θ (b).
    pub parameters: DVector<f64>,
    /// Covariance of θ (b × b). The function that created the solution states which one.
    pub covariance: DMatrix<f64>,
    /// Singular values of the solved matrix, X or Ω^{-1/2} X, largest first. They depend on the
    /// units of the parameters.
    pub singular_values: Vec<f64>,
    /// Residuals `y − X θ` (r), unweighted.
    pub residuals: DVector<f64>,
    /// Noise level σ_j that divides the rows of each joint; 1 without weighting.
    pub noise_levels: Vec<f64>,
    /// Inverse R⁻¹ (b × b) of the triangular factor of the solved matrix Q R. The solved matrix
    /// times R⁻¹ has orthonormal columns.
    pub(super) r_inverse: DMatrix<f64>,
}

impl Solution {
    /// Returns the ratio of the largest to the smallest singular value of the solved matrix.
    pub fn condition_number(&self) -> f64 {
        let (max, min) = self.extreme_singular_values();
        max / min
    }

    /// Returns the largest and the smallest singular value.
    pub fn extreme_singular_values(&self) -> (f64, f64) {
        let max = self.singular_values.first().copied().unwrap_or(f64::NAN);
        (max, self.singular_values.last().copied().unwrap_or(f64::NAN))
    }

    /// Returns the standard deviations of the parameters, the roots of the covariance's diagonal
    /// (b).
    pub fn standard_deviations(&self) -> DVector<f64> {
        self.covariance.diagonal().map(f64::sqrt)
    }
}

impl Observations {
    /// Solves by ordinary least squares (equation 9). The covariance is the sandwich `(XᵀX)⁻¹ XᵀΩX
    /// (XᵀX)⁻¹`, with Ω from the [`noise_levels`](Self::noise_levels) of the residuals. It is also
    /// valid if the joints have different noise levels. The singular values are those of X.
    ///
    /// # Errors
    /// [`ZeroColumns`](RegressionError::ZeroColumns),
    /// [`DependentColumns`](RegressionError::DependentColumns),
    /// [`OutOfRange`](RegressionError::OutOfRange).
    pub fn solve_ordinary(&self) -> Result<Solution, RegressionError> {
        from_ordinary(self)
    }

    /// Solves by weighted least squares with one noise level σ_j per joint: each joint's rows are
    /// divided by its level. The covariance is `(XᵀΩ⁻¹X)⁻¹` (equation 10). The singular values are
    /// those of `Ω^{-1/2} X`.
    ///
    /// # Errors
    /// Those of [`solve_ordinary`](Self::solve_ordinary), and
    /// [`NoiseLevel`](RegressionError::NoiseLevel).
    pub fn solve_weighted(&self, noise_levels: &[f64]) -> Result<Solution, RegressionError> {
        from_weighted(self, noise_levels)
    }
}

/// Solves equation 9 with the sandwich covariance.
fn from_ordinary(system: &Observations) -> Result<Solution, RegressionError> {
    let triangles = system.joint_triangles();
    let even = vec![1.0; system.joints()];
    let factor = triangles.factor(system.matrix().nrows(), &even)?;
    let residuals = system.residuals(&factor.parameters);
    // (XᵀX)⁻¹ XᵀΩX (XᵀX)⁻¹ = R⁻¹ (ZᵀZ) R⁻ᵀ with Z = Ω^{1/2} X R⁻¹, or Ω^{1/2} of the triangles.
    let z = triangles.scaled(&system.noise_levels(&residuals));
    let z = matrix_product(&z.columns(0, factor.r_inverse.nrows()).into_owned(), &factor.r_inverse);
    let half = matrix_product(&factor.r_inverse, &z.transpose());
    finish(factor, &half, residuals, even)
}

/// Solves equations 10 to 12.
fn from_weighted(system: &Observations, noise_levels: &[f64]) -> Result<Solution, RegressionError> {
    let (rows, columns) = system.matrix().shape();
    if noise_levels.len() != system.joints() {
        let (measurements, joints) = (rows, noise_levels.len());
        return Err(RegressionError::Shape { rows, columns, measurements, joints });
    }
    for (joint, &level) in noise_levels.iter().enumerate() {
        if !(level.is_finite() && level > 0.0) {
            return Err(RegressionError::NoiseLevel { joint: JointIndex::new(joint), level });
        }
    }
    let weights: Vec<f64> = noise_levels.iter().map(|level| 1.0 / level).collect();
    let factor = system.joint_triangles().factor(rows, &weights)?;
    let residuals = system.residuals(&factor.parameters);
    // (XᵀΩ⁻¹X)⁻¹ = R⁻¹ R⁻ᵀ
    let half = factor.r_inverse.clone();
    finish(factor, &half, residuals, noise_levels.to_vec())
}

/// Creates the solution with `covariance = half halfᵀ`, symmetric by construction.
fn finish(
    factor: TriangularFactor,
    half: &DMatrix<f64>,
    residuals: DVector<f64>,
    noise_levels: Vec<f64>,
) -> Result<Solution, RegressionError> {
    let covariance = matrix_product(half, &half.transpose());
    let finite = factor.parameters.iter().chain(covariance.iter()).all(|x| x.is_finite());
    if !finite || !residuals.norm_squared().is_finite() {
        return Err(RegressionError::OutOfRange);
    }
    Ok(Solution {
        parameters: factor.parameters,
        covariance,
        singular_values: factor.singular_values,
        residuals,
        noise_levels,
        r_inverse: factor.r_inverse,
    })
}
