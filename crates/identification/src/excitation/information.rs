//! Information about the parameters that a motion provides.

use nalgebra::DMatrix;

use super::basis::{Motion, column};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, RegressorColumns, Workspace};

/// Computes the information matrix M = M₀ + Σ Yᵀ W Y over the samples of a motion (b × b), and the
/// gradient of a function of M.
pub(super) struct Information {
    model: Model,
    columns: Vec<usize>,
    regressor_columns: RegressorColumns,
    /// Index of each selected column among the computed regressor columns. The columns of a load
    /// are those of the last link, which may be selected already.
    column_indices: Vec<usize>,
    prior_information: DMatrix<f64>,
    /// √W: root of the row weight of each joint.
    weights: Vec<f64>,
    workspace: Workspace<f64>,
    /// Weighted rows of all samples, b × nN, and the buffer for one row of the regressor.
    rows: DMatrix<f64>,
    row: Vec<f64>,
}

impl Information {
    /// Creates the information of the parameters with these regressor columns. `before` is the
    /// prior information (b × b), `weights` are the square roots of the row weight of each joint.
    /// Rows of joints without a recorded torque have no weight.
    pub(super) fn new(
        model: Model,
        columns: Vec<usize>,
        before: DMatrix<f64>,
        mut weights: Vec<f64>,
    ) -> Self {
        for joint in model.missing_torques() {
            weights[*joint] = 0.0;
        }
        let mut once = columns.clone();
        once.sort_unstable();
        once.dedup();
        let places =
            columns.iter().map(|column| once.partition_point(|own| own < column)).collect();
        let selected = model.regressor_columns(&once);
        let row = vec![0.0; model.joints() * once.len()];
        let rows = DMatrix::zeros(0, 0);
        let workspace = Workspace::new();
        Self {
            model,
            columns,
            regressor_columns: selected,
            column_indices: places,
            prior_information: before,
            weights,
            workspace,
            rows,
            row,
        }
    }

    /// Returns the information matrix of a motion. Its rows are stored for the
    /// [gradient](Self::add_gradient).
    pub(super) fn weighted_regressor(&mut self, [q, dq, ddq, _]: &Motion) -> DMatrix<f64> {
        let (n, width, samples) = (q.nrows(), self.columns.len(), q.ncols());
        if self.rows.ncols() != n * samples {
            self.rows = DMatrix::zeros(width, n * samples);
        }
        for i in 0..samples {
            self.model.selected_regressor(
                &mut self.workspace,
                &self.regressor_columns,
                column(q, i),
                column(dq, i),
                column(ddq, i),
                &mut self.row,
            );
            let rows = self.row.chunks_exact(self.regressor_columns.width());
            for (j, (row, weight)) in rows.zip(&self.weights).enumerate() {
                let mut target = self.rows.column_mut(i * n + j);
                target
                    .iter_mut()
                    .zip(&self.column_indices)
                    .for_each(|(to, place)| *to = weight * row[*place]);
            }
        }
        &self.prior_information + &self.rows * self.rows.transpose()
    }

    /// Returns the weighted rows of a motion, sample after sample (nN × b).
    pub(super) fn rows(&mut self, motion: &Motion) -> DMatrix<f64> {
        self.weighted_regressor(motion);
        self.rows.transpose()
    }

    /// Adds the gradient of a function f of M along the motion for which M was last computed.
    /// `slope` is symmetric with df = tr(slope dM).
    ///
    /// df = Σ tr(2 slope Yᵀ W dY). For each row j of a sample, this is the change of τ_j with row j
    /// of 2 W Y slope as parameters.
    pub(super) fn add_gradient(
        &mut self,
        slope: &DMatrix<f64>,
        [q, dq, ddq, _]: &Motion,
        by_motion: &mut Motion,
    ) {
        let n = q.nrows();
        let along = 2.0 * slope * &self.rows;
        let mut parameters = vec![0.0; self.model.parameter_names().len()];
        let nothing = parameters.clone();
        let zeros = [0.0; MAX_JOINTS * MAX_JOINTS];
        let (mut known_torque, mut partials) = ([zeros; 2], [zeros; 3]);
        let [of_known, unused] = &mut known_torque;
        let [by_q, by_dq, by_ddq] = &mut partials;
        for i in 0..q.ncols() {
            let [q, dq, ddq] = [q, dq, ddq].map(|of| column(of, i));
            let (ws, model) = (&mut self.workspace, &self.model);
            // Known torques are those of the model with all parameters at 0.
            let (of_known, unused) = (&mut of_known[..n * n], &mut unused[..n * n]);
            model.inverse_dynamics_partials(ws, &nothing, q, dq, ddq, of_known, unused);
            for j in 0..n {
                let row = column(&along, i * n + j);
                parameters.fill(0.0);
                for (column, value) in self.columns.iter().zip(row) {
                    parameters[*column] += self.weights[j] * value;
                }
                let (by_q, by_dq) = (&mut by_q[..n * n], &mut by_dq[..n * n]);
                let by_ddq = &mut by_ddq[..n * n];
                model.inverse_dynamics_partials(ws, &parameters, q, dq, ddq, by_q, by_dq);
                model.mass_matrix(ws, &parameters, q, by_ddq);
                for k in 0..n {
                    let entry = j * n + k;
                    by_motion[0][(k, i)] += by_q[entry] - of_known[entry];
                    by_motion[1][(k, i)] += by_dq[entry];
                    by_motion[2][(k, i)] += by_ddq[entry];
                }
            }
        }
    }
}
