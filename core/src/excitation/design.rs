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
/// Weights of the barrier, one after the other.
const WEIGHTS: [f64; 4] = [0.1, 0.02, 0.004, 0.0008];
/// Half of a motion is searched for first where it is so long \[s\]: a shorter one is found by itself, and a longer one has harmonics that are
/// too fast for the whole.
const HALVES_S: core::ops::RangeInclusive<f64> = 8.0..=15.0;

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
    let mut step = 0;
    let mut after = || {
        step += 1;
        progress(Progress { step, of: steps });
    };
    let x = searched(&mut search, task, seed, steps, &mut after)?;
    let (series, used, nearest) = within(task, search.basis.series(&x));
    let value = value(task, &series)?;
    Ok(Design { series, value, used, nearest })
}

/// Coordinates of the best motion that so many steps find. A long one begins with one of half the length, twice: that is as good as the search
/// is there, and costs half as much.
fn searched(
    search: &mut Search<'_>,
    task: &Task,
    seed: u64,
    steps: u32,
    after: &mut dyn FnMut(),
) -> Result<Vec<f64>, ExcitationError> {
    let half = Task { duration_s: 0.5 * task.duration_s, ..task.clone() };
    let (mut begun, mut steps) = (None, steps);
    if HALVES_S.contains(&half.duration_s) {
        let mut of_half = Search::new(&half);
        let found = searched(&mut of_half, &half, seed, steps / 2, after)?;
        begun = search.twice(&of_half.basis.series(&found), seed);
        steps -= steps / 2;
    }
    let (mut x, weights) = match begun {
        Some(x) => (x, &WEIGHTS[WEIGHTS.len() / 2..]),
        None => (search.start(seed)?, &WEIGHTS[..]),
    };
    let stages = weights.len();
    for (stage, weight) in weights.iter().enumerate() {
        let until = |stage: usize| steps as usize * stage / stages;
        let own = until(stage + 1) - until(stage);
        let evaluate = |x: &[f64], gradient: &mut [f64]| search.evaluate(*weight, x, gradient);
        if !descend(&mut x, own, evaluate, |_| after()) {
            return Err(ExcitationError::NotTold { duration_s: task.duration_s });
        }
    }
    Ok(x)
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
