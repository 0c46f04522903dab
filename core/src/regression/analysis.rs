//! What the residuals of a weighted solution say about it.

use nalgebra::{DMatrix, DVector};

use super::observations::Observations;
use super::products::product;
use super::solution::Solution;
use super::spectrum::{ResidualSpectrum, RowFilter, Transforms};

/// A weighted solution with the spectrum of its errors.
///
/// At every frequency the parameters have taken a share out of the residuals, which is put back:
/// that of the columns of an orthonormal basis of `Ω^{-1/2} X`, their leverage.
#[derive(Clone, Debug)]
pub struct ResidualAnalysis<'a> {
    pub(super) system: &'a Observations,
    pub(super) solution: &'a Solution,
    pub(super) filter: &'a RowFilter,
    /// Q (r × b), the columns of `Ω^{-1/2} X` as combinations of orthonormal ones.
    pub(super) basis: DMatrix<f64>,
    pub(super) basis_transforms: Transforms,
    pub(super) leverage: Vec<Vec<f64>>,
    spectrum: ResidualSpectrum<'a>,
}

impl<'a> ResidualAnalysis<'a> {
    /// Of a solution of [`Observations::weighted`], whose rows have passed `filter`.
    pub fn new(system: &'a Observations, solution: &'a Solution, filter: &'a RowFilter) -> Self {
        let mut weighted = system.matrix().clone();
        divide_by_levels(system, &mut weighted, &solution.noise_levels);
        let basis = product(&weighted, &solution.r_inverse);
        let basis_transforms = filter.transforms(&basis, system.joints());
        let mut leverage = filter.no_leverage(system.joints());
        filter.add_leverage(&basis_transforms, system.rows_per_joint(), &mut leverage);
        let spectrum = ResidualSpectrum::fit(system, &leverage, &solution.residuals, filter);
        Self { system, solution, filter, basis, basis_transforms, leverage, spectrum }
    }

    /// The spectrum of the errors of the rows.
    pub fn spectrum(&self) -> &ResidualSpectrum<'a> {
        &self.spectrum
    }

    /// Rows of zeros on both sides.
    pub fn rows_without_equation(&self) -> Vec<usize> {
        let (matrix, measured) = (self.system.matrix(), self.system.measurements());
        let is_zero = |row: &usize| {
            measured[*row] == 0.0 && matrix.row(*row).iter().all(|value| *value == 0.0)
        };
        (0..matrix.nrows()).filter(is_zero).collect()
    }

    /// `Z = Ω⁻¹X (XᵀΩ⁻¹X)⁻¹` (r × b): the estimate is Zᵀy, and a change of y by d moves it by Zᵀd.
    pub fn influence(&self) -> DMatrix<f64> {
        // Ω^{-1/2} Q R⁻ᵀ
        let mut z = product(&self.basis, &self.solution.r_inverse.transpose());
        divide_by_levels(self.system, &mut z, &self.solution.noise_levels);
        z
    }

    /// How far the estimate moves with a change of y by these (r): Zᵀ times them, Z the
    /// [`influence`](Self::influence).
    pub fn estimate_shift(&self, change: &DVector<f64>) -> DVector<f64> {
        let weighted = self.weighted(change);
        &self.solution.r_inverse * self.basis.tr_mul(&weighted)
    }

    /// Covariance `ZᵀVZ` of the parameters (b × b), V the covariance of the errors: right also
    /// where the residuals are not white, where equation 10 is not.
    pub fn covariance(&self) -> DMatrix<f64> {
        self.covariance_by(&self.spectrum)
    }

    /// The rows (r) of each joint divided by its noise level.
    pub(super) fn weighted(&self, rows: &DVector<f64>) -> DVector<f64> {
        let mut weighted = DMatrix::from_columns(core::slice::from_ref(rows));
        divide_by_levels(self.system, &mut weighted, &self.solution.noise_levels);
        weighted.column(0).into_owned()
    }
}

/// Divides the rows of each joint by its level.
pub(super) fn divide_by_levels(system: &Observations, matrix: &mut DMatrix<f64>, levels: &[f64]) {
    for (joint, level) in levels.iter().enumerate() {
        matrix.rows_range_mut(system.joint_rows(joint)).unscale_mut(*level);
    }
}
