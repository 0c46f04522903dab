//! Gains and parameters together: total least squares, and then the most probable values.

use didim_dynamics::robot::JointIndex;
use nalgebra::{DMatrix, DVector};

use super::equation::Equation;
use super::error::GainsError;
use crate::identification::payload::MahalanobisDistance;
use crate::regression::{Observations, RegressionError, ResidualAnalysis, RowFilter, Solution};

/// Largest number of refinement steps; three are usual.
const MAX_STEPS: usize = 50;
/// Largest step that counts as converged, in standard deviations.
const STEP_TOLERANCE: f64 = 1e-4;

/// Gains and unknowns from [`Equation::total_least_squares`].
pub(super) struct TotalLeastSquares {
    /// Gains g (n).
    pub(super) gains: DVector<f64>,
    /// Unknowns u (m).
    pub(super) unknowns: DVector<f64>,
}

/// Most probable inverse gains and unknowns.
pub(super) struct Estimate {
    /// 1/g (n), then u (m).
    pub(super) values: DVector<f64>,
    /// Covariance of `values`.
    pub(super) covariance: DMatrix<f64>,
    /// Residuals t − (U u + l)/g (r).
    pub(super) residuals: DVector<f64>,
}

impl Equation {
    /// Checks that the motion distinguishes the unknowns.
    ///
    /// # Errors
    /// Those of [`Observations::solve_ordinary`].
    pub(super) fn check_identifiable(&self) -> Result<(), RegressionError> {
        Observations::new(self.unknown_columns.clone(), self.torque.clone(), self.drive_count)?
            .solve_ordinary()
            .map(|_| ())
    }

    /// Returns the solution of `[T −U −l] (g, u, 1) = 0` with the smallest change of T, by singular
    /// values (M. Gautier and S. Briot, *Global identification of joint drive gains and dynamic
    /// parameters of robots*, 2014). U and l are exact, as in S. Van Huffel and J. Vandewalle (*The
    /// Total Least Squares Problem*, 1991, section 3.5): a QR decomposition removes them from T
    /// first. The rows of each drive are divided by its noise level, which is the residual of a fit
    /// to the rows of this drive alone. Without a load there is no l, and the gain of the reference
    /// drive is 1.
    ///
    /// Returns `None` if the unknowns cannot be distinguished or the scale is undetermined.
    pub(super) fn total_least_squares(&self) -> Option<TotalLeastSquares> {
        let (rows, unknowns) = (self.rows_per_drive(), self.unknown_columns.ncols());
        let by_load = self.reference.is_none();
        let width = unknowns + usize::from(by_load);
        let mut stacked = DMatrix::zeros(self.drive_count * (width + 1), width + self.drive_count);
        for drive in 0..self.drive_count {
            let mut triangle = self.triangular_factor(drive, by_load)?;
            let noise = triangle[(width, width)].abs() / ((rows - width) as f64).sqrt();
            let scale = self.torque.rows(drive * rows, rows).norm() / (rows as f64).sqrt();
            triangle /= noise.max(f64::EPSILON.sqrt() * scale).max(f64::MIN_POSITIVE);
            let row = drive * (width + 1);
            stacked.view_mut((row, 0), (width + 1, width)).copy_from(&triangle.columns(0, width));
            stacked
                .view_mut((row, width + drive), (width + 1, 1))
                .copy_from(&triangle.column(width));
        }
        let r = stacked.qr().unpack_r();
        let residual = r.view((width, width), (self.drive_count, self.drive_count)).into_owned();
        let singular = residual.svd(false, true);
        let gains = singular.v_t?.row(singular.singular_values.imin()).transpose();
        let others = r.view((0, width), (width, self.drive_count)) * &gains;
        let others = r.view((0, 0), (width, width)).solve_upper_triangular(&others)?;
        let scale = self.reference.map_or_else(|| others[unknowns], |drive| gains[drive]);
        let estimate =
            TotalLeastSquares { gains: gains / scale, unknowns: others.rows(0, unknowns) / scale };
        let finite = |values: &DVector<f64>| values.iter().all(|value| value.is_finite());
        (finite(&estimate.gains) && finite(&estimate.unknowns)).then_some(estimate)
    }

