//! Design of a motion from a task.

use super::bounds::UsedLimit;
use super::descent::descend;
use super::error::ExcitationError;
use super::prediction::value;
use super::search::Search;
use super::series::FourierSeries;
use super::shapes::Nearest;
use super::task::Task;

/// Sample rate at which limits are checked \[Hz\]: ten times the fastest output rate.
pub const CHECK_HZ: f64 = 5000.0;
const BARRIER_STAGES: u32 = 4;
/// Successive weights of the barrier.
const BARRIER_WEIGHTS: [f64; BARRIER_STAGES as usize] = [0.1, 0.02, 0.004, 0.0008];

/// Progress of a design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Number of completed steps.
    pub steps: u32,
    /// Total number of steps.
    pub total_steps: u32,
}

/// Motion within the limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The motion.
    pub series: FourierSeries,
    /// Minimised value: the mean logarithm of the standard deviations, or the logarithm of the
    /// condition number.
    pub value: f64,
    /// Used share of each limit, checked at 5000 samples per second.
    pub used: Vec<UsedLimit>,
    /// Narrowest gap between shapes along the motion, checked at 5000 samples per second; `None` if
    /// no shapes are configured.
    pub narrowest_gap: Option<Nearest>,
}

/// Designs a motion in a given number of steps, starting from a random motion that the seed
/// determines. The same task, seed and steps give the same motion. `progress` is called after each
/// step.
///
/// # Errors
/// [`ExcitationError`].
pub fn design(
    task: &Task,
    seed: u64,
    steps: u32,
    mut progress: impl FnMut(Progress),
) -> Result<Design, ExcitationError> {
    let duration_s = task.duration_s;
    if !(duration_s.is_finite() && duration_s >= 1.0) {
        let (what, value, expected) = ("the duration", duration_s, "finite and at least 1 s");
        return Err(ExcitationError::BadValue { what, value, expected });
    }
    let mut search = Search::new(task);
    let mut x = search.start(seed)?;
    let mut step = 0;
    for (stage, weight) in (0..BARRIER_STAGES).zip(BARRIER_WEIGHTS) {
        let steps_of_stage = steps * (stage + 1) / BARRIER_STAGES - steps * stage / BARRIER_STAGES;
        let evaluate = |x: &[f64], gradient: &mut [f64]| search.evaluate(weight, x, gradient);
        if !descend(&mut x, steps_of_stage, evaluate, |_: &[f64]| {
            step += 1;
            progress(Progress { steps: step, total_steps: steps });
        }) {
            return Err(ExcitationError::NotIdentifiable { duration_s });
        }
    }
    let (series, used, nearest) = scale_into_limits(task, search.basis.series(&x));
    let value = value(task, &series)?;
    Ok(Design { series, value, used, narrowest_gap: nearest })
}

/// Returns the random motion within the limits from which a search with this seed starts.
///
/// # Errors
/// [`ExcitationError::Middle`], [`ExcitationError::Touching`].
pub fn first_motion(task: &Task, seed: u64) -> Result<FourierSeries, ExcitationError> {
    let mut search = Search::new(task);
    let x = search.start(seed)?;
    Ok(search.basis.series(&x))
}

/// Returns the motion, scaled down if it exceeds a limit between the samples of the design.
fn scale_into_limits(
    task: &Task,
    mut series: FourierSeries,
) -> (FourierSeries, Vec<UsedLimit>, Option<Nearest>) {
    loop {
        let (share, used, nearest) = task.bounds.shares_along(&task.model, &series, CHECK_HZ);
        // The used shares of positions, gravity and gaps do not decrease in proportion to the
        // motion, so more than one step may be needed.
        if share <= 1.0 {
            return (series, used, nearest);
        }
        series = series.scaled((1.0 / share).clamp(0.9, 0.999));
    }
}
