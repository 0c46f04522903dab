//! Missing information of a result, as motions that can be described in words.

use nalgebra::{DMatrix, DVector};

use super::candidates::{Candidate, list_candidates};
use super::design::{CHECK_HZ, Design};
use super::error::ExcitationError;
use super::joint_excitation::JointExcitations;
use super::limits::DesignLimits;
use super::objective::{Objective, covariance, variances};
use super::prediction;
use super::task::Task;
use crate::parallel::Parallel;
use didim_dynamics::robot::Robot;

/// Tried lengths of a motion, as multiples of a candidate's length, the shortest first.
const LENGTH_MULTIPLES: [usize; 3] = [1, 2, 4];

/// Motion that adds missing information to a result.
#[derive(Clone, Debug, PartialEq)]
pub struct Advised {
    /// The motion, described in words.
    pub excitations: JointExcitations,
    /// The same motion as a design, with the used share of each limit.
    pub design: Design,
    /// Standard deviation of each parameter from this motion, the motions before it and the prior
    /// information.
    pub deviations: Vec<f64>,
}

/// Missing information of a result, and the motions that add it.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// Present standard deviation of each parameter.
    pub deviations: Vec<f64>,
    /// Indices of the parameters whose standard deviation is too large and that some motion can
    /// identify.
    pub missing_parameters: Vec<usize>,
    /// Parameters that no motion identifies well enough, even if all others were known. Their
    /// torque is too small.
    pub small_parameters: Vec<usize>,
    /// Advised motions in sequence.
    pub motions: Vec<Advised>,
    /// Uncertainty of the torques due to the parameters, relative to the torques, over all tried
    /// motions and weighted by noise: before and after the advised motions.
    pub torque: [f64; 2],
}

/// Advises motions that identify the insufficiently known parameters of a result. A parameter is
/// known well enough if its standard deviation is at most `enough` times its value. Every advised
/// motion has been checked: it is within the limits, and its standard deviations are predicted like
/// those of a designed motion.
///
/// The task's prior information has to be the information of the result. Its duration and objective
/// have no effect.
///
/// # Errors
/// [`ExcitationError::NotIdentifiable`] if the result leaves a parameter undetermined,
/// [`ExcitationError::NoExcitation`].
pub fn advise(
    robot: &Robot,
    task: &Task,
    values: &[f64],
    enough: f64,
    parallel: &dyn Parallel,
) -> Result<Advice, ExcitationError> {
    let duration_s = DesignLimits::DEFAULT.piece_s;
    let unidentifiable = ExcitationError::NotIdentifiable { duration_s };
    let mut tried = list_candidates(robot, task, parallel)?;
    let deviations = standard_deviations(&task.prior_information).ok_or(unidentifiable)?;
    let count = deviations.len();
    let enough: Vec<f64> = values.iter().map(|value| enough * value.abs()).collect();
    let longest = LENGTH_MULTIPLES[LENGTH_MULTIPLES.len() - 1] as f64;
    let most = |k: usize| {
        let of_motion = tried.iter().map(|of| of.information[(k, k)]).fold(0.0, f64::max);
        task.prior_information[(k, k)]
            + DesignLimits::DEFAULT.max_pieces as f64 * longest * of_motion
    };
    let (small_parameters, missing_parameters): (Vec<usize>, Vec<usize>) = (0..count)
        .filter(|&k| deviations[k] > enough[k])
        .partition(|&k| most(k) * enough[k].powi(2) < 1.0);
    let sum = tried.iter().fold(DMatrix::zeros(count, count), |sum, of| sum + &of.information);
    let mut information = task.prior_information.clone();
    let mut motions: Vec<Advised> = Vec::new();
    let mut now = deviations.clone();
    while motions.len() < DesignLimits::DEFAULT.max_pieces {
        let wanted: Vec<(usize, f64)> = (missing_parameters.iter())
            .filter(|&&k| now[k] > enough[k])
            .map(|&k| (k, DesignLimits::DEFAULT.min_need * enough[k]))
            .collect();
        if wanted.is_empty() {
            break;
        }
        let objective = Objective::Deviations(wanted.clone());
        let with_added = |of: &Candidate, times: f64| &information + times * &of.information;
        let value = |of: &Candidate| objective.value(&with_added(of, longest));
        let best = tried.iter().enumerate().filter_map(|(at, of)| Some((at, value(of)?)));
        let Some((at, value)) = best.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let gain = objective.value(&information).map_or(f64::INFINITY, |now| now - value);
        if gain < DesignLimits::DEFAULT.min_gain.ln() {
            break;
        }
        let best = tried.swap_remove(at);
        // The shortest length with which as many parameters are known well enough as with the
        // longest.
        let brought = |times: usize| {
            let then = standard_deviations(&with_added(&best, times as f64));
            then.map(|then| wanted.iter().filter(|&&(k, _)| then[k] <= enough[k]).count())
        };
        let reachable = brought(LENGTH_MULTIPLES[LENGTH_MULTIPLES.len() - 1]);
        let shortest = LENGTH_MULTIPLES
            .iter()
            .find(|times| reachable > Some(0) && brought(**times) == reachable);
        let excitations = best
            .excitations
            .repeat(*shortest.unwrap_or(&LENGTH_MULTIPLES[LENGTH_MULTIPLES.len() - 1]));
        let (share, used, nearest) = task.bounds.shares_along(&task.model, &excitations, CHECK_HZ);
        if share > 1.0 {
            continue;
        }
        let (series, duration_s) = (excitations.series(), excitations.duration_s);
        let piece = Task { duration_s, prior_information: information, ..task.clone() };
        information = prediction::information(&piece, &series);
        now = standard_deviations(&information)
            .ok_or(ExcitationError::NotIdentifiable { duration_s })?;
        let design = Design { series, value, used, narrowest_gap: nearest };
        motions.push(Advised { excitations, design, deviations: now.clone() });
    }
    let theta = DVector::from_column_slice(values);
    let power = theta.dot(&(&sum * &theta));
    let torque = [&task.prior_information, &information].map(|information| {
        let errors = covariance(information).map_or(f64::NAN, |of| of.dot(&sum));
        (errors / power).sqrt()
    });
    Ok(Advice { deviations, missing_parameters, small_parameters, motions, torque })
}

/// Returns the standard deviations for an information matrix.
fn standard_deviations(information: &DMatrix<f64>) -> Option<Vec<f64>> {
    Some(variances(information)?.iter().map(|variance| variance.sqrt()).collect())
}
