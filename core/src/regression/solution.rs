//! Least squares by Householder QR (Golub & Van Loan, *Matrix Computations*, section 5.3).

use nalgebra::{DMatrix, DVector};

use super::error::RegressionError;
use super::observations::Observations;
use super::rank;

/// Parameters with their covariance, and how well the matrix determined them.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// θ (b).
    pub parameters: DVector<f64>,
    /// Covariance of θ (b × b); which one, says the function that made this.
    pub covariance: DMatrix<f64>,
    /// Singular values of the matrix that was solved, X or Ω^{-1/2} X, largest first. They depend
    /// on the units of the parameters.
    pub singular_values: Vec<f64>,
    /// `y − X θ` (r), unweighted.
    pub residuals: DVector<f64>,
    /// The noise level σ_j that the rows of each joint were divided by; 1 where they were not.
    pub noise_levels: Vec<f64>,
    /// R⁻¹ (b × b) of the matrix that was solved, Q R: times it, that matrix has orthonormal columns.
    pub(super) r_inverse: DMatrix<f64>,
}

impl Solution {
    /// Largest over smallest singular value of the matrix that was solved.
    pub fn condition_number(&self) -> f64 {
        let (max, min) = self.extreme_singular_values();
        max / min
    }

    /// Largest and smallest singular value.
    pub fn extreme_singular_values(&self) -> (f64, f64) {
        let max = self.singular_values.first().copied().unwrap_or(f64::NAN);
        (max, self.singular_values.last().copied().unwrap_or(f64::NAN))
    }

    /// Standard deviations of the parameters, the roots of the covariance's diagonal (b).
    pub fn standard_deviations(&self) -> DVector<f64> {
        self.covariance.diagonal().map(f64::sqrt)
    }
}

/// Equation 9 with the sandwich covariance.
pub(super) fn ordinary(system: &Observations) -> Result<Solution, RegressionError> {
    let factor = Factor::new(system.matrix().clone(), system.measurements().clone())?;
    let residuals = system.residuals(&factor.parameters);
    // (XᵀX)⁻¹ XᵀΩX (XᵀX)⁻¹ = R⁻¹ (ZᵀZ) R⁻ᵀ with Z = Ω^{1/2} X R⁻¹ = Ω^{1/2} Q.
    let mut z = system.matrix() * &factor.r_inverse;
    for (joint, level) in system.noise_levels(&residuals).into_iter().enumerate() {
        z.rows_range_mut(system.joint_rows(joint)).scale_mut(level);
    }
    let half = &factor.r_inverse * z.transpose();
    finish(factor, &half, residuals, vec![1.0; system.joints()])
}

/// Equations 10 to 12.
pub(super) fn weighted(
    system: &Observations,
    noise_levels: &[f64],
) -> Result<Solution, RegressionError> {
    let (rows, columns) = system.matrix().shape();
    if noise_levels.len() != system.joints() {
        let (measurements, joints) = (rows, noise_levels.len());
        return Err(RegressionError::Shape { rows, columns, measurements, joints });
    }
    let (mut matrix, mut measurements) = (system.matrix().clone(), system.measurements().clone());
    for (joint, &level) in noise_levels.iter().enumerate() {
        if !(level.is_finite() && level > 0.0) {
            return Err(RegressionError::NoiseLevel { joint, level });
        }
        let range = system.joint_rows(joint);
        matrix.rows_range_mut(range.clone()).unscale_mut(level);
        measurements.rows_range_mut(range).unscale_mut(level);
    }
    let factor = Factor::new(matrix, measurements)?;
    let residuals = system.residuals(&factor.parameters);
    // (XᵀΩ⁻¹X)⁻¹ = R⁻¹ R⁻ᵀ
    let half = factor.r_inverse.clone();
    finish(factor, &half, residuals, noise_levels.to_vec())
}

/// `covariance = half halfᵀ`, symmetric by construction.
fn finish(
    factor: Factor,
    half: &DMatrix<f64>,
    residuals: DVector<f64>,
    noise_levels: Vec<f64>,
) -> Result<Solution, RegressionError> {
    let covariance = half * half.transpose();
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

/// What the QR decomposition of a tall matrix of full rank gives.
struct Factor {
    parameters: DVector<f64>,
    r_inverse: DMatrix<f64>,
    singular_values: Vec<f64>,
}

impl Factor {
    /// `matrix` is r × b with r > b. Q stays in its factored form: only Qᵀy and R are formed.
    fn new(matrix: DMatrix<f64>, mut rhs: DVector<f64>) -> Result<Self, RegressionError> {
        let (rows, columns) = matrix.shape();
        let qr = matrix.qr();
        qr.q_tr_mul(&mut rhs);
        let r = qr.unpack_r();
        rank::check(&r, rows)?;
        let singular_values = rank::singular_values(&r)?;
        let parameters = r.solve_upper_triangular(&rhs.rows(0, columns));
        let r_inverse = r.solve_upper_triangular(&DMatrix::identity(columns, columns));
        match (parameters, r_inverse) {
            (Some(parameters), Some(r_inverse)) => {
                Ok(Self { parameters, r_inverse, singular_values })
            }
            _ => Err(RegressionError::OutOfRange),
        }
    }
}
