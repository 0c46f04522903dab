//! What makes one information matrix better than another.

use nalgebra::DMatrix;

/// What is to be small.
pub(super) enum Objective {
    /// The mean of ½ ln(σ² + need²) of the parameters of these places: the logarithm of the geometric mean
    /// of their standard deviations, below `need` of which nothing is worth much.
    Deviations(Vec<(usize, f64)>),
    /// The logarithm of the condition number of a matrix whose rows have this information.
    ConditionNumber,
}

/// The power of eigenvalues whose sums stand for the largest and the smallest: those have no gradient where two are equal.
const POWER: i32 = 4;

impl Objective {
    /// Its value, and G with df = tr(G dM); nothing where M is not positive definite.
    pub(super) fn of(&self, information: &DMatrix<f64>) -> Option<(f64, DMatrix<f64>)> {
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
                let highs = values.map(|of| (of / largest).powi(POWER));
                let lows = values.map(|of| (smallest / of).powi(POWER));
                let (high, low) = (highs.sum(), lows.sum());
                let power = f64::from(POWER);
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

/// M⁻¹, of a matrix whose diagonal was made 1 before: parameters have units.
pub(super) fn covariance(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = information.diagonal().map(|of| 1.0 / of.sqrt());
    let scaled = |matrix: &DMatrix<f64>| {
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
            scale[i] * matrix[(i, j)] * scale[j]
        })
    };
    let inverse = scaled(&scaled(information).cholesky()?.inverse());
    // Of dependent columns a Cholesky factor tells by the noise of its last digits.
    let told = |k: usize| inverse[(k, k)] * information[(k, k)] < LEAST_TOLD;
    (0..inverse.nrows()).all(told).then_some(inverse)
}

/// 1/(1 − R²) of a column by all others: beyond it they are the same.
const LEAST_TOLD: f64 = 1e12;

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
            let (_, slope) = objective.of(&matrix).unwrap();
            let h = 1e-6;
            let [up, down] = [h, -h].map(|h| objective.of(&(&matrix + h * &change)).unwrap().0);
            let expected = (up - down) / (2.0 * h);
            let found = (slope * &change).trace();
            assert!((found - expected).abs() < 1e-7 * (1.0 + expected.abs()));
        }
    }

    #[test]
    fn what_is_not_told_has_no_value() {
        let dependent = DMatrix::from_element(3, 3, 1.0);
        assert!(Objective::Deviations(vec![(0, 0.0)]).of(&dependent).is_none());
    }
}
