//! What the residuals of a weighted solution say about it.

use nalgebra::{DMatrix, DVector};

use super::observations::Observations;
use super::solution::Solution;
use super::spectrum::{ResidualSpectrum, RowFilter};

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
    pub(super) leverage: Vec<Vec<f64>>,
    spectrum: ResidualSpectrum,
}

impl<'a> ResidualAnalysis<'a> {
    /// Of a solution of [`Observations::weighted`], whose rows have passed `filter`.
    pub fn new(system: &'a Observations, solution: &'a Solution, filter: &'a RowFilter) -> Self {
        let mut weighted = system.matrix().clone();
        divide_by_levels(system, &mut weighted, &solution.noise_levels);
        let basis = weighted * &solution.r_inverse;
        let mut leverage = filter.no_leverage(system.joints());
        filter.add_leverage(&basis, &mut leverage);
        let spectrum = ResidualSpectrum::fit(system, &leverage, &solution.residuals, filter);
        Self { system, solution, filter, basis, leverage, spectrum }
    }

    /// The spectrum of the errors of the rows.
    pub fn spectrum(&self) -> &ResidualSpectrum {
        &self.spectrum
    }

    /// `Z = Ω⁻¹X (XᵀΩ⁻¹X)⁻¹` (r × b): the estimate is Zᵀy, and a change of y by d moves it by Zᵀd.
    pub fn influence(&self) -> DMatrix<f64> {
        let mut z = self.system.matrix() * &self.solution.covariance;
        for _ in 0..2 {
            divide_by_levels(self.system, &mut z, &self.solution.noise_levels);
        }
        z
    }

    /// Covariance `ZᵀVZ` of the parameters (b × b), V the covariance of the errors: right also
    /// where the residuals are not white, where equation 10 is not.
    pub fn covariance(&self) -> DMatrix<f64> {
        self.spectrum.covariance_of(&self.influence())
    }

    /// The residuals, each joint's divided by its noise level.
    pub(super) fn weighted_residuals(&self) -> DVector<f64> {
        let mut residuals = DMatrix::from_columns(core::slice::from_ref(&self.solution.residuals));
        divide_by_levels(self.system, &mut residuals, &self.solution.noise_levels);
        residuals.column(0).into_owned()
    }
}

/// Divides the rows of each joint by its level.
pub(super) fn divide_by_levels(system: &Observations, matrix: &mut DMatrix<f64>, levels: &[f64]) {
    for (joint, level) in levels.iter().enumerate() {
        matrix.rows_range_mut(system.joint_rows(joint)).unscale_mut(*level);
    }
}
