//! Check that an estimate's mass matrix is positive definite over the workspace.

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use crate::identification::observation::{Motion, regressor_rows};
use crate::identification::problem::{IdentificationError, Selection};
use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::numeric::{Lanes, Scalar, WIDTH};
use didim_dynamics::robot::Robot;

/// Number of tried postures.
const POSTURE_COUNT: u32 = 1000;

/// Largest number of examined postures with an indefinite mass matrix: those with the smallest
/// eigenvalues.
const MAX_EXAMINED_POSTURES: usize = 128;

/// Number of postures per evaluation of the dynamics; it divides the number of tried postures.
const POSTURES_AT_ONCE: usize = WIDTH;

/// Bases of the low-discrepancy sequence, one per joint.
const SEQUENCE_BASES: [u32; didim_dynamics::MAX_JOINTS] =
    [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];

/// Posture where the mass matrix is not positive definite.
pub(super) struct Indefinite {
    /// The posture \[rad or m\].
    pub(super) posture: Vec<f64>,
    /// Distance of its smallest eigenvalue below zero, in standard deviations of the eigenvalue.
    pub(super) deviations: f64,
}

/// Returns the posture within the robot's limits where the mass matrix of these parameters is
/// furthest from positive definite, relative to the statistical uncertainty. It tries a thousand
/// postures of Halton's sequence (*Numer. Math.* 2, 1960), which fills the workspace evenly. It
/// examines the 128 postures with the most negative eigenvalues. Returns `None` if the mass matrix
/// is positive definite in all tried postures.
pub(super) fn indefinite_posture(
    robot: &Robot,
    model: &Model,
    selection: &Selection,
    parameters: &DVector<f64>,
    covariance: &DMatrix<f64>,
) -> Result<Option<Indefinite>, IdentificationError> {
    let mut postures: Vec<_> =
        indefinite_postures(robot, model, &selection.to_standard(parameters))
            .into_iter()
            .map(|(posture, mass)| {
                let eigen = SymmetricEigen::new(mass);
                let (index, value) = eigen.eigenvalues.argmin();
                let direction: DVector<f64> = eigen.eigenvectors.column(index).into_owned();
                (posture, value, direction)
            })
            .collect();
    postures.sort_by(|(_, one, _), (_, other, _)| one.total_cmp(other));
    postures.truncate(MAX_EXAMINED_POSTURES);
    // The eigenvalue is vᵀ M v, linear in the parameters: vᵀ (τ(q, 0, v) − τ(q, 0, 0)).
    let (count, n) = (postures.len(), robot.joints());
    let twice = |of: &dyn Fn(usize, usize) -> f64| DMatrix::from_fn(2 * count, n, of);
    let states = Motion::from_matrices(
        twice(&|row, joint| postures[row % count].0[joint]),
        DMatrix::zeros(2 * count, n),
        twice(&|row, joint| if row < count { postures[row].2[joint] } else { 0.0 }),
    );
    let rows = regressor_rows(model, selection.columns(), &states)?;
    let mut worst: Option<Indefinite> = None;
    for (k, (posture, value, direction)) in postures.into_iter().enumerate() {
        let mut along = DVector::zeros(parameters.len());
        for (joint, share) in direction.iter().enumerate() {
            let first = 2 * count * joint + k;
            let difference = rows.row(first) - rows.row(first + count);
            along.axpy(*share, &difference.transpose(), 1.0);
        }
        let variance = along.dot(&(covariance * &along));
        let deviations = -value / variance.sqrt();
        let further = |worst: &Indefinite| deviations.is_nan() || deviations > worst.deviations;
        if worst.as_ref().is_none_or(further) {
            worst = Some(Indefinite { posture, deviations });
        }
    }
    Ok(worst)
}

/// Returns the postures where the mass matrix of these standard parameters is not positive
/// definite, with their matrices.
fn indefinite_postures(
    robot: &Robot,
    model: &Model,
    standard: &[f64],
) -> Vec<(Vec<f64>, DMatrix<f64>)> {
    let n = robot.joints();
    let standard: Vec<_> = standard.iter().map(|&value| Lanes::constant(value)).collect();
    let mut workspace = Workspace::new();
    let mut mass = vec![Lanes::<POSTURES_AT_ONCE>::zero(); n * n];
    let mut postures = Vec::new();
    for first in (1..=POSTURE_COUNT).step_by(POSTURES_AT_ONCE) {
        let limits = robot.limits().zip(SEQUENCE_BASES);
        let q: Vec<Lanes<POSTURES_AT_ONCE>> = limits
            .map(|(limit, prime)| {
                let mut indices = first..;
                Lanes::from_fn(|_| {
                    let share = indices.next().map_or(0.0, |index| radical_inverse(index, prime));
                    limit.position_min + share * (limit.position_max - limit.position_min)
                })
            })
            .collect();
        model.mass_matrix(&mut workspace, &standard, &q, &mut mass);
        let mass_at = |l: usize| DMatrix::from_fn(n, n, |i, j| mass[i * n + j].0[l]);
        for l in (0..POSTURES_AT_ONCE).filter(|l| Cholesky::new(mass_at(*l)).is_none()) {
            postures.push((q.iter().map(|q| q.0[l]).collect(), mass_at(l)));
        }
    }
    postures
}

/// Returns the number between 0 and 1 whose digits are those of `index`, mirrored at the radix
/// point.
fn radical_inverse(mut index: u32, base: u32) -> f64 {
    let (mut value, mut place) = (0.0, 1.0);
    while index > 0 {
        place /= f64::from(base);
        value += place * f64::from(index % base);
        index /= base;
    }
    value
}
