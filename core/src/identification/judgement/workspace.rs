//! Whether an estimate is an arm wherever it may go.

use nalgebra::{Cholesky, DMatrix};

use crate::dynamics::{Model, Workspace};
use crate::numeric::{Lanes, Scalar, WIDTH};
use crate::robot::Robot;

/// Postures that are looked at.
const POSTURES: u32 = 1000;

/// Postures that go through the dynamics at once, a divisor of their number.
const TOGETHER: usize = WIDTH;

/// Bases of the low-discrepancy sequence, one per joint.
const PRIMES: [u32; crate::MAX_JOINTS] = [2, 3, 5, 7, 11, 13, 17, 19];

/// A posture \[rad or m\] within the robot's limits where the mass matrix of these standard
/// parameters is not positive definite, if one of a thousand postures is such: those of Halton's
/// sequence (*Numer. Math.* 2, 1960), which fill the workspace evenly.
pub(super) fn indefinite_posture(
    robot: &Robot,
    model: &Model,
    standard: &[f64],
) -> Option<Vec<f64>> {
    let n = robot.joints();
    let standard: Vec<_> = standard.iter().map(|&value| Lanes::constant(value)).collect();
    let mut workspace = Workspace::new();
    let mut mass = vec![Lanes::<TOGETHER>::zero(); n * n];
    (1..=POSTURES).step_by(TOGETHER).find_map(|first| {
        let limits = robot.limits().zip(PRIMES);
        let q: Vec<Lanes<TOGETHER>> = limits
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
        let indefinite = (0..TOGETHER).find(|l| Cholesky::new(mass_at(*l)).is_none())?;
        Some(q.iter().map(|q| q.0[indefinite]).collect())
    })
}

/// The digits of `index` mirrored at the point: between 0 and 1.
fn radical_inverse(mut index: u32, base: u32) -> f64 {
    let (mut value, mut place) = (0.0, 1.0);
    while index > 0 {
        place /= f64::from(base);
        value += place * f64::from(index % base);
        index /= base;
    }
    value
}
