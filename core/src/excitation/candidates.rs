//! Swings of one joint or two, from a few postures, each as far as the limits allow.

use core::f64::consts::TAU;

use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::bounds::Bounds;
use super::error::ExcitationError;
use super::limit_kind::LimitKind;
use super::random::uniform;
use super::swing::{SPEED, Swing, Swings};
use super::task::Task;
use super::told::told_at;
use crate::robot::{JointKind, Robot};

/// Length of a candidate \[s\].
pub(super) const PIECE_S: f64 = 5.0;
/// Postures that joints swing from: the middle of the ranges, and random ones.
const POSTURES: usize = 4;
/// Part of the range about its middle where random postures are.
const NEAR: f64 = 0.6;
/// Swings in [`PIECE_S`], slow and fast, of one joint; and of two, which never repeat together.
const ALONE: [usize; 4] = [1, 3, 6, 10];
const TOGETHER: [[usize; 2]; 6] = [[2, 3], [3, 2], [5, 6], [6, 5], [1, 7], [7, 1]];
/// Samples per second that candidates are weighed by, and held to the limits by \[Hz\].
const WEIGHED_HZ: f64 = 50.0;
const HELD_HZ: f64 = 100.0;
/// What is left of the limits for what lies between those samples.
const MOST_SHARE: f64 = 0.985;
/// Trials of a smaller swing.
const TRIALS: usize = 12;

/// A motion that may be advised.
pub(super) struct Candidate {
    pub(super) swings: Swings,
    /// What it tells, by itself.
    pub(super) information: DMatrix<f64>,
}

/// All within the limits.
///
/// # Errors
/// [`ExcitationError::NoSwing`] where there are none.
pub(super) fn candidates(robot: &Robot, task: &Task) -> Result<Vec<Candidate>, ExcitationError> {
    let joints = robot.joints();
    let grid: Vec<f64> = robot.chain().iter().map(|joint| step(joint.kind)).collect();
    let alone = (0..joints).flat_map(|j| ALONE.map(|times| vec![(j, times)]));
    let pairs = (0..joints).flat_map(|j| (j + 1..joints).map(move |k| (j, k)));
    let together = pairs.flat_map(|(j, k)| TOGETHER.map(|[own, other]| vec![(j, own), (k, other)]));
    let patterns: Vec<Vec<(usize, usize)>> = alone.chain(together).collect();
    let count = task.columns.len();
    let before = DMatrix::zeros(count, count);
    let weighed = Task { duration_s: PIECE_S, before, ..task.clone() };
    let mut found = Vec::new();
    for posture in postures(&task.bounds, &grid) {
        for pattern in &patterns {
            let Some(swings) = within(task, &grid, &posture, pattern) else { continue };
            let information = told_at(&weighed, &swings.series(), WEIGHED_HZ);
            found.push(Candidate { swings, information });
        }
    }
    if found.is_empty() { Err(ExcitationError::NoSwing) } else { Ok(found) }
}

/// What positions are said in: whole degrees or millimetres, so that what is said is what was tried.
fn step(kind: JointKind) -> f64 {
    match kind {
        JointKind::Revolute => 1.0_f64.to_radians(),
        JointKind::Prismatic => 1e-3,
    }
}

fn postures(bounds: &Bounds, grid: &[f64]) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut at = |joint: usize, share: f64| {
        let [low, high] = bounds.range(joint);
        let place = 0.5 * (low + high) + 0.5 * share * (high - low) * uniform(&mut random);
        (place / grid[joint]).round() * grid[joint]
    };
    let share = |k: usize| if k == 0 { 0.0 } else { NEAR };
    (0..POSTURES).map(|k| (0..grid.len()).map(|joint| at(joint, share(k))).collect()).collect()
}

/// Swings about a posture, as far as position, speed and acceleration allow, and smaller where more is
/// beyond a limit; nothing where the arm cannot even rest.
fn within(
    task: &Task,
    grid: &[f64],
    posture: &[f64],
    pattern: &[(usize, usize)],
) -> Option<Swings> {
    let bounds = &task.bounds;
    let ways: Vec<f64> = (pattern.iter())
        .map(|&(joint, times)| {
            let omega = TAU * times as f64 / PIECE_S;
            let [low, high] = bounds.range(joint);
            let most = |kind, per_way: f64| {
                bounds.own(kind, joint).map_or(f64::INFINITY, |of| of.half / per_way)
            };
            let speed = most(LimitKind::Speed, 0.5 * SPEED * omega);
            let acceleration = most(LimitKind::Acceleration, omega * omega);
            MOST_SHARE * (high - low).min(speed).min(acceleration)
        })
        .collect();
    let mut factor = 1.0;
    for _ in 0..TRIALS {
        let mut begin = posture.to_vec();
        let mut swings = Vec::new();
        for (&(joint, times), way) in pattern.iter().zip(&ways) {
            let [low, high] = bounds.range(joint);
            let whole = |of: f64| of * grid[joint];
            let [first, last] = [(low / grid[joint]).ceil(), (high / grid[joint]).floor()];
            let steps = (factor * way / grid[joint]).floor().min(last - first);
            if steps < 1.0 {
                return None;
            }
            let middle = (posture[joint] / grid[joint]).round();
            let from = (middle - (0.5 * steps).floor()).clamp(first, last - steps);
            begin[joint] = whole(from);
            swings.push(Swing { joint, to: whole(from + steps), times });
        }
        let swings = Swings { duration_s: PIECE_S, posture: begin, swings };
        let (share, ..) = bounds.share(&task.model, &swings.series(), HELD_HZ);
        if share <= MOST_SHARE {
            return Some(swings);
        }
        factor *= (0.95 / share).clamp(0.3, 0.95);
    }
    None
}
