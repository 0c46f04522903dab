//! Levenberg–Marquardt steps.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::regression::Observations;

/// Damped steps δ from one point: `(N + λ D) δ = N δ_0`, with N = ΨᵀΩ⁻¹Ψ, its diagonal D and the
/// Gauss–Newton step δ_0. The damping is relative to the lengths of the columns, so that it does
/// not depend on the units of the parameters (Marquardt, *J. SIAM* 11, 1963).
///
/// The normal matrix with columns of length 1 is accurate enough for a step. The final result comes
/// from the QR decomposition of Ψ.
pub(super) struct DampedProblem {
    /// Normal matrix with columns of length 1: D^{-1/2} N D^{-1/2}.
    normal: DMatrix<f64>,
    /// Lengths of the columns: the square roots of D.
    column_lengths: DVector<f64>,
    /// Scaled gradient D^{-1/2} N δ_0.
    gradient: DVector<f64>,
    undamped_step: DVector<f64>,
}

impl DampedProblem {
    pub(super) fn new(observations: &Observations, levels: &[f64], step: &DVector<f64>) -> Self {
        let mut columns = observations.matrix().dense();
        for (joint, level) in levels.iter().enumerate() {
            columns.rows_range_mut(observations.joint_rows(joint)).unscale_mut(*level);
        }
        // The columns have full rank, so no column is 0.
        let lengths = DVector::from_iterator(
            columns.ncols(),
            columns.column_iter().map(|column| column.norm()),
        );
        for (mut column, length) in columns.column_iter_mut().zip(lengths.iter()) {
            column.unscale_mut(*length);
        }
        let normal = columns.tr_mul(&columns);
        let gradient = &normal * step.component_mul(&lengths);
        Self { normal, column_lengths: lengths, gradient, undamped_step: step.clone() }
    }

    /// Returns the step δ for the damping λ.
    pub(super) fn step(&self, damping: f64) -> DVector<f64> {
        let mut matrix = self.normal.clone();
        for k in 0..matrix.nrows() {
            matrix[(k, k)] += damping;
        }
        match Cholesky::new(matrix) {
            Some(factor) => factor.solve(&self.gradient).component_div(&self.column_lengths),
            // A damped normal matrix can be indefinite only due to rounding.
            None => self.undamped_step.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_leads_from_the_linear_step_to_a_short_one_downhill() {
        let matrix = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, 1.0, 30.0, 0.0, 10.0, 2.0, 5.0]);
        let measured = DVector::from_vec(vec![1.0, 2.0, 3.0, 4.0]);
        let observations = Observations::new(matrix.clone(), measured.clone(), 2).unwrap();
        let levels = [0.5, 2.0];
        let linear = observations.solve_weighted(&levels).unwrap().parameters;
        let damped = DampedProblem::new(&observations, &levels, &linear);
        // No damping is the linear step, to rounding.
        assert!((damped.step(0.0) - &linear).norm() < 1e-12 * linear.norm());
        // Much damping is −gradient/(λ D).
        let weight = DVector::from_vec(vec![4.0, 4.0, 0.25, 0.25]);
        let gradient = matrix.tr_mul(&measured.component_mul(&weight));
        for (k, (step, slope)) in damped.step(1e9).iter().zip(gradient.iter()).enumerate() {
            let squares = matrix.column(k).component_mul(&matrix.column(k)).dot(&weight);
            let expected = slope / squares / 1e9;
            assert!((step / expected - 1.0).abs() < 1e-8, "{step} {expected}");
        }
    }
}
