//! Instrumental variables: the part of the observation matrix that the simulated motion explains.

use nalgebra::{DMatrix, SVD};

use crate::identification::problem::{IdentificationError, Selection};
use crate::regression::{Observations, RegressionError, Solution};

/// Observation matrix X projected on instruments Z, and the strength of the instruments.
pub(super) struct Instruments {
    /// Equation with `X̂ = Z (ZᵀΩ⁻¹Z)⁻¹ ZᵀΩ⁻¹X` and the measurements of the equation of X.
    pub(super) projected_equation: Observations,
    /// Smallest canonical correlation between the columns of Ω^{-1/2} Z and Ω^{-1/2} X: 1 if the
    /// instruments span X, 0 if a combination of parameters has no instrument.
    pub(super) smallest_correlation: f64,
}

impl Instruments {
    /// Creates the instruments of the equation `y = X θ + ε` with noise levels σ_j.
    ///
    /// # Errors
    /// [`IdentificationError`] with the names of the parameters if Z or X̂ is rank-deficient.
    pub(super) fn new(
        equation: &Observations,
        instruments: &DMatrix<f64>,
        levels: &[f64],
        selection: &Selection,
    ) -> Result<Self, IdentificationError> {
        let named = |error| selection.regression_failure(error);
        // The instruments need full rank, which is checked in the same way as for an observation
        // matrix.
        let (y, joints) = (equation.measurements(), equation.joints());
        let alone = Observations::new(instruments.clone(), y.clone(), joints).map_err(named)?;
        alone.solve_weighted(levels).map_err(named)?;

        let weighted = |matrix: &DMatrix<f64>| {
            let mut matrix = matrix.clone();
            for (joint, level) in levels.iter().enumerate() {
                matrix.rows_range_mut(equation.joint_rows(joint)).unscale_mut(*level);
            }
            matrix
        };
        let z = weighted(instruments).qr().q();
        let x = weighted(&equation.matrix().dense());
        let in_z = z.tr_mul(&x);
        // The cosines of the angles between two subspaces are the singular values of Q_zᵀ Q_x
        // (Björck & Golub, Math. Comp. 27, 1973).
        let cosines = z.tr_mul(&x.qr().q());
        let cosines = SVD::try_new(cosines, false, false, f64::EPSILON, MAX_SVD_ITERATIONS)
            .ok_or(IdentificationError::Regression(RegressionError::SingularValues))?;
        let smallest_correlation = cosines.singular_values.min();
        let mut projected = z * in_z;
        for (joint, level) in levels.iter().enumerate() {
            projected.rows_range_mut(equation.joint_rows(joint)).scale_mut(*level);
        }
        let projected = Observations::new(projected, y.clone(), joints).map_err(named)?;
        Ok(Self { projected_equation: projected, smallest_correlation })
    }

    /// Solves `θ = (ZᵀΩ⁻¹X)⁻¹ ZᵀΩ⁻¹y`.
    ///
    /// With as many instruments as parameters, this equals least squares with X̂ in place of X.
    /// ZᵀΩ⁻¹(y − Xθ) = 0 and X̂ᵀΩ⁻¹(y − X̂θ) = 0 are equivalent, because X̂ and Z span the same
    /// space, and X − X̂ is orthogonal to it. The covariance of that solution is the covariance of
    /// the estimate. The influence of the rows on the estimate is `Ω⁻¹X̂ (X̂ᵀΩ⁻¹X̂)⁻¹ = Ω⁻¹Z
    /// (XᵀΩ⁻¹Z)⁻¹`. The residuals are those of X.
    pub(super) fn solve(
        &self,
        equation: &Observations,
        levels: &[f64],
    ) -> Result<Solution, RegressionError> {
        let mut solution = self.projected_equation.solve_weighted(levels)?;
        solution.residuals = equation.residuals(&solution.parameters);
        Ok(solution)
    }
}

/// Largest number of iterations for the singular values of a b × b matrix, far more than usually
/// needed.
const MAX_SVD_ITERATIONS: usize = 10_000;

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;
    use didim_dynamics::dynamics::{BaseParameters, Model};
    use didim_dynamics::robot::Robot;

    /// Values that repeat themselves nowhere.
    fn matrix(rows: usize, columns: usize, phase: f64) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| {
            let (i, j) = (i as f64, j as f64);
            (phase + 1.3 * i + 0.7 * i * (j + 1.0).sqrt()).sin() + 0.1 * j
        })
    }

    #[test]
    fn projected_least_squares_is_the_instrumental_variable_estimate() {
        let robot =
            Robot::from_toml(include_str!("../../../../../config/robots/tx40.toml")).unwrap();
        let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
        let names = base.names()[..3].to_vec();
        let selection = Selection::new(&robot, &base, Some(&names)).unwrap();
        let (rows, levels) = (20, [0.5, 2.0]);
        let x = matrix(rows, 3, 0.0);
        let z = &x + 0.3 * matrix(rows, 3, 2.0);
        let y = &x * DVector::from_vec(vec![1.0, -2.0, 3.0]) + 0.2 * matrix(rows, 1, 5.0).column(0);
        let equation = Observations::new(x.clone(), y.clone(), 2).unwrap();
        let instruments = Instruments::new(&equation, &z, &levels, &selection).unwrap();
        let solution = instruments.solve(&equation, &levels).unwrap();

        let weight = DVector::from_fn(rows, |row, _| levels[row / 10].powi(-2));
        let zw = DMatrix::from_fn(rows, 3, |i, j| z[(i, j)] * weight[i]);
        let inverse = zw.tr_mul(&x).try_inverse().unwrap();
        // Rounding of matrices of condition number 10 or so.
        let expected = &inverse * zw.tr_mul(&y);
        assert!((&solution.parameters - &expected).norm() < 1e-12 * expected.norm());
        assert!((&solution.residuals - (&y - &x * &expected)).norm() < 1e-12 * y.norm());
        assert!(zw.tr_mul(&solution.residuals).norm() < 1e-11 * y.norm());
        // (ZᵀΩ⁻¹X)⁻¹ ZᵀΩ⁻¹Z (XᵀΩ⁻¹Z)⁻¹
        let covariance = &inverse * zw.tr_mul(&z) * inverse.transpose();
        assert!((&solution.covariance - &covariance).norm() < 1e-12 * covariance.norm());
        assert!((0.5..0.999).contains(&instruments.smallest_correlation));
    }

    #[test]
    fn the_matrix_as_its_own_instruments_is_least_squares() {
        let robot =
            Robot::from_toml(include_str!("../../../../../config/robots/tx40.toml")).unwrap();
        let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
        let names = base.names()[..3].to_vec();
        let selection = Selection::new(&robot, &base, Some(&names)).unwrap();
        let (x, levels) = (matrix(20, 3, 0.0), [0.5, 2.0]);
        let y: DVector<f64> = matrix(20, 1, 5.0).column(0).into_owned();
        let equation = Observations::new(x.clone(), y, 2).unwrap();
        let instruments = Instruments::new(&equation, &x, &levels, &selection).unwrap();
        assert!((instruments.smallest_correlation - 1.0).abs() < 1e-12);
        let parameters = instruments.solve(&equation, &levels).unwrap().parameters;
        let squares = equation.solve_weighted(&levels).unwrap().parameters;
        assert!((&parameters - &squares).norm() < 1e-12 * squares.norm());
    }
}
