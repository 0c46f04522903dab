//! Criteria for comparing information matrices.

use super::limits::DesignLimits;
use crate::regression::CholeskyFactor;
use nalgebra::{DMatrix, DVector};

/// Quantity to be minimised.
pub(super) enum Objective {
    /// Mean of ½ ln(σ² + need²) of the parameters at these indices: the logarithm of the geometric
    /// mean of their standard deviations. Below `need` a decrease has little value.
    Deviations(Vec<(usize, f64)>),
    /// Logarithm of the condition number of the matrix whose Gram matrix is the information.
    ConditionNumber,
}

/// Power of the eigenvalues. Sums of these powers replace the largest and the smallest eigenvalue,
/// which have no gradient if two are equal.
const EIGENVALUE_POWER: i32 = 4;

impl Objective {
    /// Returns the value f; `None` if M is not positive definite.
    pub(super) fn value(&self, information: &DMatrix<f64>) -> Option<f64> {
        let value = match self {
            Self::Deviations(wanted) => {
                let variances = variances(information)?;
                let share = 1.0 / wanted.len() as f64;
                let squares = wanted.iter().map(|&(k, need)| variances[k] + need * need);
                squares.map(|square| 0.5 * share * square.ln()).sum()
            }
            Self::ConditionNumber => self.evaluate(information)?.0,
        };
        value.is_finite().then_some(value)
    }

    /// Returns the value f, and its gradient G with df = tr(G dM); `None` if M is not positive
    /// definite.
    pub(super) fn evaluate(&self, information: &DMatrix<f64>) -> Option<(f64, DMatrix<f64>)> {
        match self {
            Self::Deviations(wanted) => {
                let covariance = covariance(information)?;
                let share = 1.0 / wanted.len() as f64;
                let mut value = 0.0;
                let mut weighted = DMatrix::zeros(wanted.len(), covariance.ncols());
                for (mut row, &(place, need)) in weighted.row_iter_mut().zip(wanted) {
                    let square = covariance[(place, place)] + need * need;
                    value += 0.5 * share * square.ln();
                    row.copy_from(&(covariance.row(place) * (0.5 * share / square).sqrt()));
                }
                let slope = -(weighted.transpose() * weighted);
                value.is_finite().then_some((value, slope))
            }
            Self::ConditionNumber => {
                let eigen = information.clone().symmetric_eigen();
                let values = &eigen.eigenvalues;
                let (largest, smallest) = (values.max(), values.min());
                if smallest.is_nan() || smallest <= 0.0 {
                    return None;
                }
                let highs = values.map(|of| (of / largest).powi(EIGENVALUE_POWER));
                let lows = values.map(|of| (smallest / of).powi(EIGENVALUE_POWER));
                let (high, low) = (highs.sum(), lows.sum());
                let power = f64::from(EIGENVALUE_POWER);
                let value = 0.5 * ((largest / smallest).ln() + (high * low).ln() / power);
                let by_value = DMatrix::from_diagonal(
                    &(highs / high - lows / low).zip_map(values, |slope, of| 0.5 * slope / of),
                );
                let slope = &eigen.eigenvectors * by_value * eigen.eigenvectors.transpose();
                value.is_finite().then_some((value, slope))
            }
        }
    }
}

/// Returns M⁻¹; `None` if a parameter depends on others.
pub(super) fn covariance(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scaled = Scaled::new(information);
    let inverse = CholeskyFactor::new(scaled.matrix)?.inverse();
    let is_determined = is_determined(inverse.diagonal().as_slice());
    let scale = &scaled.scale;
    let entry = |i: usize, j: usize| scale[i] * inverse[(i, j)] * scale[j];
    is_determined.then(|| DMatrix::from_fn(inverse.nrows(), inverse.ncols(), entry))
}

/// Returns the diagonal of M⁻¹; `None` if a parameter depends on others.
pub(super) fn variances(information: &DMatrix<f64>) -> Option<DVector<f64>> {
    let scaled = Scaled::new(information);
    let inflation = CholeskyFactor::new(scaled.matrix)?.inverse_diagonal();
    let is_determined = is_determined(inflation.as_slice());
    is_determined.then(|| inflation.zip_map(&scaled.scale, |own, scale| scale * own * scale))
}

/// M with a diagonal of 1, because parameters have units.
struct Scaled {
    matrix: DMatrix<f64>,
    scale: DVector<f64>,
}

impl Scaled {
    fn new(information: &DMatrix<f64>) -> Self {
        let scale = information.diagonal().map(|of| 1.0 / of.sqrt());
        let entry = |i: usize, j: usize| scale[i] * information[(i, j)] * scale[j];
        let matrix = DMatrix::from_fn(information.nrows(), information.ncols(), entry);
        Self { matrix, scale }
    }
}

/// Returns true if no variance is inflated by dependence on other parameters. Rounding errors may
/// make the Cholesky decomposition of dependent columns succeed.
fn is_determined(inflation: &[f64]) -> bool {
    inflation.iter().all(|own| *own < DesignLimits::DEFAULT.max_variance_inflation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_values() {
        let root = DMatrix::from_fn(9, 4, |i, j| ((3 * i + 5 * j * j + i * i * j) as f64).sin());
        let matrix = root.transpose() * root;
        let change = DMatrix::from_fn(4, 4, |i, j| ((i + j) as f64 * 0.7).cos());
        for objective in
            [Objective::Deviations(vec![(0, 0.0), (2, 0.3)]), Objective::ConditionNumber]
        {
            let (value, slope) = objective.evaluate(&matrix).unwrap();
            assert!((objective.value(&matrix).unwrap() - value).abs() < 1e-12);
            let h = 1e-6;
            let [up, down] =
                [h, -h].map(|h| objective.evaluate(&(&matrix + h * &change)).unwrap().0);
            let expected = (up - down) / (2.0 * h);
            let change_of_value = (slope * &change).trace();
            assert!((change_of_value - expected).abs() < 1e-7 * (1.0 + expected.abs()));
        }
    }

    #[test]
    fn what_is_not_reported_has_no_value() {
        let dependent = DMatrix::from_element(3, 3, 1.0);
        assert!(Objective::Deviations(vec![(0, 0.0)]).evaluate(&dependent).is_none());
    }
}
