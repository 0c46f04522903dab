//! Derivatives of the acceleration with respect to parameters, motion and torques.

use super::model::Model;
use super::regressor_columns::RegressorColumns;
use super::workspace::Workspace;
use crate::numeric::with_vector_instructions;

/// Scratch memory for the variations of one model.
#[derive(Clone, Debug)]
pub(crate) struct VariationWorkspace {
    columns: RegressorColumns,
    regressor: Vec<f64>,
    /// ∂τ/∂q and ∂τ/∂q̇ of the inverse dynamic model, n × n each.
    by_position: Vec<f64>,
    by_velocity: Vec<f64>,
}

/// Variations of a motion with b parameters, each n × b, a row per joint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variation<'a> {
    /// ∂q/∂θ.
    pub(crate) position: &'a [f64],
    /// ∂q̇/∂θ.
    pub(crate) velocity: &'a [f64],
    /// ∂τ/∂θ.
    pub(crate) torque: &'a [f64],
}

impl VariationWorkspace {
    /// Prepares the derivatives with respect to the parameters in these columns.
    pub(crate) fn new(model: &Model, columns: &[usize]) -> Self {
        let n = model.joints();
        Self {
            columns: model.regressor_columns(columns),
            regressor: vec![0.0; n * columns.len()],
            by_position: vec![0.0; n * n],
            by_velocity: vec![0.0; n * n],
        }
    }
}

impl Model {
    /// Computes ∂q̈/∂θ (n × b) for the parameters of the workspace. It follows from the derivative
    /// of τ = φ θ along the motion (q, q̇, q̈), which itself depends on θ:
    ///
    /// M δq̈ = δτ − φ δθ − ∂(φθ)/∂q δq − ∂(φθ)/∂q̇ δq̇
    ///
    /// `solved` is the workspace in which [`direct_dynamics`](Self::direct_dynamics) computed this
    /// q̈ with these `parameters`. It contains the poses of the links and the factorised mass
    /// matrix.
    pub(crate) fn acceleration_variation(
        &self,
        ws: &mut VariationWorkspace,
        solved: &mut Workspace<f64>,
        parameters: &[f64],
        [q, dq, ddq]: [&[f64]; 3],
        variation: Variation<'_>,
        out: &mut [f64],
    ) {
        let VariationWorkspace { columns, regressor, by_position, by_velocity } = ws;
        self.partials_of_poses(solved, parameters, [q, dq, ddq], by_position, by_velocity);
        let loads = self.loads(&solved.poses, Some(parameters), q);
        self.regressor_of_poses(solved, columns, loads.as_ref(), dq, ddq, regressor);
        self.add_load_sensitivities(solved, columns, parameters, [q, dq], regressor);
        // A row has one entry per parameter, which suits vector instructions.
        with_vector_instructions(
            #[inline(always)]
            || {
                let (n, width) = (self.joints(), columns.width());
                for (i, out) in out.chunks_exact_mut(width).enumerate() {
                    let row = i * width..(i + 1) * width;
                    for ((out, torque), entry) in
                        out.iter_mut().zip(&variation.torque[row.clone()]).zip(&regressor[row])
                    {
                        *out = torque - entry;
                    }
                    for j in 0..n {
                        let (by_q, by_dq) = (by_position[i * n + j], by_velocity[i * n + j]);
                        // Many torques do not depend on the joint at all.
                        if by_q == 0.0 && by_dq == 0.0 {
                            continue;
                        }
                        let rows = j * width..(j + 1) * width;
                        let changes = (variation.position[rows.clone()].iter())
                            .zip(&variation.velocity[rows]);
                        for (out, (dq, ddq)) in out.iter_mut().zip(changes) {
                            *out -= by_q * dq + by_dq * ddq;
                        }
                    }
                }
                self.solve_mass(solved, width, out);
            },
        );
    }
}
