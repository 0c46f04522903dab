//! Least squares by Householder QR (Golub & Van Loan, *Matrix Computations*, section 5.3).

use nalgebra::{DMatrix, DVector};

use super::error::RegressionError;
use super::observations::Observations;
use super::products::product;
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
    let triangles = system.triangles();
    let even = vec![1.0; system.joints()];
    let factor = triangles.factor(system, &even)?;
    let residuals = system.residuals(&factor.parameters);
    // (XᵀX)⁻¹ XᵀΩX (XᵀX)⁻¹ = R⁻¹ (ZᵀZ) R⁻ᵀ with Z = Ω^{1/2} X R⁻¹, or Ω^{1/2} of the triangles.
    let z = triangles.scaled(&system.noise_levels(&residuals));
    let z = product(&z.columns(0, factor.r_inverse.nrows()).into_owned(), &factor.r_inverse);
    let half = product(&factor.r_inverse, &z.transpose());
    finish(factor, &half, residuals, even)
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
    for (joint, &level) in noise_levels.iter().enumerate() {
        if !(level.is_finite() && level > 0.0) {
            return Err(RegressionError::NoiseLevel { joint, level });
        }
    }
    let weights: Vec<f64> = noise_levels.iter().map(|level| 1.0 / level).collect();
    let factor = system.triangles().factor(system, &weights)?;
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
    let covariance = product(half, &half.transpose());
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

/// The rows of each joint in X and y, `[X_j y_j] = Q_j T_j`, by T_j alone: all that weights of joints
/// leave of an equation (Golub & Van Loan, section 5.1.9 on factoring rows in blocks).
#[derive(Clone, Debug)]
pub(super) struct Triangles(Vec<DMatrix<f64>>);

impl Triangles {
    pub(super) fn of(system: &Observations) -> Self {
        let (columns, rows) = (system.matrix().ncols(), system.rows_per_joint());
        let triangle = |joint| {
            let range = system.joint_rows(joint);
            let x = system.matrix().rows_range(range.clone());
            // A joint feels what hangs on it: the other columns are 0.
            let felt: Vec<usize> = (0..columns)
                .filter(|&column| x.column(column).iter().any(|value| *value != 0.0))
                .collect();
            let mut block = DMatrix::zeros(rows, felt.len() + 1);
            for (mut to, &from) in block.column_iter_mut().zip(&felt) {
                to.copy_from(&x.column(from));
            }
            block.set_column(felt.len(), &system.measurements().rows_range(range));
            let compact = block.qr().unpack_r();
            let mut triangle = DMatrix::zeros(compact.nrows(), columns + 1);
            for (from, &to) in compact.column_iter().zip(felt.iter().chain([&columns])) {
                triangle.set_column(to, &from);
            }
            triangle
        };
        Self((0..system.joints()).map(triangle).collect())
    }

    /// One below the other, each times a factor: `[X y]` of fewer rows.
    fn scaled(&self, factors: &[f64]) -> DMatrix<f64> {
        let rows: usize = self.0.iter().map(DMatrix::nrows).sum();
        let columns = self.0.first().map_or(0, DMatrix::ncols);
        let mut stacked = DMatrix::zeros(rows.max(columns), columns);
        let mut first = 0;
        for (triangle, factor) in self.0.iter().zip(factors) {
            let mut part = stacked.rows_mut(first, triangle.nrows());
            part.copy_from(triangle);
            part *= *factor;
            first += triangle.nrows();
        }
        stacked
    }

    fn factor(&self, system: &Observations, weights: &[f64]) -> Result<Factor, RegressionError> {
        let (rows, columns) = system.matrix().shape();
        let triangle = self.scaled(weights).qr().unpack_r();
        let (r, rhs) = (triangle.view((0, 0), (columns, columns)), triangle.column(columns));
        let (r, rhs) = (r.into_owned(), rhs.rows(0, columns));
        let r_inverse = r.solve_upper_triangular(&DMatrix::identity(columns, columns));
        rank::check(&r, r_inverse.as_ref(), rows)?;
        let singular_values = rank::singular_values(&r)?;
        match (r.solve_upper_triangular(&rhs), r_inverse) {
            (Some(parameters), Some(r_inverse)) => {
                Ok(Factor { parameters, r_inverse, singular_values })
            }
            _ => Err(RegressionError::OutOfRange),
        }
    }
}

/// What the QR decomposition of a tall matrix of full rank gives.
struct Factor {
    parameters: DVector<f64>,
    r_inverse: DMatrix<f64>,
    singular_values: Vec<f64>,
}
