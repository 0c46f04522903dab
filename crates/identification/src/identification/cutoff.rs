//! Choice of the position filter's cut-off for a record.
//!
//! Too low a cut-off removes motion and biases the parameters. Too high a cut-off leaves noise in
//! the accelerations, and the torque outside the recorded motion becomes uncertain. All are judged
//! on the same torques, those behind the parallel filter, so that held-out errors can be compared.
//! Beyond the band of the motion these errors stay constant, and the lowest cut-off there lets the
//! least noise in.

use super::identify::identify;
use super::judgement::{ChosenCutoff, CutoffTrial};
use super::problem::{Experiment, IdentificationError, Method, Options};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// Chooses by IDIM-LS the lowest cut-off whose held-out error is as small as that of any; `tried`
/// is called after each identification.
///
/// # Errors
/// [`IdentificationError::NothingHeldOut`] where no piece can be left out with any cut-off, and
/// those of IDIM-LS where it has no result with any.
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

/// In rising order \[Hz\].
fn cutoff_candidates(options: &Options, sample_rate_hz: f64) -> Vec<f64> {
    let passband_hz = options.decimation_filter.cutoff_hz(sample_rate_hz);
    let search = &options.cutoff_search;
    let [low, high] = search.range.map(|share| share * passband_hz);
    let high = high.min(search.highest_share * sample_rate_hz);
    let candidate = |step: f64, decade: i32| match decade {
        // Ten to a negative power is no round number.
        ..0 => step / 10_f64.powi(-decade),
        _ => step * 10_f64.powi(decade),
    };
    let decades = (-3..=5).flat_map(|decade| {
        search.candidates_of_decade.iter().map(move |step| candidate(*step, decade))
    });
    decades.filter(|hz| (low..=high).contains(hz)).collect()
}