    /// Returns the most probable values by Gauss–Newton steps from a start. The noise is in the
    /// torques alone, `t_k = (U_k u + l_k)/g_k + ε_k`, with one noise level per drive. The
    /// covariance is computed from the spectrum of the residuals.
    ///
    /// # Errors
    /// [`GainsError::NotIdentifiable`], [`GainsError::NotSettled`], [`GainsError::Regression`].
    pub(super) fn most_probable(
        &self,
        start: &TotalLeastSquares,
        filter: &RowFilter,
    ) -> Result<Estimate, GainsError> {
        let free = self.drives_with_free_gain();
        let n = free.len();
        let mut inverse = start.gains.map(|gain| 1.0 / gain);
        let mut unknowns = start.unknowns.clone();
        for _ in 0..MAX_STEPS {
            let system = self.linear_equation(&inverse, &unknowns, None)?;
            let solution = self.solve_linear(&system, &inverse, &unknowns)?;
            let sigma = solution.standard_deviations();
            let estimates = &solution.parameters;
            let shifts = free.iter().enumerate();
            let shifts = shifts.map(|(k, drive)| (estimates[k] - inverse[*drive]).abs() / sigma[k]);
            let largest_shift = shifts.fold(0.0, f64::max);
            free.iter().zip(estimates.iter()).for_each(|(drive, value)| inverse[*drive] = *value);
            unknowns = estimates.rows(n, estimates.len() - n).into_owned();
            if largest_shift < STEP_TOLERANCE {
                let analysis = ResidualAnalysis::new(&system, &solution, filter);
                let (mut covariance, mut values) =
                    (analysis.covariance(), solution.parameters.clone());
                if let Some(reference) = self.reference {
                    values = values.insert_row(reference, 1.0);
                    covariance =
                        covariance.insert_row(reference, 0.0).insert_column(reference, 0.0);
                }
                let residuals = self.residuals(&inverse, &unknowns);
                return Ok(Estimate { values, covariance, residuals });
            }
        }
        Err(GainsError::NotSettled { steps: MAX_STEPS })
    }

    /// Returns the distance of the configured centre of the load from the one in the records;
    /// `None` if the records do not identify it.
    pub(super) fn centre_distance(
        &self,
        estimate: &Estimate,
        filter: &RowFilter,
    ) -> Option<MahalanobisDistance> {
        let n = self.drive_count;
        let (inverse, unknowns) =
            (estimate.values.rows(0, n).into_owned(), estimate.values.rows_range(n..).into_owned());
        let moments = self.load_moments.ncols();
        let system = self.linear_equation(&inverse, &unknowns, Some(&self.load_moments)).ok()?;
        let solution = self.solve_linear(&system, &inverse, &unknowns).ok()?;
        let covariance = ResidualAnalysis::new(&system, &solution, filter).covariance();
        let first = solution.parameters.len() - moments;
        let off = solution.parameters.rows(first, moments).into_owned();
        let covariance = covariance.view((first, first), (moments, moments)).into_owned();
        MahalanobisDistance::mass_presence(&off, covariance).ok()
    }

    /// Returns the equation linearised at given values: `t + (U u)/g = p g'⁻¹ + U/g u'` with p = U
    /// u + l and the new values g' and u'. Columns of auxiliary torques are appended if given.
    fn linear_equation(
        &self,
        inverse: &DVector<f64>,
        unknowns: &DVector<f64>,
        auxiliary: Option<&DMatrix<f64>>,
    ) -> Result<Observations, GainsError> {
        let (free, rows, own) =
            (self.drives_with_free_gain(), self.rows_per_drive(), self.unknown_columns.ncols());
        let n = free.len();
        let arm = self.arm_torque(unknowns);
        let further = auxiliary.map_or(0, DMatrix::ncols);
        let mut matrix = DMatrix::zeros(arm.len(), n + own + further);
        let mut right = self.torque.clone();
        for drive in 0..self.drive_count {
            let (first, by) = (drive * rows, inverse[drive]);
            let column = free.binary_search(&drive).ok();
            if let Some(column) = column {
                matrix.view_mut((first, column), (rows, 1)).copy_from(&arm.rows(first, rows));
            }
            let of_unknowns = self.unknown_columns.rows(first, rows) * by;
            matrix.view_mut((first, n), (rows, own)).copy_from(&of_unknowns);
            if let Some(auxiliary_columns) = auxiliary {
                let auxiliary_part = auxiliary_columns.rows(first, rows) * by;
                matrix.view_mut((first, n + own), (rows, further)).copy_from(&auxiliary_part);
            }
            if column.is_some() {
                let mut right = right.rows_mut(first, rows);
                right += &of_unknowns * unknowns;
            }
        }
        Observations::new(matrix, right, self.drive_count)
            .map_err(|error| self.regression_failure(error))
    }

    /// Solves a linear equation with the noise levels of the residuals at these values.
    fn solve_linear(
        &self,
        system: &Observations,
        inverse: &DVector<f64>,
        unknowns: &DVector<f64>,
    ) -> Result<Solution, GainsError> {
        let levels = system.noise_levels(&self.residuals(inverse, unknowns));
        system.solve_weighted(&levels).map_err(|error| self.regression_failure(error))
    }

