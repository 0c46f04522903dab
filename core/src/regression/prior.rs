//! What the data say of freedoms that the model does not have, where something is known of them
//! beforehand.

use nalgebra::{Cholesky, DMatrix, DMatrixView, DVector};

use super::analysis::ResidualAnalysis;
use super::error::RegressionError;
use super::products::{product, symmetric_product};
use super::spectrum::ResidualSpectrum;

/// The noise is that of the residuals first, and then of what the freedoms leave of them.
const PASSES: usize = 2;

/// Of the independent rows, the share that must be left over by all that is fitted: with fewer, the noise is
/// taken for larger by no more than its inverse.
const LEAST_LEFT_OVER: f64 = 0.2;

/// `y = X θ + C η + ε`, solved for θ and η together with what is known of η beforehand.
#[derive(Clone, Debug)]
pub struct JointSolution {
    /// What the freedoms would add to θ (b).
    pub change: DVector<f64>,
    /// η, in its prior standard deviations (m).
    pub freedoms: DVector<f64>,
    /// Covariance of θ and η together ((b + m) × (b + m)), η in the same unit.
    pub covariance: DMatrix<f64>,
    /// Covariance of the weighted solution by the noise that is left (b × b).
    pub noise: DMatrix<f64>,
    /// How much more uncertain the parameters are by the colour of what is left than by white noise of the
    /// same size, in the median; at least 1.
    pub colour: f64,
}

impl JointSolution {
    /// Covariance of θ (b × b) where the noise is so many times as uncertain as white noise by its
    /// [`colour`](Self::colour), and what was known beforehand is not: with N = A + D the information of data and prior,
    /// `N⁻¹ (c² A + D) N⁻¹ = c² N⁻¹ − (c² − 1) N⁻¹ D N⁻¹`, D being 1 of each freedom.
    pub(crate) fn coloured_covariance(&self) -> DMatrix<f64> {
        let (own, freedoms) = (self.change.len(), self.freedoms.len());
        let square = self.colour * self.colour;
        let told_beforehand = self.covariance.view((0, own), (own, freedoms));
        let white = self.covariance.view((0, 0), (own, own));
        white * square - told_beforehand * told_beforehand.transpose() * (square - 1.0)
    }

    /// How far a model without the freedoms may be off, by the rows X of its parameters and C of theirs:
    /// the sum over these rows of the squares of `X Δθ + C η` and of what is open of it.
    pub(crate) fn squared_error(
        &self,
        rows: DMatrixView<'_, f64>,
        further: DMatrixView<'_, f64>,
    ) -> f64 {
        let off = rows * &self.change + further * &self.freedoms;
        let rows = beside_each_other(&[rows, further]);
        off.norm_squared() + symmetric_product(&rows, &rows).dot(&self.covariance)
    }

    /// The median of that sum over what is open, from AᵀA of the rows A = [X C]. Where one combination of parameters
    /// is open that the data do not tell, the mean is half as large again: it is that of a few large errors.
    ///
    /// The sum has the mean and the variance of a scaled chi-squared variable (Satterthwaite, *An approximate distribution
    /// of estimates of variance components*, 1946) whose median Wilson and Hilferty (*The distribution of chi-square*, 1931) give.
    pub(crate) fn median_squared_error(&self, gram: &DMatrix<f64>) -> f64 {
        let off: Vec<f64> = self.change.iter().chain(&self.freedoms).copied().collect();
        let off = DVector::from_vec(off);
        let along = gram * &off;
        let spread = product(gram, &self.covariance);
        let mean = spread.trace() + off.dot(&along);
        let squares = spread.component_mul(&spread.transpose()).sum();
        let variance = 2.0 * squares + 4.0 * along.dot(&(&self.covariance * &along));
        // 0, or of no covariance at all.
        if mean <= 0.0 {
            return mean;
        }
        let degrees_of_freedom = 2.0 * mean * mean / variance;
        mean * (1.0 - 2.0 / (9.0 * degrees_of_freedom)).max(0.0).powi(3)
    }
}

/// AᵀA of rows A = [X C].
pub(crate) fn gram(rows: DMatrixView<'_, f64>, further: DMatrixView<'_, f64>) -> DMatrix<f64> {
    let rows = beside_each_other(&[rows, further]);
    symmetric_product(&rows, &rows)
}

