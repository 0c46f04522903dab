//! Simulation of the loop, sample by sample.

use crate::MAX_JOINTS;
use crate::trajectory::Reference;

use super::closed_loop::ClosedLoop;
use super::error::SimulationError;
use super::hold::CommandHold;
use super::output::{Record, StepOutput};
use super::reference_point::ReferencePoint;

impl<R: Reference> ClosedLoop<R> {
    /// Simulates the next sample: the first at time 0, each further one a period later. Allocates
    /// nothing.
    ///
    /// # Errors
    /// [`SimulationError`] names the joint and the time. The simulation has ended then: every
    /// further call meets the same error, until [`restart`](Self::restart).
    pub fn step(&mut self) -> Result<&StepOutput, SimulationError> {
        if let Some(error) = self.failure {
            return Err(error);
        }
        match self.try_step() {
            Ok(()) => Ok(&self.output),
            Err(error) => {
                // The state may be a mixture of the failed sample and the previous one.
                self.failure = Some(error);
                Err(error)
            }
        }
    }

    /// Returns the sample of the last [`step`](Self::step); zeros before the first, undefined after
    /// an error.
    pub fn output(&self) -> &StepOutput {
        &self.output
    }

    fn try_step(&mut self) -> Result<(), SimulationError> {
        let index = if self.is_started { self.output.index + 1 } else { 0 };
        let time_s = self.time_s(index);
        let reference = ReferencePoint::from_reference(&self.plant.reference, time_s);
        if self.is_started {
            self.advance()?;
        }
        self.plant.check_bounds(time_s, &reference, &self.state)?;
        self.measure_and_command(index, time_s, &reference);
        let rate = self.stages.first_rate_mut();
        self.plant.rate_with_reference(&reference, time_s, &self.state, rate)?;
        self.fill_output();
        self.is_started = true;
        Ok(())
    }

    /// Records the next `samples` samples.
    ///
    /// # Errors
    /// The first [`SimulationError`]; what was recorded before is lost.
    pub fn run(&mut self, samples: usize) -> Result<Record, SimulationError> {
        let mut record = Record::zeros(1.0 / self.period_s, samples, self.plant.joints);
        for row in 0..samples {
            record.set(row, self.step()?);
        }
        Ok(record)
    }

    /// Integrates from the sample of `output` to the next one, into `state`.
    fn advance(&mut self) -> Result<(), SimulationError> {
        let (start_s, rest_s) = (self.output.time_s, self.rest_s());
        if rest_s > 0.0 {
            self.apply_command(CommandHold::during_remainder, CommandHold::during_remainder);
            self.integrate(start_s, rest_s, true)?;
        }
        self.apply_command(CommandHold::after_remainder, CommandHold::after_remainder);
        self.integrate(start_s + rest_s, self.period_s - rest_s, rest_s <= 0.0)
    }

    /// Returns how long after a sample the previous command still acts \[s\].
    pub(super) fn rest_s(&self) -> f64 {
        self.sampled_control.as_ref().map_or(0.0, |(_, hold)| hold.remainder_s())
    }

    /// Applies a command and its derivatives.
    pub(super) fn apply_command(
        &mut self,
        command_of: impl Fn(&CommandHold<[f64; MAX_JOINTS]>) -> &[f64; MAX_JOINTS],
        derivatives: impl Fn(&CommandHold<Vec<f64>>) -> &Vec<f64>,
    ) {
        if let Some((_, hold)) = &self.sampled_control {
            self.plant.command = *command_of(hold);
        }
        if let (Some((_, hold)), Some(variation)) =
            (&self.command_variation, &mut self.plant.variation)
        {
            variation.apply(derivatives(hold));
        }
    }

    /// Integrates over an interval with a constant torque. If it begins at the sample, the rate
    /// there is already known.
    fn integrate(
        &mut self,
        start_s: f64,
        length_s: f64,
        at_sample: bool,
    ) -> Result<(), SimulationError> {
        let (integrator, substeps) = (self.config.integrator, self.config.substeps);
        let (plant, stages, y) = (&mut self.plant, &mut self.stages, &mut self.state);
        let rate = |t: f64, y: &[f64], rate: &mut [f64]| plant.rate(t, y, rate);
        stages.advance_over(integrator, substeps, (start_s, length_s), at_sample, y, rate)
    }

    /// Measures the current state and computes the command.
    pub(super) fn measure_and_command(
        &mut self,
        index: u64,
        time_s: f64,
        reference: &ReferencePoint,
    ) {
        let n = self.plant.joints;
        self.plant.settle(&self.state);
        let output = &mut self.output;
        let joint_position_rad = &mut output.joint_position_rad[..n];
        let motor_position_rad = &mut output.motor_position_rad[..n];
        self.encoders.measure(&self.state[..n], motor_position_rad, joint_position_rad);
        let mut command = [0.0; MAX_JOINTS];
        if let Some((controller, hold)) = &mut self.sampled_control {
            controller.update(reference.setpoint(n), joint_position_rad, &mut command[..n]);
            hold.push(&command);
        }
        if let Some((controller, hold)) = &mut self.command_variation {
            let error = reference.error(joint_position_rad);
            // A sampled loop has the states q and q̇, so that their derivatives begin with ∂q/∂θ.
            let position = &self.state[2 * n..];
            controller.update(&error[..n], position, &mut self.command_derivatives);
            hold.push(&self.command_derivatives);
        }
        self.apply_command(CommandHold::at_sample, CommandHold::at_sample);
        self.plant.disturbance = self.disturbance.next(n);
        let output = &mut self.output;
        output.index = index;
        output.time_s = time_s;
        output.joint_torque_nm = command;
        output.joint_reference_rad = reference.position;
        let transmission = self.encoders.transmission();
        transmission.motor_position(&reference.position[..n], &mut output.motor_reference_rad[..n]);
    }

    /// Fills the output from the rate of the state.
    pub(super) fn fill_output(&mut self) {
        let n = self.plant.joints;
        let output = &mut self.output;
        if self.sampled_control.is_none() {
            output.joint_torque_nm = self.plant.command;
        }
        self.torque_measurement.add_to(&mut output.joint_torque_nm[..n]);
        let transmission = self.encoders.transmission();
        transmission.motor_torque(&output.joint_torque_nm[..n], &mut output.motor_torque_nm[..n]);
        if let Some(gains) = &self.torque_gain {
            for (torque, gain) in output.motor_torque_nm.iter_mut().zip(gains) {
                *torque *= gain;
            }
            let motor = &output.motor_torque_nm[..n];
            transmission.joint_torque(motor, &mut output.joint_torque_nm[..n]);
        }
        let (q, dq) = self.state.split_at(n);
        output.true_position_rad[..n].copy_from_slice(q);
        output.true_velocity_rad_s[..n].copy_from_slice(&dq[..n]);
        output.true_acceleration_rad_s2[..n].copy_from_slice(&self.stages.first_rate()[n..2 * n]);
        output.true_torque_nm = self.plant.torque;
        if self.plant.hysteresis.is_some() {
            output.hysteresis = self.plant.workspace.hysteresis();
        }
    }

    /// Returns the time of a sample \[s\]. It is a product, so that it does not drift.
    pub(super) fn time_s(&self, index: u64) -> f64 {
        #[allow(clippy::cast_precision_loss, reason = "exact up to 2^53 samples, 57 000 years")]
        let index = index as f64;
        index * self.period_s
    }
}
