//! From a task to a motion.

use super::bounds::Used;
use super::descent::descend;
use super::error::ExcitationError;
use super::search::Search;
use super::series::FourierSeries;
use super::shapes::Nearest;
use super::task::Task;
use super::told::value;

/// Limits are kept at so many samples per second \[Hz\]: ten times the fastest output.
pub const CHECK_HZ: f64 = 5000.0;
const STAGES: u32 = 4;
/// Weights of the barrier, one after the other.
const WEIGHTS: [f64; STAGES as usize] = [0.1, 0.02, 0.004, 0.0008];

/// How far a design is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Steps taken.
    pub step: u32,
    /// Steps in all.
    pub of: u32,
}

/// A motion within the limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The motion.
    pub series: FourierSeries,
    /// What was made small: the mean logarithm of the standard deviations, or the logarithm of the condition number.
    pub value: f64,
    /// How much of each limit it uses, checked at 5000 samples per second.
    pub used: Vec<Used>,
    /// The narrowest gap between shapes along it, likewise; nothing where no shapes are stated.
    pub nearest: Option<Nearest>,
}

/// Designs a motion in so many steps from a random one, which the seed decides. The same task, seed and steps give the
/// same motion. `progress` is called after each step.
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
    for (stage, weight) in (0..STAGES).zip(WEIGHTS) {
        let own = steps * (stage + 1) / STAGES - steps * stage / STAGES;
        let after = |_: &[f64]| {
            step += 1;
            progress(Progress { step, of: steps });
        };
        let evaluate = |x: &[f64], gradient: &mut [f64]| search.evaluate(weight, x, gradient);
        if !descend(&mut x, own, evaluate, after) {
            return Err(ExcitationError::NotTold { duration_s });
        }
    }
    let (series, used, nearest) = within(task, search.basis.series(&x));
    let value = value(task, &series)?;
    Ok(Design { series, value, used, nearest })
}

/// The random motion within the limits that a search of this seed begins with.
///
/// # Errors
/// [`ExcitationError::Middle`], [`ExcitationError::Touching`].
pub fn first(task: &Task, seed: u64) -> Result<FourierSeries, ExcitationError> {
    let mut search = Search::new(task);
    let x = search.start(seed)?;
    Ok(search.basis.series(&x))
}

/// The motion, smaller where between the samples of the design it leaves a limit.
fn within(task: &Task, mut series: FourierSeries) -> (FourierSeries, Vec<Used>, Option<Nearest>) {
    loop {
        let (share, used, nearest) = task.bounds.share(&task.model, &series, CHECK_HZ);
        // Shares of positions, gravity and gaps do not vanish with the motion: it takes more than one step.
        if share <= 1.0 {
            return (series, used, nearest);
        }
        series = series.scaled((1.0 / share).clamp(0.9, 0.999));
    }
}
