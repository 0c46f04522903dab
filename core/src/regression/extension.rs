//! What a fit would gain, and where its parameters would go, if the model had more columns.

use nalgebra::{Cholesky, DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::analysis::{ResidualAnalysis, divide_by_levels};
use super::spectrum::ResidualSpectrum;

/// A column of which less than this share lies outside of the others adds nothing that could be
/// told from rounding.
const INDEPENDENT: f64 = 1e-6;

/// A weighted solution beside that of the model with further columns, `y = X θ + C c + ε`.
#[derive(Clone, Debug)]
pub struct Extension {
    /// Which of the columns of C are independent of X and of each other; the others are left out.
    pub columns: Vec<usize>,
    /// c of these columns.
    pub coefficients: DVector<f64>,
    /// Covariance of c, corrected for the colour of the residuals that remain.
    pub covariance: DMatrix<f64>,
    /// What the further columns would add to θ (b).
    pub shift: DVector<f64>,
    /// The probability of coefficients as far from zero as these if all are zero in truth, by
    /// Wald's statistic `cᵀ Cov⁻¹ c` of χ² distribution.
    pub probability: f64,
}

impl ResidualAnalysis<'_> {
    /// Adds columns C (r × k, unweighted) to the solution; none when no column is independent of X.
    pub fn extended(&self, further: &DMatrix<f64>) -> Option<Extension> {
        let levels = &self.solution.noise_levels;
        let mut weighted = further.clone();
        divide_by_levels(self.system, &mut weighted, levels);
        let (columns, outside) = independent_parts(&self.basis, &weighted);
        if columns.is_empty() {
            return None;
        }
        // Of the residuals, which are orthogonal to X, the part along the new directions.
        let residuals = self.weighted_residuals();
        let along = outside.tr_mul(&residuals);
        let mut remaining = residuals - &outside * &along;
        for (joint, level) in levels.iter().enumerate() {
            remaining.rows_range_mut(self.system.joint_rows(joint)).scale_mut(*level);
        }
        let mut leverage = self.leverage.clone();
        self.filter.add_leverage(&outside, &mut leverage);
        let spectrum = ResidualSpectrum::fit(self.system, &leverage, &remaining, self.filter);
        let mut influence = outside.clone();
        divide_by_levels(self.system, &mut influence, levels);
        let covariance = spectrum.covariance_of(&influence);
        let statistic = along.dot(&Cholesky::new(covariance.clone())?.solve(&along));

        // C = X(…) + B T with B the orthonormal directions, so that c = T⁻¹ Bᵀε.
        let chosen = weighted.select_columns(&columns);
        let back = outside.tr_mul(&chosen).try_inverse()?;
        let coefficients = &back * along;
        // θ moves by −(XᵀΩ⁻¹X)⁻¹XᵀΩ⁻¹C c.
        let unweighted = further.select_columns(&columns) * &coefficients;
        let shift = -self.influence().tr_mul(&unweighted);
        let degrees = columns.len() as f64;
        Some(Extension {
            columns,
            covariance: &back * covariance * back.transpose(),
            coefficients,
            shift,
            probability: ChiSquared::new(degrees).map_or(1.0, |chi| chi.sf(statistic)),
        })
    }
}

/// The columns that are independent of `basis` and of those before, and an orthonormal basis of
/// what they add. Twice over each, for full accuracy (Kahan).
fn independent_parts(basis: &DMatrix<f64>, columns: &DMatrix<f64>) -> (Vec<usize>, DMatrix<f64>) {
    let (mut chosen, mut parts): (Vec<usize>, Vec<DVector<f64>>) = (Vec::new(), Vec::new());
    for (index, column) in columns.column_iter().enumerate() {
        let length = column.norm();
        let mut outside = column.into_owned();
        for _ in 0..2 {
            outside -= basis * basis.tr_mul(&outside);
            for part in &parts {
                let share = part.dot(&outside);
                outside.axpy(-share, part, 1.0);
            }
        }
        let left = outside.norm();
        if length.is_finite() && left > INDEPENDENT * length {
            chosen.push(index);
            parts.push(outside / left);
        }
    }
    if parts.is_empty() {
        return (chosen, DMatrix::zeros(columns.nrows(), 0));
    }
    (chosen, DMatrix::from_columns(&parts))
}