    fn residuals(&self, inverse: &DVector<f64>, unknowns: &DVector<f64>) -> DVector<f64> {
        let (rows, mut residuals) = (self.rows_per_drive(), self.arm_torque(unknowns));
        for (drive, by) in inverse.iter().enumerate() {
            residuals.rows_mut(drive * rows, rows).scale_mut(-by);
        }
        residuals + &self.torque
    }

    /// Converts a regression failure, with joints in place of the gains' column numbers.
    fn regression_failure(&self, error: RegressionError) -> GainsError {
        match error {
            RegressionError::ZeroColumns { columns }
            | RegressionError::DependentColumns { columns } => {
                let free = self.drives_with_free_gain();
                let mut drives: Vec<_> = columns.iter().filter_map(|k| free.get(*k)).collect();
                // If a parameter of the arm cannot be identified together with the gains, no gain
                // is identifiable.
                if drives.is_empty() {
                    drives = free.iter().collect();
                }
                GainsError::NotIdentifiable {
                    joints: drives.into_iter().copied().map(JointIndex::new).collect(),
                }
            }
            other => GainsError::Regression(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two drives of two unknowns, of quotients of small integers.
    fn equation() -> Equation {
        const N: usize = 40;
        let quotient = |k: usize, by: usize| (k * k * 31 + k * by) as f64 % 211.0 / 211.0 - 0.5;
        let unknown = DMatrix::from_fn(2 * N, 2, |row, column| quotient(row, 17 + 6 * column));
        let known_torque = DVector::from_fn(2 * N, |row, _| match row % N {
            of if of < N / 2 => 0.0,
            _ => quotient(row, 41),
        });
        let noise = |row: usize| 0.02 * quotient(row, 97);
        let arm = &unknown * DVector::from_vec(vec![2.0, -1.0]) + &known_torque;
        let gain = |row: usize| if row < N { 4.0 } else { 0.25 };
        let torque = DVector::from_fn(2 * N, |row, _| (arm[row] + noise(row)) / gain(row));
        let moments = DMatrix::zeros(2 * N, 0);
        Equation {
            drive_count: 2,
            torque,
            unknown_columns: unknown,
            known_torque,
            load_moments: moments,
            reference: None,
        }
    }

    /// crates/identification/tests/golden/gains.py.
    #[test]
    fn total_least_squares_are_those_of_numpy() {
        let estimate = equation().total_least_squares().unwrap();
        for (value, golden) in estimate.gains.iter().chain(&estimate.unknowns).zip(GOLDEN) {
            assert!((value / golden - 1.0).abs() < 1e-10, "{value} {golden}");
        }
    }

    const GOLDEN: [f64; 4] =
        [3.9953769997403614, 0.24926478359525472, 1.99575800255071, -0.9986364869232148];

    /// Without a load, in units of the first drive.
    #[test]
    fn without_a_scale_all_is_in_units_of_one_drive() {
        let mut equation = equation();
        for drive in 0..2 {
            let mut torque = equation.torque.rows_mut(40 * drive, 40);
            torque -= equation.known_torque.rows(40 * drive, 40) * [0.25, 4.0][drive];
        }
        (equation.known_torque, equation.reference) = (DVector::zeros(80), Some(0));
        let start = equation.total_least_squares().unwrap();
        let filter = RowFilter::new(equation.rows_per_drive(), 1.0, |_| 1.0);
        let estimate = equation.most_probable(&start, &filter).unwrap();
        for (k, value) in [1.0, 16.0, 0.5, -0.25].into_iter().enumerate() {
            assert!((estimate.values[k] / value - 1.0).abs() < 0.01, "{k}: {}", estimate.values[k]);
            let off = estimate.values[k] - value;
            let sigma = estimate.covariance[(k, k)].sqrt();
            assert!(off.abs() < 4.0 * sigma || (k == 0 && off == 0.0), "{k}: {off} {sigma}");
        }
    }

    #[test]
    fn the_noise_in_the_torques_alone_is_what_is_made_small() {
        let equation = equation();
        let start = equation.total_least_squares().unwrap();
        let filter = RowFilter::new(equation.rows_per_drive(), 1.0, |_| 1.0);
        let estimate = equation.most_probable(&start, &filter).unwrap();
        for (k, gain) in [4.0, 0.25].into_iter().enumerate() {
            let off = (estimate.values[k] - 1.0 / gain) / estimate.covariance[(k, k)].sqrt();
            assert!(off.abs() < 4.0, "{off}");
        }
    }
}
