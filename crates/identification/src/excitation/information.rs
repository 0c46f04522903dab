//! Information about the parameters that a motion provides.

use nalgebra::DMatrix;

use super::basis::{Motion, column};
use crate::regression::symmetric_product;
use crate::signal::Group;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, RegressorColumns, Workspace};
use didim_dynamics::numeric::{Lanes, Scalar, WIDTH};

/// Computes the information matrix M = M₀ + Σ Yᵀ W Y over the samples of a motion (b × b), and the
/// gradient of a function of M.
pub(super) struct Information {
    model: Model,
    columns: Vec<usize>,
    regressor_entries: RegressorColumns,
    prior_information: DMatrix<f64>,
    workspace: Workspace<f64>,
    parallel_workspace: Workspace<Group>,
    joints: Vec<JointRows>,
    /// Buffer for the regressor at some samples.
    entries: Vec<Group>,
}

/// Rows of one joint.
struct JointRows {
    /// √W: root of the weight of the rows.
    weight: f64,
    /// Selected columns that act on the joint, as indices of `Information::columns`. The columns of
    /// a load are those of the last link, which may be selected already.
    acting: Vec<usize>,
    /// Entry of the regressor of each.
    entries: Vec<usize>,
    /// Weighted rows of all samples (N × acting columns).
    rows: DMatrix<f64>,
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
        let regressor_entries = model.regressor_entries(&once);
        let joints = weights.into_iter().enumerate().map(|(joint, weight)| {
            let mut entry_of = vec![None; once.len()];
            for (entry, (of_joint, column)) in regressor_entries.entries().iter().enumerate() {
                if *of_joint == joint {
                    entry_of[*column] = Some(entry);
                }
            }
            let entry = |column: &usize| entry_of[once.partition_point(|own| own < column)];
            let acts = |k: usize| Some((k, entry(&columns[k])?));
            let (acting, entries) = (0..columns.len()).filter_map(acts).unzip();
            JointRows { weight, acting, entries, rows: DMatrix::zeros(0, 0) }
        });
        let joints = joints.collect();
        let entries = vec![Lanes::zero(); regressor_entries.entries().len()];
        let (workspace, parallel_workspace) = (Workspace::new(), Workspace::new());
        Self {
            model,
            columns,
            regressor_entries,
            prior_information: before,
            workspace,
            parallel_workspace,
            joints,
            entries,
        }
    }

    /// Returns the information matrix of a motion. Its rows are stored for the
    /// [gradient](Self::add_gradient).
    pub(super) fn weighted_regressor(&mut self, [q, dq, ddq, _]: &Motion) -> DMatrix<f64> {
        let (n, samples) = q.shape();
        for of in &mut self.joints {
            if of.rows.nrows() != samples {
                of.rows = DMatrix::zeros(samples, of.acting.len());
            }
        }
        let mut states = [[Lanes::zero(); MAX_JOINTS]; 3];
        for first in (0..samples).step_by(WIDTH) {
            for (to, from) in states.iter_mut().zip([q, dq, ddq]) {
                for (joint, to) in to[..n].iter_mut().enumerate() {
                    *to = Lanes::from_fn(|l| from[(joint, (first + l).min(samples - 1))]);
                }
            }
            let [q, dq, ddq] = states.each_ref().map(|of| &of[..n]);
            self.model.selected_regressor(
                &mut self.parallel_workspace,
                &self.regressor_entries,
                q,
                dq,
                ddq,
                &mut self.entries,
            );
            let count = WIDTH.min(samples - first);
            for JointRows { weight, entries, rows, .. } in &mut self.joints {
                for (entry, to) in entries.iter().zip(rows.as_mut_slice().chunks_mut(samples)) {
                    let weighted = self.entries[*entry] * Lanes::constant(*weight);
                    to[first..first + count].copy_from_slice(&weighted.0[..count]);
                }
            }
        }
        let mut information = self.prior_information.clone();
        for JointRows { acting, rows, .. } in &self.joints {
            let gram = symmetric_product(rows, rows);
            for (own, column) in gram.column_iter().zip(acting) {
                for (value, row) in own.iter().zip(acting) {
                    information[(*row, *column)] += value;
                }
            }
        }
        information
    }

    /// Returns the weighted rows of a motion, sample after sample (nN × b).
    pub(super) fn rows(&mut self, motion: &Motion) -> DMatrix<f64> {
        self.weighted_regressor(motion);
        let (n, samples) = motion[0].shape();
        let mut all = DMatrix::zeros(n * samples, self.columns.len());
        for (joint, JointRows { acting, rows, .. }) in self.joints.iter().enumerate() {
            for (values, column) in rows.column_iter().zip(acting) {
                for (i, value) in values.iter().enumerate() {
                    all[(i * n + joint, *column)] = *value;
                }
            }
        }
        all
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
        let of_joint = |of: &JointRows| {
            2.0 * of.weight * slope.select_columns(&of.acting) * of.rows.transpose()
        };
        let along: Vec<DMatrix<f64>> = self.joints.iter().map(of_joint).collect();
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
            for (j, along) in along.iter().enumerate() {
                parameters.fill(0.0);
                for (place, value) in self.columns.iter().zip(column(along, i)) {
                    parameters[*place] += value;
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
