//! Coefficients of further columns that the model does not contain.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::analysis::ResidualAnalysis;
use super::error::RegressionError;
use super::limits::RegressionLimits;
use super::products::subtract_share;
use super::spectra::{OrthonormalBasis, Spectra};

/// Smallest part of a column that has to be linearly independent of the others, relative to its
/// length. A smaller part cannot be distinguished from rounding errors.
const MIN_INDEPENDENT_SHARE: f64 = 1e-6;

/// Coefficients of further columns C in the extended model `y = X θ + C c + ε`.
#[derive(Clone, Debug)]
pub struct Extension {
    /// Indices of the columns of C that are independent of X and of each other; dependent columns
    /// are omitted.
    pub columns: Vec<usize>,
    /// Coefficients c of these columns.
    pub coefficients: DVector<f64>,
    /// Covariance of c, corrected for the colour of the remaining residuals.
    pub covariance: DMatrix<f64>,
}

impl ResidualAnalysis<'_> {
    /// Extends the solution by one column per joint, which acts on this joint alone. `further`
    /// contains the values of these columns, one joint after the other (r, unweighted). Returns
    /// `None` if no column is independent of X, or if too few rows remain.
    ///
    /// # Errors
    /// [`RegressionError::OutOfRange`] if the covariance of the coefficients cannot be inverted.
    pub fn extend(&self, further: &DVector<f64>) -> Result<Option<Extension>, RegressionError> {
        let levels = &self.solution.noise_levels;
        let weighted = self.weighted_rows(further);
        let of_joint = |joint: usize| weighted.rows_range(self.system.joint_rows(joint));
        let mut outside = DMatrix::zeros(weighted.len(), levels.len());
        for joint in 0..levels.len() {
            let rows = self.system.joint_rows(joint);
            outside.view_mut((rows.start, joint), (rows.len(), 1)).copy_from(&of_joint(joint));
        }
        let IndependentParts { columns, outside_basis: outside } =
            independent_parts(self.basis, outside);
        let used = (self.system.matrix().ncols() + columns.len()) as f64;
        let left_over = self.spectrum().independent_rows() - used;
        if columns.is_empty() || left_over < RegressionLimits::DEFAULT.min_degrees_of_freedom {
            return Ok(None);
        }
        // Part of the residuals along the new directions. The residuals are orthogonal to X.
        let residuals = self.weighted_rows(&self.solution.residuals);
        let projection = outside.tr_mul(&residuals);
        let mut remaining = residuals - &outside * &projection;
        for (joint, level) in levels.iter().enumerate() {
            remaining.rows_range_mut(self.system.joint_rows(joint)).scale_mut(*level);
        }
        let mut leverage = self.leverage.clone();
        let spectra = Spectra::of_columns(self.filter, &outside, self.system.joints());
        spectra.add_leverage(self.system.rows_per_joint(), &mut leverage);
        let spectrum = self.spectrum_of(&leverage, &remaining);
        let covariance = spectrum.covariance_of(&spectra, levels) * self.repeats;
        if Cholesky::new(covariance.clone()).is_none() {
            return Err(RegressionError::OutOfRange);
        }
        // C = X(…) + B T with B the orthonormal directions, so that c = T⁻¹ Bᵀε.
        let back = DMatrix::from_fn(columns.len(), columns.len(), |direction, chosen| {
            let joint = columns[chosen];
            let outside = outside.column(direction);
            outside.rows_range(self.system.joint_rows(joint)).dot(&of_joint(joint))
        });
        let back = back.try_inverse().ok_or(RegressionError::OutOfRange)?;
        let coefficients = &back * projection;
        let covariance = &back * covariance * back.transpose();
        Ok(Some(Extension { columns, covariance, coefficients }))
    }
}

/// Parts of columns that are linearly independent of a basis.
struct IndependentParts {
    /// Columns that are independent of the basis and of the columns before them.
    columns: Vec<usize>,
    /// Orthonormal basis of these independent parts.
    outside_basis: DMatrix<f64>,
}

/// Orthogonalises columns against the basis, twice for full accuracy (Kahan). If a column lies
/// within an ill-conditioned basis, the first pass leaves only rounding errors, which must not be
/// chosen.
fn independent_parts(basis: OrthonormalBasis<'_>, columns: DMatrix<f64>) -> IndependentParts {
    let lengths: Vec<f64> = columns.column_iter().map(|column| column.norm()).collect();
    let (rows, mut outside) = (columns.nrows(), columns);
    for column in outside.as_mut_slice().chunks_exact_mut(rows) {
        basis.take_out_of(column);
        basis.take_out_of(column);
    }
    let chosen = orthonormalise(&mut outside, |column, remaining| {
        lengths[column].is_finite() && remaining > MIN_INDEPENDENT_SHARE * lengths[column]
    });
    if chosen.len() < outside.ncols() {
        outside = outside.select_columns(&chosen);
    }
    orthonormalise(&mut outside, |_, _| true);
    IndependentParts { columns: chosen, outside_basis: outside }
}

/// Orthonormalises the columns whose component outside the previous ones is large enough. `enough`
/// receives the index and the length of that component. Returns their indices.
fn orthonormalise(columns: &mut DMatrix<f64>, enough: impl Fn(usize, f64) -> bool) -> Vec<usize> {
    let mut chosen: Vec<usize> = Vec::new();
    for index in 0..columns.ncols() {
        let mut outside = columns.column(index).into_owned();
        for part in &chosen {
            subtract_share(outside.as_mut_slice(), columns.column(*part).as_slice());
        }
        let norm = outside.norm();
        if enough(index, norm) {
            columns.set_column(index, &(outside / norm));
            chosen.push(index);
        }
    }
    chosen
}
