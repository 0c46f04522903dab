//! Measured torque at the instants of the positions, filtered and decimated.

use didim_dynamics::robot::JointIndex;
use nalgebra::{DMatrix, DVector};

use crate::identification::problem::{Context, Experiment, IdentificationError};
use crate::signal::delay_linear;

/// Returns the measurements y of equation 7: torques shifted to the instants of the positions,
/// filtered, and decimated, the rows of each joint together.
///
/// The torque at an instant is the value logged one mean delay before, with linear interpolation
/// between samples. For a command held over one period, this is the mean of the commands before and
/// after the instant.
///
/// At either end of the record, up to one sample may be missing, such as the command before the
/// first one. The nearest sample then replaces it. A longer gap would require a torque that was not
/// measured.
///
/// # Errors
/// [`IdentificationError::TorqueOutside`] and [`IdentificationError::Signal`].
pub(crate) fn filtered_torque(context: &Context<'_>) -> Result<DVector<f64>, IdentificationError> {
    let experiment = context.experiment;
    let delay = experiment.torque_timing().mean_delay_s() * experiment.sample_rate_hz();
    delayed_torque(context, delay)
}

/// Returns the same as [`filtered_torque`] with a given delay \[samples\].
pub(crate) fn delayed_torque(
    context: &Context<'_>,
    delay: f64,
) -> Result<DVector<f64>, IdentificationError> {
    check_inside(context.experiment, delay)?;
    context.rows_of(&delay_samples(context.experiment, delay)?, "torque")
}

/// Returns the torques that were logged `delay` samples before every sample, samples × joints,
/// separately for each recording.
///
/// # Errors
/// [`IdentificationError::Signal`].
pub(crate) fn delay_samples(
    experiment: &Experiment,
    delay: f64,
) -> Result<DMatrix<f64>, IdentificationError> {
    let mut torque = experiment.torque_nm().clone();
    for (joint, mut signal) in torque.column_iter_mut().enumerate() {
        for of in experiment.recordings() {
            let rows = &mut signal.as_mut_slice()[of.samples.clone()];
            let delayed = delay_linear(rows, delay).map_err(|cause| {
                let cause = cause.later_by(of.samples.start);
                IdentificationError::Signal {
                    signal: "torque",
                    joint: JointIndex::new(joint),
                    cause,
                }
            })?;
            rows.copy_from_slice(&delayed);
        }
    }
    Ok(torque)
}

/// Checks that the record contains the torque of every counted sample; one sample may be missing at
/// either end.
fn check_inside(experiment: &Experiment, shift_samples: f64) -> Result<(), IdentificationError> {
    for of in experiment.recordings() {
        let first = of.counted_samples.start as f64 - shift_samples;
        let last = of.counted_samples.end as f64 - 1.0 - shift_samples;
        if first < of.samples.start as f64 - 1.0 || last > of.samples.end as f64 {
            let (counted, samples) = (of.counted_samples.clone(), experiment.samples());
            return Err(IdentificationError::TorqueOutside { shift_samples, counted, samples });
        }
    }
    Ok(())
}