impl ResidualAnalysis<'_> {
    /// Solves for the parameters together with the coefficients of `further` columns (r × m,
    /// unweighted), which beforehand are 0 with a standard deviation of 1 and independent.
    ///
    /// The noise is that of the residuals, of each joint on its own and never with a smaller standard
    /// deviation than `floors`, white within what the filter lets pass; of `copies` rows that say the same, one counts.
    ///
    /// # Errors
    /// [`RegressionError::OutOfRange`] when the equation cannot be solved.
    pub fn with_prior(
        &self,
        further: &DMatrix<f64>,
        floors: &[f64],
        copies: f64,
    ) -> Result<JointSolution, RegressionError> {
        let residuals = &self.solution.residuals;
        let matrix = self.system.matrix();
        let (own, all) = (matrix.ncols(), matrix.ncols() + further.ncols());
        let mut spectrum = self.spectrum().clone();
        spectrum.raise_to(floors);
        let (mut solved, mut colour) = (None, 1.0);
        let grams = self.grams(further, residuals);
        for pass in 0..PASSES {
            let mut gram = DMatrix::zeros(all + 1, all + 1);
            for (joint, of_joint) in grams.iter().enumerate() {
                gram += of_joint / (spectrum.mean_power(joint) * copies);
            }
            let right = gram.view((0, all), (all, 1)).into_owned();
            // Parameters of all sizes: each column by its own length.
            let scale = DVector::from_fn(all, |k, _| match gram[(k, k)].sqrt() {
                length if k < own && length > 0.0 => 1.0 / length,
                _ => 1.0,
            });
            let mut normal = DMatrix::from_fn(all, all, |i, j| scale[i] * gram[(i, j)] * scale[j]);
            for k in own..all {
                normal[(k, k)] += 1.0;
            }
            let factor = Cholesky::new(normal).ok_or(RegressionError::OutOfRange)?;
            let found = factor.solve(&right.column(0).component_mul(&scale)).component_mul(&scale);
            let mut covariance = factor.inverse();
            for (mut column, by) in covariance.column_iter_mut().zip(&scale) {
                column.component_mul_assign(&scale);
                column.scale_mut(*by);
            }
            let change = found.rows(0, own).into_owned();
            let freedoms = found.rows(own, all - own).into_owned();
            if pass + 1 < PASSES {
                // What the data tell of the freedoms takes as many rows.
                let told: f64 = (own..all).map(|k| 1.0 - covariance[(k, k)]).sum();
                let before = spectrum.independent_rows() - own as f64;
                let left = ((before - told) / before).clamp(LEAST_LEFT_OVER, 1.0);
                let remaining = residuals - matrix * &change - further * &freedoms;
                spectrum = ResidualSpectrum::fit(
                    self.system,
                    &self.leverage,
                    &(remaining / left.sqrt()),
                    self.filter,
                );
                let coloured = self.covariance_by(&spectrum);
                spectrum.raise_to(floors);
                colour = median_ratio(&coloured, &self.covariance_by(&spectrum.whitened()));
            }
            solved = Some((change, freedoms, covariance));
        }
        let (change, freedoms, covariance) = solved.ok_or(RegressionError::OutOfRange)?;
        let noise = self.covariance_by(&spectrum) * copies;
        Ok(JointSolution { change, freedoms, covariance, noise, colour })
    }

    /// `AᵀA` of the rows A = (X C ρ) of each joint, the residuals ρ last, over the frequencies that the filter lets
    /// pass. The noise there is taken for white, not of the residuals' colour: what the model lacks is at the
    /// frequencies of the motion, and is no noise that the others could outweigh.
    fn grams(&self, further: &DMatrix<f64>, residuals: &DVector<f64>) -> Vec<DMatrix<f64>> {
        let residuals = DMatrix::from_column_slice(residuals.len(), 1, residuals.as_slice());
        let all = [self.system.matrix(), further, &residuals];
        // One joint at a time, which bounds the memory.
        let of_joint = |joint: usize| {
            let rows = self.system.joint_rows(joint);
            let columns = beside_each_other(&all.map(|of| of.rows_range(rows.clone())));
            let passed = self.filter.passed(&self.filter.transforms(&columns, 1));
            symmetric_product(&passed, &passed)
        };
        (0..self.system.joints()).map(of_joint).collect()
    }

    /// `ZᵀVZ` with the noise of this spectrum.
    pub(super) fn covariance_by(&self, spectrum: &ResidualSpectrum<'_>) -> DMatrix<f64> {
        // Z = Ω^{-1/2} Q R⁻ᵀ, so that the transforms of Q do.
        let r_inverse = &self.solution.r_inverse;
        let of_basis = spectrum.covariance_of(&self.basis_transforms, &self.solution.noise_levels);
        let covariance = product(&product(r_inverse, &of_basis), &r_inverse.transpose());
        (&covariance + covariance.transpose()) * 0.5
    }
}

/// The median ratio of the standard deviations of two covariances, at least 1.
fn median_ratio(one: &DMatrix<f64>, other: &DMatrix<f64>) -> f64 {
    let (one, other) = (one.diagonal(), other.diagonal());
    let mut ratios: Vec<f64> = (one.iter().zip(other.iter()))
        .map(|(one, other)| (one / other).sqrt())
        .filter(|ratio| ratio.is_finite())
        .collect();
    ratios.sort_unstable_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).map_or(1.0, |median| median.max(1.0))
}

/// Matrices of as many rows, one beside the other.
fn beside_each_other(matrices: &[DMatrixView<'_, f64>]) -> DMatrix<f64> {
    let columns: Vec<_> = matrices.iter().flat_map(|matrix| matrix.column_iter()).collect();
    DMatrix::from_columns(&columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a chi-squared variable of one degree of freedom, and of many.
    #[test]
    fn few_open_combinations_have_a_median_below_the_mean() {
        let solution = |size: usize, off: f64| JointSolution {
            change: DVector::from_element(size, off),
            freedoms: DVector::zeros(0),
            covariance: DMatrix::identity(size, size) * 4.0,
            noise: DMatrix::zeros(0, 0),
            colour: 1.0,
        };
        let median = |size: usize, off: f64| {
            solution(size, off).median_squared_error(&DMatrix::identity(size, size))
        };
        // scipy.stats.chi2.median(1) = 0.45494, of 100: 99.3341.
        assert!((median(1, 0.0) / (4.0 * 0.45494) - 1.0).abs() < 0.04);
        assert!((median(100, 0.0) / (4.0 * 99.3341) - 1.0).abs() < 1e-4);
        // scipy.stats.ncx2.median(3, 3 · 25/4) = 20.767.
        assert!((median(3, 5.0) / (4.0 * 20.767) - 1.0).abs() < 0.02);
        assert!(median(2, 0.0) < median(2, 1.0));
    }
}
