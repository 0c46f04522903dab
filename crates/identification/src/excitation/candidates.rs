//! Candidate motions: excitations of one joint or two from a few postures, as large as the limits
//! permit.

use core::f64::consts::TAU;

use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::bounds::Bounds;
use super::error::ExcitationError;
use super::joint_excitation::{JointExcitation, JointExcitations, PEAK_SPEED};
use super::limit_kind::LimitKind;
use super::limits::DesignLimits;
use super::prediction::predicted_at;
use super::random::uniform;
use super::task::Task;
use crate::parallel::{Parallel, map};
use didim_dynamics::robot::{JointIndex, JointKind, Robot};

/// Number of start postures: the middle of the ranges, and random ones.
const START_POSTURES: usize = 4;
/// Numbers of repetitions within `DesignLimits::piece_s`, slow and fast, for one joint and for two
/// joints. The numbers of two joints are coprime, so that their combined motion does not repeat.
const REPETITIONS_OF_ONE: [usize; 4] = [1, 3, 6, 10];
const REPETITIONS_OF_TWO: [[usize; 2]; 6] = [[2, 3], [3, 2], [5, 6], [6, 5], [1, 7], [7, 1]];
/// Sample rates at which candidates are evaluated and checked against the limits \[Hz\].
const INFORMATION_HZ: f64 = 50.0;
const LIMIT_CHECK_HZ: f64 = 100.0;
/// Number of attempts with a smaller amplitude.
const AMPLITUDE_TRIALS: usize = 12;

/// Motion that can be advised.
pub(super) struct Candidate {
    pub(super) excitations: JointExcitations,
    /// Information from this motion alone.
    pub(super) information: DMatrix<f64>,
}

/// Returns all candidates within the limits.
///
/// # Errors
/// [`ExcitationError::NoExcitation`] if no candidate is within the limits.
pub(super) fn list_candidates(
    robot: &Robot,
    task: &Task,
    parallel: &dyn Parallel,
) -> Result<Vec<Candidate>, ExcitationError> {
    let joints = robot.joints();
    let grid: Vec<f64> = robot.chain().iter().map(|joint| step(joint.kind)).collect();
    let alone = (0..joints).flat_map(|j| REPETITIONS_OF_ONE.map(|times| vec![(j, times)]));
    let pairs = (0..joints).flat_map(|j| (j + 1..joints).map(move |k| (j, k)));
    let together =
        pairs.flat_map(|(j, k)| REPETITIONS_OF_TWO.map(|[own, other]| vec![(j, own), (k, other)]));
    let patterns: Vec<Vec<(usize, usize)>> = alone.chain(together).collect();
    let count = task.columns.len();
    let before = DMatrix::zeros(count, count);
    let weighed = Task {
        duration_s: DesignLimits::DEFAULT.piece_s,
        prior_information: before,
        ..task.clone()
    };
    let postures = start_postures(&task.bounds, &grid);
    let candidates = map(parallel, postures.len(), |at| -> Vec<Candidate> {
        let within = patterns.iter().filter_map(|pattern| {
            let excitations = excitations_within_limits(task, &grid, &postures[at], pattern)?;
            let information = predicted_at(&weighed, &excitations, INFORMATION_HZ);
            Some(Candidate { excitations, information })
        });
        within.collect()
    });
    let candidates: Vec<Candidate> = candidates.into_iter().flatten().collect();
    if candidates.is_empty() { Err(ExcitationError::NoExcitation) } else { Ok(candidates) }
}

/// Returns the resolution of reported positions: whole degrees or millimetres. Candidates have such
/// positions, so that the reported motion equals the checked one.
fn step(kind: JointKind) -> f64 {
    match kind {
        JointKind::Revolute => 1.0_f64.to_radians(),
        JointKind::Prismatic => 1e-3,
    }
}

fn start_postures(bounds: &Bounds, grid: &[f64]) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut sample_posture = |joint: usize, share: f64| {
        let [low, high] = bounds.range(joint);
        let place = 0.5 * (low + high) + 0.5 * share * (high - low) * uniform(&mut random);
        (place / grid[joint]).round() * grid[joint]
    };
    let share = |k: usize| if k == 0 { 0.0 } else { DesignLimits::DEFAULT.posture_range_share };
    (0..START_POSTURES)
        .map(|k| (0..grid.len()).map(|joint| sample_posture(joint, share(k))).collect())
        .collect()
}

/// Returns excitations about a posture, as large as the limits of position, speed and acceleration
/// permit, and smaller if other limits require it. Returns `None` if the arm cannot rest in the
/// posture.
fn excitations_within_limits(
    task: &Task,
    grid: &[f64],
    posture: &[f64],
    pattern: &[(usize, usize)],
) -> Option<JointExcitations> {
    let bounds = &task.bounds;
    let amplitudes: Vec<f64> = (pattern.iter())
        .map(|&(joint, times)| {
            let omega = TAU * times as f64 / DesignLimits::DEFAULT.piece_s;
            let [low, high] = bounds.range(joint);
            let most = |kind, per_way: f64| {
                bounds.joint_bound(kind, joint).map_or(f64::INFINITY, |of| of.half_range / per_way)
            };
            let speed = most(LimitKind::Speed, 0.5 * PEAK_SPEED * omega);
            let acceleration = most(LimitKind::Acceleration, omega * omega);
            DesignLimits::DEFAULT.max_limit_share * (high - low).min(speed).min(acceleration)
        })
        .collect();
    let mut factor = 1.0;
    for _ in 0..AMPLITUDE_TRIALS {
        let mut begin = posture.to_vec();
        let mut excitation_list = Vec::new();
        for (&(joint, times), amplitude) in pattern.iter().zip(&amplitudes) {
            let [low, high] = bounds.range(joint);
            let on_grid = |of: f64| of * grid[joint];
            let [first, last] = [(low / grid[joint]).ceil(), (high / grid[joint]).floor()];
            let steps = (factor * amplitude / grid[joint]).floor().min(last - first);
            if steps < 1.0 {
                return None;
            }
            let middle = (posture[joint] / grid[joint]).round();
            let first_node = (middle - (0.5 * steps).floor()).clamp(first, last - steps);
            begin[joint] = on_grid(first_node);
            excitation_list.push(JointExcitation {
                joint: JointIndex::new(joint),
                reversal_position: on_grid(first_node + steps),
                repetitions: times,
            });
        }
        let excitation_list = JointExcitations {
            duration_s: DesignLimits::DEFAULT.piece_s,
            posture: begin,
            excitations: excitation_list,
        };
        let (share, ..) = bounds.shares_along(&task.model, &excitation_list, LIMIT_CHECK_HZ);
        if share <= DesignLimits::DEFAULT.max_limit_share {
            return Some(excitation_list);
        }
        factor *= (0.95 / share).clamp(0.3, 0.95);
    }
    None
}
