//! Inertia that a joint's controller has to move, and inertia that is added to make an arm
//! simulable.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::identification::problem::Context;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::{JointIndex, JointKind, ParameterKind, Robot};

/// Smallest inertia of a joint, relative to the largest. An intermediate estimate may have a joint
/// without inertia, but gains that follow the inertia must not vanish.
const MIN_INERTIA_SHARE: f64 = 1e-3;

/// Smallest added share of the inertia of the links in [`missing_inertia`]. It doubles from one
/// trial to the next.
const MIN_ADDED_INERTIA: f64 = 1e-3;
const MAX_TRIALS: i32 = 40;

/// Returns the inertia J_j of every joint \[kg·m², or kg of a prismatic one\] while the other
/// joints move freely: 1/(M⁻¹)_jj. (M⁻¹)_jj is averaged over the given postures (postures × joints)
/// with these standard parameters. An inertia is at least 1e-3 of the largest one. Postures where M
/// is not positive definite are ignored.
///
/// A separate position loop for every joint, tuned with this inertia, has at most √n times its
/// tuned bandwidth, for any coupling of the joints. The reason is that the eigenvalues of M⁻¹
/// diag(J) are positive, and their sum is n.
///
/// # Panics
/// When parameters or postures are not of the model's size.
pub fn mean_joint_inertia(model: &Model, parameters: &[f64], postures: &DMatrix<f64>) -> Vec<f64> {
    let n = model.joints();
    let (mut mobility, mut counted) = (DVector::zeros(n), 0.0);
    for_each_mass_matrix(model, parameters, postures, |mass| {
        if let Some(factor) = Cholesky::<f64, Dyn>::new(mass.clone()) {
            mobility += factor.inverse().diagonal();
            counted += 1.0;
        }
    });
    let inertia = mobility.map(|sum| counted / sum);
    let floor = MIN_INERTIA_SHARE * inertia.iter().copied().fold(0.0, f64::max);
    inertia.iter().map(|inertia| inertia.max(floor)).collect()
}

/// Returns the addition to the selected parameters that makes the mass matrix positive definite in
/// all of these postures (postures × joints), with a margin. Returns zeros if the mass matrix is
/// already positive definite with this margin.
///
/// Every link gets a share of its joint's mean inertia, in the form of a ball at its origin. This
/// makes the mass matrix of any arm positive definite if the inertias are selected. Without it,
/// least squares may give links a negative inertia, which nothing compensates for without drive
/// inertias.
pub(super) fn missing_inertia(
    context: &Context<'_>,
    parameters: &DVector<f64>,
    postures: &DMatrix<f64>,
) -> DVector<f64> {
    let Context { robot, base, selection, model, .. } = context;
    let mut diagonal = DVector::zeros(robot.joints());
    for_each_mass_matrix(model, &selection.to_standard(parameters), postures, |mass| {
        diagonal += mass.diagonal().abs() / postures.nrows() as f64;
    });
    let floor = MIN_INERTIA_SHARE * diagonal.max();
    let mut balls = vec![0.0; robot.parameters().parameters().len()];
    for (joint, own) in diagonal.iter().enumerate() {
        ball_columns(robot, joint).for_each(|column| balls[column] = own.max(floor));
    }
    let balls = selection.of_base(base, &base.to_base(&balls));
    let definite = |parameters: &DVector<f64>| {
        let mut is_positive = true;
        for_each_mass_matrix(model, &selection.to_standard(parameters), postures, |mass| {
            is_positive = is_positive && Cholesky::<f64, Dyn>::new(mass.clone()).is_some();
        });
        is_positive
    };
    // Checks the smallest added share as a margin.
    let enough = |added: f64, share: f64| definite(&(parameters + &balls * (added * share)));
    if enough(MIN_ADDED_INERTIA, -1.0) {
        return DVector::zeros(parameters.len());
    }
    let mut trials = (0..MAX_TRIALS).map(|trial| MIN_ADDED_INERTIA * 2.0_f64.powi(trial));
    // If inertias are not selected, the mass matrix may never become positive definite; the
    // simulation then reports the error.
    let added = trials.find(|added| enough(*added, 0.5)).unwrap_or(0.0);
    balls * added
}

/// Returns the columns of the standard parameters of a ball at the origin of a joint's link, as far
/// as the joint moves them: the inertia about every axis, or the mass for a prismatic joint.
pub(super) fn ball_columns(robot: &Robot, joint: usize) -> impl Iterator<Item = usize> + '_ {
    use ParameterKind::{M, Xx, Yy, Zz};
    let kinds: &[ParameterKind] = match robot.chain()[joint].kind {
        JointKind::Revolute => &[Xx, Yy, Zz],
        JointKind::Prismatic => &[M],
    };
    kinds.iter().filter_map(move |kind| robot.parameters().column(*kind, JointIndex::new(joint)))
}

/// Calls `each` with the mass matrix in every posture.
fn for_each_mass_matrix(
    model: &Model,
    parameters: &[f64],
    postures: &DMatrix<f64>,
    mut each: impl FnMut(&DMatrix<f64>),
) {
    let n = model.joints();
    let mut workspace = Workspace::new();
    let mut mass = DMatrix::zeros(n, n);
    let mut q = [0.0; MAX_JOINTS];
    for posture in postures.row_iter() {
        for (q, value) in q.iter_mut().zip(posture.iter()) {
            *q = *value;
        }
        model.mass_matrix(&mut workspace, parameters, &q[..n], mass.as_mut_slice());
        each(&mass);
    }
}
