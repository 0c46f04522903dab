//! The measured torque, at the instants of the positions and behind the parallel filter.

use nalgebra::{DMatrix, DVector};

use crate::identification::given::{Context, Experiment, IdentificationError};
use crate::signal::delay_linear;

/// The measurements y of equation 7: torques shifted to the instants of the positions, filtered, and
/// decimated, the rows of each joint together.
///
/// A value that acts late or is held is worth at an instant what was logged its mean delay before,
/// linear between samples: for a command held over one period, the mean of the command before and
/// after the instant.
///
/// At the very ends up to one sample may be missing, as the command before the first one; then the
/// nearest is taken. More would be a torque that nobody measured.
///
/// # Errors
/// [`IdentificationError::TorqueOutside`] and [`IdentificationError::Signal`].
pub(crate) fn filtered_torque(context: &Context<'_>) -> Result<DVector<f64>, IdentificationError> {
    let experiment = context.experiment;
    let delay = experiment.torque_timing().mean_delay_s() * experiment.sample_rate_hz();
    delayed_torque(context, delay)
}

/// [`filtered_torque`] with a delay of the caller's choice \[samples\].
pub(crate) fn delayed_torque(
    context: &Context<'_>,
    delay: f64,
) -> Result<DVector<f64>, IdentificationError> {
    check_inside(context.experiment, delay)?;
    context.rows_of(&delayed(context.experiment, delay)?, "torque")
}

/// The torques at every sample that were logged so many samples before, samples × joints, each recording's
/// by itself.
///
/// # Errors
/// [`IdentificationError::Signal`].
pub(crate) fn delayed(
    experiment: &Experiment,
    delay: f64,
) -> Result<DMatrix<f64>, IdentificationError> {
    let mut torque = experiment.torque_nm().clone();
    for (joint, mut signal) in (1..).zip(torque.column_iter_mut()) {
        for of in experiment.recordings() {
            let own = &mut signal.as_mut_slice()[of.samples.clone()];
            let delayed = delay_linear(own, delay).map_err(|cause| {
                let cause = cause.later_by(of.samples.start);
                IdentificationError::Signal { signal: "torque", joint, cause }
            })?;
            own.copy_from_slice(&delayed);
        }
    }
    Ok(torque)
}

/// Whether the record holds the torque of every counted sample, but for one at either end.
fn check_inside(experiment: &Experiment, shift_samples: f64) -> Result<(), IdentificationError> {
    for of in experiment.recordings() {
        let first = of.counted.start as f64 - shift_samples;
        let last = of.counted.end as f64 - 1.0 - shift_samples;
        if first < of.samples.start as f64 - 1.0 || last > of.samples.end as f64 {
            let (counted, samples) = (of.counted.clone(), experiment.samples());
            return Err(IdentificationError::TorqueOutside { shift_samples, counted, samples });
        }
    }
    Ok(())
}
