//! How the acceleration changes with parameters, motion and torques.

use super::{Model, Workspace};
use crate::MAX_JOINTS;
use crate::dual::Dual;
use crate::scalar::Scalar;

/// Partial derivatives are found so many at a time; 4 and 12 take longer for six joints.
const DIRECTIONS: usize = 6;

/// Scratch memory for the variations of one model.
#[derive(Clone, Debug)]
pub(crate) struct VariationWorkspace {
    duals: Workspace<Dual<DIRECTIONS>>,
    plain: Workspace<f64>,
    parameters: Vec<Dual<DIRECTIONS>>,
    regressor: Vec<f64>,
    /// ∂τ/∂(q, q̇) of the inverse dynamic model, a row per joint.
    partials: [[f64; 2 * MAX_JOINTS]; MAX_JOINTS],
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
    pub(crate) fn new(model: &Model, parameters: &[f64]) -> Self {
        Self {
            duals: Workspace::new(),
            plain: Workspace::new(),
            parameters: parameters.iter().map(|&value| Dual::constant(value)).collect(),
            regressor: vec![0.0; model.joints() * parameters.len()],
            partials: [[0.0; 2 * MAX_JOINTS]; MAX_JOINTS],
        }
    }
}

impl Model {
    /// ∂q̈/∂θ (n × b) of the parameters in these columns, from the derivative of τ = φ θ along the
    /// motion, with the dependence of the motion on θ:
    ///
    /// M δq̈ = δτ − φ δθ − ∂(φθ)/∂q δq − ∂(φθ)/∂q̇ δq̇
    ///
    /// `solved` is where [`direct_dynamics`](Self::direct_dynamics) found this `ddq`: its mass
    /// matrix is factorised there.
    pub(crate) fn acceleration_variation(
        &self,
        ws: &mut VariationWorkspace,
        solved: &Workspace<f64>,
        columns: &[usize],
        motion: [&[f64]; 3],
        variation: Variation<'_>,
        out: &mut [f64],
    ) {
        let (n, width) = (self.joints(), columns.len());
        let [q, dq, ddq] = motion;
        self.inverse_dynamics_partials(ws, motion);
        self.regressor(&mut ws.plain, q, dq, ddq, &mut ws.regressor);
        let all = self.parameter_names().len();
        for (i, out) in out.chunks_exact_mut(width).enumerate() {
            out.copy_from_slice(&variation.torque[i * width..(i + 1) * width]);
            for (out, &column) in out.iter_mut().zip(columns) {
                *out -= ws.regressor[i * all + column];
            }
            for j in 0..n {
                let (by_q, by_dq) = (ws.partials[i][j], ws.partials[i][n + j]);
                let rows = j * width..(j + 1) * width;
                let changes =
                    (variation.position[rows.clone()].iter()).zip(&variation.velocity[rows]);
                for (out, (dq, ddq)) in out.iter_mut().zip(changes) {
                    *out -= by_q * dq + by_dq * ddq;
                }
            }
        }
        self.solve_mass(solved, width, out);
    }

    /// Fills `ws.partials` at constant q̈.
    fn inverse_dynamics_partials(&self, ws: &mut VariationWorkspace, motion: [&[f64]; 3]) {
        let n = self.joints();
        let zero = Dual::constant(0.0);
        let ([mut q, mut dq, mut ddq], mut tau) = ([[zero; MAX_JOINTS]; 3], [zero; MAX_JOINTS]);
        for first in (0..2 * n).step_by(DIRECTIONS) {
            // Directions 0 to n − 1 are positions, n to 2n − 1 velocities.
            let seed =
                |value: f64, direction: usize| Dual::variable(value, direction.wrapping_sub(first));
            for j in 0..n {
                q[j] = seed(motion[0][j], j);
                dq[j] = seed(motion[1][j], n + j);
                ddq[j] = Dual::constant(motion[2][j]);
            }
            let (q, dq, ddq, tau) = (&q[..n], &dq[..n], &ddq[..n], &mut tau[..n]);
            self.inverse_dynamics(&mut ws.duals, &ws.parameters, q, dq, ddq, tau);
            for (partials, tau) in ws.partials.iter_mut().zip(tau) {
                for (partial, slope) in partials[..2 * n].iter_mut().skip(first).zip(tau.slope) {
                    *partial = slope;
                }
            }
        }
    }
}
