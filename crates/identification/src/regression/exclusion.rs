//! Test for excluding parameters from a model.

use nalgebra::{Cholesky, DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::analysis::ResidualAnalysis;
use super::error::RegressionError;

/// Test of a model against the same model without some of its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exclusion {
    /// `θ_oᵀ Cov(θ_o)⁻¹ θ_o / k` for the k excluded parameters θ_o, with their corrected covariance
    /// in the full model.
    ///
    /// For white residuals this is the textbook's F, `(‖ρ_r‖² − ‖ρ‖²)/k / (‖ρ‖²/(r − b))` in
    /// weighted rows, because excluding the parameters increases the sum of squares by this
    /// quadratic form. For coloured residuals the textbook's F is too large, but this value is not.
    pub f_statistic: f64,
    /// Probability of a value at least this large if the true parameters are zero. The F
    /// distribution has k and n degrees of freedom, with n the independent rows that remain in the
    /// full model.
    pub probability: f64,
}

impl ResidualAnalysis<'_> {
    /// Tests whether the parameters of these columns may be excluded; `covariance` is that of this
    /// analysis.
    ///
    /// # Errors
    /// [`RegressionError::OutOfRange`] if the covariance cannot be inverted, and
    /// [`RegressionError::TooFewRows`] if no independent row remains.
    pub fn test_exclusion(
        &self,
        columns: &[usize],
        covariance: &DMatrix<f64>,
    ) -> Result<Exclusion, RegressionError> {
        let (rows, all) = self.system.matrix().shape();
        let left_over = self.spectrum().independent_rows() - all as f64;
        if left_over < 1.0 {
            return Err(RegressionError::TooFewRows { rows, columns: all });
        }
        let count = columns.len() as f64;
        let values = self.solution.parameters.select_rows(columns);
        let values = DVector::from_column_slice(values.as_slice());
        let spread = covariance.select_rows(columns).select_columns(columns);
        let factor = Cholesky::new(spread).ok_or(RegressionError::OutOfRange)?;
        let f_statistic = values.dot(&factor.solve(&values)) / count;
        let distribution = FisherSnedecor::new(count, left_over);
        let probability = distribution.map_or(f64::NAN, |f| f.sf(f_statistic));
        Ok(Exclusion { f_statistic, probability })
    }
}
