//! Analysis of the residuals of a weighted solution.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::observations::Observations;
use super::products::matrix_product;
use super::row_filter::RowFilter;
use super::solution::Solution;
use super::spectra::{OrthonormalBasis, Spectra};
use super::spectrum::ResidualSpectrum;

/// Weighted solution with the spectrum of its errors.
///
/// At every frequency the fit removes a share of the residual power, which is added back. This
/// share is the leverage of the columns of an orthonormal basis of `Ω^{-1/2} X`.
#[derive(Clone, Debug)]
pub struct ResidualAnalysis<'a> {
    pub(super) system: &'a Observations,
    pub(super) solution: &'a Solution,
    pub(super) filter: &'a RowFilter,
    /// Q (r × b), an orthonormal basis of the columns of `Ω^{-1/2} X`.
    pub(super) basis: OrthonormalBasis<'a>,
    pub(super) basis_spectra: Spectra<'a>,
    pub(super) leverage: Vec<Vec<f64>>,
    /// Number of equivalent rows of which one counts.
    pub(super) repeats: f64,
    spectrum: ResidualSpectrum<'a>,
}

impl<'a> ResidualAnalysis<'a> {
    /// Analyses a solution of [`Observations::solve_weighted`], whose rows have passed `filter`.
    pub fn new(system: &'a Observations, solution: &'a Solution, filter: &'a RowFilter) -> Self {
        let (matrix, levels) = (system.matrix(), &solution.noise_levels);
        let basis =
            OrthonormalBasis { matrix, noise_levels: levels, r_inverse: &solution.r_inverse };
        let basis_spectra = Spectra::of_product(filter, matrix, &solution.r_inverse, levels);
        let mut leverage = filter.zero_leverage(system.joints());
        basis_spectra.add_leverage(system.rows_per_joint(), &mut leverage);
        let spectrum = ResidualSpectrum::fit(system, &leverage, &solution.residuals, filter, 1.0);
        Self { system, solution, filter, basis, basis_spectra, leverage, repeats: 1.0, spectrum }
    }

    /// Returns the analysis if only one of `repeats` equivalent rows counts: a motion that is
    /// repeated has the same model errors each time.
    #[must_use]
    pub fn counting_once(mut self, repeats: f64) -> Self {
        if repeats > 1.0 {
            self.repeats = repeats;
            self.spectrum = self.spectrum_of(&self.leverage, &self.solution.residuals);
        }
        self
    }

    /// Fits the spectrum of other residuals (r), of which a fit removed these shares.
    pub(super) fn spectrum_of(
        &self,
        leverage: &[Vec<f64>],
        residuals: &DVector<f64>,
    ) -> ResidualSpectrum<'a> {
        ResidualSpectrum::fit(self.system, leverage, residuals, self.filter, self.repeats)
    }

    /// Returns the spectrum of the errors of the rows.
    pub fn spectrum(&self) -> &ResidualSpectrum<'a> {
        &self.spectrum
    }

    /// Returns the number of independent rows of each joint for residuals of another equation (r).
    /// The share of the residual power that the fit removes is taken from this solution.
    pub(crate) fn effective_rows_of(
        &self,
        other: &Observations,
        residuals: &DVector<f64>,
    ) -> Vec<f64> {
        ResidualSpectrum::fit(other, &self.leverage, residuals, self.filter, self.repeats)
            .effective_rows_per_joint()
    }

    /// Returns the rows that are zero on both sides.
    pub fn rows_without_equation(&self) -> Vec<usize> {
        let (matrix, measured) = (self.system.matrix(), self.system.measurements());
        let per_joint = self.system.rows_per_joint();
        (0..matrix.nrows())
            .filter(|row: &usize| {
                let (joint, of_joint) = (row / per_joint, row % per_joint);
                measured[*row] == 0.0
                    && matrix.of_joint(joint).all(|(_, values)| values[of_joint] == 0.0)
            })
            .collect()
    }

    /// Returns the influence `Z = Ω⁻¹X (XᵀΩ⁻¹X)⁻¹` (r × b) in some rows of a joint. The estimate is
    /// Zᵀy, and a change d of y shifts it by Zᵀd.
    pub fn influence(&self, joint: usize, rows: Range<usize>) -> DMatrix<f64> {
        let matrix = self.system.matrix();
        let factor = self.whole_covariance().select_rows(&matrix.columns_of(joint));
        let level = self.solution.noise_levels[joint];
        matrix_product(&matrix.rows_of(joint, rows), &(factor / (level * level)))
    }

    /// Returns the shift of the estimate due to this change of y (r): Zᵀ times the change, with Z
    /// the [`influence`](Self::influence).
    pub fn estimate_shift(&self, change: &DVector<f64>) -> DVector<f64> {
        let weighted = self.weighted_rows(change);
        &self.solution.r_inverse * self.basis.transposed_times(weighted.as_slice())
    }

    /// Returns the shifts of the estimate due to changes D of y in the rows of one joint alone.
    /// `products` is `X_jᵀD` for the columns that act on the joint.
    pub fn estimate_shifts(&self, joint: usize, products: &DMatrix<f64>) -> DMatrix<f64> {
        let acting = self.system.matrix().columns_of(joint);
        let level = self.solution.noise_levels[joint];
        let right = self.solution.r_inverse.select_rows(&acting).tr_mul(products);
        &self.solution.r_inverse * right / (level * level)
    }

    /// Returns `(XᵀΩ⁻¹X)⁻¹`.
    fn whole_covariance(&self) -> DMatrix<f64> {
        matrix_product(&self.solution.r_inverse, &self.solution.r_inverse.transpose())
    }

    /// Returns the covariance `ZᵀVZ` of the parameters (b × b), with V the covariance of the
    /// errors. It is also valid for coloured residuals, unlike equation 10.
    pub fn covariance(&self) -> DMatrix<f64> {
        self.covariances_by(&[&self.spectrum]).pop().unwrap_or_default()
    }

    /// Returns the rows (r) of each joint divided by its noise level.
    pub(super) fn weighted_rows(&self, rows: &DVector<f64>) -> DVector<f64> {
        let mut weighted = rows.clone();
        for (joint, level) in self.solution.noise_levels.iter().enumerate() {
            weighted.rows_range_mut(self.system.joint_rows(joint)).unscale_mut(*level);
        }
        weighted
    }
}
