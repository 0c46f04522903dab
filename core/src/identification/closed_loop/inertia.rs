//! The inertia that a joint's controller has to move.

use nalgebra::DMatrix;

use crate::MAX_JOINTS;
use crate::dynamics::{Model, Workspace};

/// Smallest inertia of a joint, as a share of the largest: an estimate on its way may have none,
/// and gains that follow it must not vanish.
const SMALLEST_SHARE: f64 = 1e-3;

/// The inertia J_j of every joint \[kg·m², or kg of a prismatic one\]: the mean of the diagonal
/// entry M_jj(q) of the mass matrix with these standard parameters over the given postures
/// (postures × joints), and at least 1e-3 of the largest joint's.
///
/// # Panics
/// When parameters or postures are not of the model's size.
pub fn mean_joint_inertia(model: &Model, parameters: &[f64], postures: &DMatrix<f64>) -> Vec<f64> {
    let n = model.joints();
    let mut workspace = Workspace::new();
    let mut mass = vec![0.0; n * n];
    let mut q = [0.0; MAX_JOINTS];
    let mut mean = vec![0.0; n];
    for posture in postures.row_iter() {
        for (q, value) in q.iter_mut().zip(posture.iter()) {
            *q = *value;
        }
        model.mass_matrix(&mut workspace, parameters, &q[..n], &mut mass);
        for (mean, diagonal) in mean.iter_mut().zip(mass.iter().step_by(n + 1)) {
            *mean += diagonal / postures.nrows() as f64;
        }
    }
    let floor = SMALLEST_SHARE * mean.iter().copied().fold(0.0, f64::max);
    mean.iter().map(|inertia| inertia.max(floor)).collect()
}
