//! Alignment of the logged torque with the simulated samples.

use nalgebra::DVector;

use crate::identification::observation::delayed_torque;
use crate::identification::problem::{Context, IdentificationError};
use didim_dynamics::SignalTiming;
use didim_dynamics::control::ControlTiming;

/// Largest difference between two delays that count as equal \[s\].
const DELAY_TOLERANCE_S: f64 = 1e-9;

/// Largest distance of a shift from a whole number of samples that is rounded away. The shift is a
/// product of rounded times.
const SAMPLE_TOLERANCE: f64 = 1e-9;

/// Returns the shift of the logged torque, in samples, that aligns it with the torque of the
/// simulated samples.
///
/// The acceleration of a simulated sample is that just after t_k. So its regressor times the
/// simulated parameters is exactly the torque just after t_k. For a sampled controller, this is a
/// section of held torque with its mean at t_k + c, where c is
/// [`mean_time_after_sample_s`](ControlTiming::mean_time_after_sample_s). The logged value of t_k
/// has its mean at t_k plus its own mean delay. The shift is the difference of both delays:
///
/// - a torque that is held for the controller's period T from delay d on, with the same delay d in
///   the simulation: exactly ⌈d/T⌉ periods, without interpolation;
/// - an instantaneous torque under a sampled controller: delay − c, which is delay − T/2 without a
///   computation delay;
/// - under a continuous controller: the mean delay.
///
/// # Errors
/// [`IdentificationError::TorqueDelay`] if the logged torque is held and the sampled controller has
/// another delay.
pub(super) fn torque_shift_samples(
    logged: SignalTiming,
    sample_rate_hz: f64,
    controller: ControlTiming,
) -> Result<f64, IdentificationError> {
    if let ControlTiming::Sampled { computation_delay_s, .. } = controller {
        let is_held = logged.hold_s > 0.0;
        if is_held && (logged.delay_s - computation_delay_s).abs() > DELAY_TOLERANCE_S {
            return Err(IdentificationError::TorqueDelay {
                logged_s: logged.delay_s,
                simulated_s: computation_delay_s,
            });
        }
    }
    let shift_s = logged.mean_delay_s() - controller.mean_time_after_sample_s();
    let shift = shift_s * sample_rate_hz;
    let rounded = shift.round();
    Ok(if (shift - rounded).abs() < SAMPLE_TOLERANCE { rounded } else { shift })
}

/// Returns the measured torques of the rows, shifted to the simulated samples.
///
/// # Errors
/// Those of [`torque_shift_samples`] and of [`delayed_torque`].
pub(super) fn torque_of_simulated_samples(
    context: &Context<'_>,
    controller: ControlTiming,
) -> Result<DVector<f64>, IdentificationError> {
    let experiment = context.experiment;
    let (timing, rate_hz) = (experiment.torque_timing(), experiment.sample_rate_hz());
    delayed_torque(context, torque_shift_samples(timing, rate_hz, controller)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shift(hold: f64, delay: f64, controller: ControlTiming) -> Result<f64, IdentificationError> {
        let timing = SignalTiming { hold_s: hold * 2e-4, delay_s: delay * 2e-4 };
        torque_shift_samples(timing, 5000.0, controller)
    }

    /// Times in periods of the record, 200 µs.
    #[test]
    #[allow(clippy::float_cmp, reason = "whole shifts are exact")]
    fn a_held_command_is_shifted_by_whole_samples() {
        let sampled = |period: f64, delay: f64| ControlTiming::Sampled {
            sample_period_s: period * 2e-4,
            computation_delay_s: delay * 2e-4,
        };
        for (delay, expected) in [(0.0, 0.0), (0.3, 1.0), (1.0, 1.0), (1.7, 2.0), (3.0, 3.0)] {
            assert_eq!(shift(1.0, delay, sampled(1.0, delay)).unwrap(), expected, "{delay}");
        }
        // A controller ten times as fast: its command lasts a tenth of the record's period.
        assert_eq!(shift(0.1, 0.0, sampled(0.1, 0.0)).unwrap(), 0.0);
        let assert_close = |found: Result<f64, IdentificationError>, expected: f64| {
            // Rounding of times that are products themselves.
            assert!((found.unwrap() - expected).abs() < 1e-12, "{expected}");
        };
        assert_close(shift(0.1, 0.05, sampled(0.1, 0.05)), 0.1);
        // A torque of an instant is the simulated one half a period later.
        assert_close(shift(0.0, 0.0, sampled(1.0, 0.0)), -0.5);
        assert_close(shift(0.0, 2.0, sampled(1.0, 0.0)), 1.5);
        let continuous = ControlTiming::Continuous { sample_period_s: 2e-4 };
        assert_close(shift(0.0, 2.0, continuous), 2.0);
        assert_close(shift(1.0, 0.0, continuous), 0.5);
        let error = shift(1.0, 0.5, sampled(1.0, 0.0)).unwrap_err();
        assert_eq!(error, IdentificationError::TorqueDelay { logged_s: 1e-4, simulated_s: 0.0 });
    }
}
