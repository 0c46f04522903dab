//! What a result lacks, in motions that words can say.

use nalgebra::{DMatrix, DVector};

use super::candidates::{Candidate, PIECE_S, candidates};
use super::design::{CHECK_HZ, Design};
use super::error::ExcitationError;
use super::objective::{Objective, covariance};
use super::swing::Swings;
use super::task::Task;
use super::told;
use crate::robot::Robot;

/// Pieces of advice at most: beyond them a designed motion is the shorter way.
const MOST_PIECES: usize = 4;
/// How many times a candidate a piece may take, the shortest first.
const LENGTHS: [usize; 3] = [1, 2, 4];
/// Part of what is enough of which less is worth nothing.
const NEED: f64 = 1.0 / 3.0;
/// A piece that makes the wanted deviations less than so many times smaller is not worth its time.
const LEAST_GAIN: f64 = 1.1;

/// A motion that brings what a result lacks.
#[derive(Clone, Debug, PartialEq)]
pub struct Advised {
    /// The motion in words.
    pub swings: Swings,
    /// The same as a designed one, with how much of each limit it uses.
    pub design: Design,
    /// Standard deviation of each parameter with this motion, those before it and what is known already.
    pub deviations: Vec<f64>,
}

/// What a result lacks, and what brings it.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// Standard deviation of each parameter now.
    pub deviations: Vec<f64>,
    /// Parameters, by their place, whose deviation is more than enough, and which some motion can tell.
    pub lacking: Vec<usize>,
    /// Those that no motion tells well enough, even if all others were known: they make too little torque.
    pub small: Vec<usize>,
    /// One after the other.
    pub pieces: Vec<Advised>,
    /// How uncertain the parameters leave the torques, relative to these, over all motions that were tried and weighted by
    /// noise: now, and with all pieces.
    pub torque: [f64; 2],
}

/// Says which motions tell what a result lacks: of each parameter a deviation of `enough` relative to its value is enough. All
/// that is said was tried: each motion is within the limits, and its deviations are foretold as those of a designed one.
///
/// The task's `before` has to be the information of the result; its duration and aim count nothing.
///
/// # Errors
/// [`ExcitationError::NotTold`] where the result leaves a parameter open, [`ExcitationError::NoSwing`].
pub fn advise(
    robot: &Robot,
    task: &Task,
    values: &[f64],
    enough: f64,
) -> Result<Advice, ExcitationError> {
    let untold = ExcitationError::NotTold { duration_s: PIECE_S };
    let mut tried = candidates(robot, task)?;
    let deviations = of(&task.before).ok_or(untold)?;
    let count = deviations.len();
    let enough: Vec<f64> = values.iter().map(|value| enough * value.abs()).collect();
    let longest = LENGTHS[LENGTHS.len() - 1] as f64;
    let most = |k: usize| {
        let of_motion = tried.iter().map(|of| of.information[(k, k)]).fold(0.0, f64::max);
        task.before[(k, k)] + MOST_PIECES as f64 * longest * of_motion
    };
    let (small, lacking): (Vec<usize>, Vec<usize>) = (0..count)
        .filter(|&k| deviations[k] > enough[k])
        .partition(|&k| most(k) * enough[k].powi(2) < 1.0);
    let sum = tried.iter().fold(DMatrix::zeros(count, count), |sum, of| sum + &of.information);
    let mut information = task.before.clone();
    let mut pieces: Vec<Advised> = Vec::new();
    let mut now = deviations.clone();
    while pieces.len() < MOST_PIECES {
        let wanted: Vec<(usize, f64)> = (lacking.iter())
            .filter(|&&k| now[k] > enough[k])
            .map(|&k| (k, NEED * enough[k]))
            .collect();
        if wanted.is_empty() {
            break;
        }
        let objective = Objective::Deviations(wanted.clone());
        let with = |of: &Candidate, times: f64| &information + times * &of.information;
        let value = |of: &Candidate| objective.of(&with(of, longest)).map(|(value, _)| value);
        let best = tried.iter().enumerate().filter_map(|(at, of)| Some((at, value(of)?)));
        let Some((at, value)) = best.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let gain = objective.of(&information).map_or(f64::INFINITY, |(now, _)| now - value);
        if gain < LEAST_GAIN.ln() {
            break;
        }
        let best = tried.swap_remove(at);
        // The shortest that brings what the longest would.
        let brought = |times: usize| {
            let then = of(&with(&best, times as f64));
            then.map(|then| wanted.iter().filter(|&&(k, _)| then[k] <= enough[k]).count())
        };
        let all = brought(LENGTHS[LENGTHS.len() - 1]);
        let shortest = LENGTHS.iter().find(|times| all > Some(0) && brought(**times) == all);
        let swings = best.swings.repeated(*shortest.unwrap_or(&LENGTHS[LENGTHS.len() - 1]));
        let series = swings.series();
        let (share, used, nearest) = task.bounds.share(&task.model, &series, CHECK_HZ);
        if share > 1.0 {
            continue;
        }
        let duration_s = series.duration_s;
        let piece = Task { duration_s, before: information, ..task.clone() };
        information = told::information(&piece, &series);
        now = of(&information).ok_or(ExcitationError::NotTold { duration_s })?;
        let design = Design { series, value, used, nearest };
        pieces.push(Advised { swings, design, deviations: now.clone() });
    }
    let theta = DVector::from_column_slice(values);
    let torque = |information: &DMatrix<f64>| {
        let errors = covariance(information).map_or(f64::NAN, |of| of.dot(&sum));
        (errors / theta.dot(&(&sum * &theta))).sqrt()
    };
    let torque = [torque(&task.before), torque(&information)];
    Ok(Advice { deviations, lacking, small, pieces, torque })
}

/// Standard deviations by an information matrix.
fn of(information: &DMatrix<f64>) -> Option<Vec<f64>> {
    let covariance = covariance(information)?;
    Some(covariance.diagonal().iter().map(|square| square.sqrt()).collect())
}
