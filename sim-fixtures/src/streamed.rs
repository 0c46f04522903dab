//! Drives on a bus without SYNC. Each drive measures when its own frame arrives.

use didim_dynamics::control::{ControlLaw, ControllerConfig};
use didim_dynamics::simulation::{ClosedLoop, SimulationError, StepOutput};
use didim_dynamics::{MAX_JOINTS, Reading};

use crate::thermal_model::readings;
use crate::{BusCycle, ExcludedTorque, Playback};

#[derive(Clone, Debug)]
pub(crate) struct StreamedMeasurement {
    /// Samples of the loop on both sides of the latest frame's arrival: the last sample before it,
    /// and the first sample at or after it.
    neighbouring_samples: Option<(StepOutput, StepOutput)>,
    /// Stiffness \[N·m/rad\] and damping \[N·m·s/rad\] of each axis, as its commands contain them.
    gains: [[f64; 2]; MAX_JOINTS],
}

impl StreamedMeasurement {
    /// Creates the drives of this controller. Stiffness and damping are reported as 0 for a control
    /// law that has more terms than these two.
    pub(crate) fn new(controller: &ControllerConfig) -> Self {
        let mut gains = [[0.0; 2]; MAX_JOINTS];
        for (gains, joint) in gains.iter_mut().zip(&controller.joints) {
            if let ControlLaw::Pd { kp_per_rad, kd_s_per_rad, k_tau_nm } = joint.law {
                *gains = [kp_per_rad * k_tau_nm, kd_s_per_rad * k_tau_nm];
            }
        }
        Self { neighbouring_samples: None, gains }
    }

    /// Returns the measurement at a time after the first sample of the loop, with torques that lack
    /// the `excluded` terms. Positions are interpolated linearly between two samples, and a torque
    /// is held from one sample to the next. The time must not decrease from one call to the next.
    ///
    /// # Errors
    /// [`SimulationError`].
    pub(crate) fn measure(
        &mut self,
        closed_loop: &mut ClosedLoop<Playback>,
        excluded: Option<&mut ExcludedTorque>,
        time_ns: u64,
    ) -> Result<BusCycle, SimulationError> {
        #[expect(clippy::cast_precision_loss, reason = "days of nanoseconds")]
        let time_s = time_ns as f64 * 1e-9;
        // A time that differs from the time of a sample only by rounding belongs to that sample.
        let time_s = time_s - 1e-6 * closed_loop.period_s();
        let (mut before, mut after) = match self.neighbouring_samples {
            Some(around) => around,
            None => {
                let first = *closed_loop.step()?;
                (first, first)
            }
        };
        while after.time_s < time_s {
            before = after;
            after = *closed_loop.step()?;
        }
        self.neighbouring_samples = Some((before, after));
        let span_s = after.time_s - before.time_s;
        let share = if span_s > 0.0 { ((after.time_s - time_s) / span_s).max(0.0) } else { 0.0 };
        let share = if share < 1e-5 { 0.0 } else { share };
        let between = |from: &[f64; MAX_JOINTS], to: &[f64; MAX_JOINTS]| {
            core::array::from_fn(|j| to[j] + (from[j] - to[j]) * share)
        };
        let mut measured = readings(time_s);
        for (j, (reported, [stiffness, damping])) in measured.iter_mut().zip(self.gains).enumerate()
        {
            let [from, to] = [&before, &after].map(|of| of.motor_reference_rad[j]);
            let speed = if span_s > 0.0 { (to - from) / span_s } else { 0.0 };
            reported[Reading::Stiffness as usize] = stiffness;
            reported[Reading::Damping as usize] = damping;
            reported[Reading::SpeedTarget as usize] = speed;
        }
        let mut holding = if share > 0.0 { before } else { after };
        if let Some(excluded) = excluded {
            excluded.subtract_from_sample(&mut holding);
        }
        Ok(BusCycle {
            counter: 0,
            motor_position_rad: between(&before.motor_position_rad, &after.motor_position_rad),
            motor_torque_nm: holding.motor_torque_nm,
            motor_reference_rad: between(&before.motor_reference_rad, &after.motor_reference_rad),
            readings: measured,
            has_temperature: [false; MAX_JOINTS],
        })
    }
}
