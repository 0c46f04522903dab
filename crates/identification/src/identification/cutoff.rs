//! Choice of the position filter's cut-off for a record.
//!
//! Too low a cut-off removes motion and biases the parameters. Too high a cut-off leaves noise in
//! the accelerations, which makes the torque outside the recorded motion uncertain. All cut-offs
//! are judged by the torques after the parallel filter, so that their held-out errors can be
//! compared. Once the cut-off exceeds the band of the motion, these errors stay constant. The
//! lowest such cut-off passes the least noise.

use super::identify::identify;
use super::judgement::{ChosenCutoff, CutoffTrial};
use super::problem::{Experiment, IdentificationError, Method, Options};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// Chooses the lowest cut-off whose held-out error in IDIM-LS is as small as the smallest one,
/// within a tolerance. `tried` is called after each identification.
///
/// # Errors
/// [`IdentificationError::NothingHeldOut`] if no fold can be held out with any cut-off, and those
/// of IDIM-LS if it has no result with any cut-off.
pub fn choose_cutoff(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
    mut tried: impl FnMut(),
) -> Result<ChosenCutoff, IdentificationError> {
    let candidates = cutoff_candidates(options, experiment.sample_rate_hz());
    let mut failure = None;
    let trial = |cutoff_hz| {
        let mut options = options.clone();
        options.position_filter.cutoff_hz = cutoff_hz;
        let outcome = identify(Method::IdimLs, robot, base, experiment, &options);
        tried();
        let estimate =
            outcome.map_err(|error| failure = failure.take().or(Some(error))).ok()?.estimate;
        let held_out = estimate.held_out.relative_error?;
        Some(CutoffTrial {
            cutoff_hz,
            held_out,
            extrapolation: estimate.extrapolation.relative_error,
        })
    };
    let trials: Vec<CutoffTrial> = candidates.into_iter().filter_map(trial).collect();
    let least = trials.iter().map(|trial| trial.held_out).fold(f64::INFINITY, f64::min);
    let chosen = trials
        .iter()
        .find(|trial| trial.held_out <= (1.0 + options.cutoff_search.tie_tolerance) * least);
    let nothing = || failure.unwrap_or(IdentificationError::NothingHeldOut);
    let cutoff_hz = chosen.ok_or_else(nothing)?.cutoff_hz;
    Ok(ChosenCutoff { cutoff_hz, trials })
}

/// Returns the candidates in ascending order \[Hz\].
fn cutoff_candidates(options: &Options, sample_rate_hz: f64) -> Vec<f64> {
    let passband_hz = options.decimation_filter.cutoff_hz(sample_rate_hz);
    let search = &options.cutoff_search;
    let [low, high] = search.range.map(|share| share * passband_hz);
    let high = high.min(search.highest_share * sample_rate_hz);
    let candidate = |step: f64, decade: i32| match decade {
        // Divides, because a negative power of ten has no exact binary representation.
        ..0 => step / 10_f64.powi(-decade),
        _ => step * 10_f64.powi(decade),
    };
    let decades = (-3..=5).flat_map(|decade| {
        search.candidates_of_decade.iter().map(move |step| candidate(*step, decade))
    });
    decades.filter(|hz| (low..=high).contains(hz)).collect()
}
