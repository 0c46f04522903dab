//! Checks of the simulation options before anything is recorded.

use super::alignment::torque_shift_samples;
use super::simulator::periods_per_sample;
use crate::identification::problem::{IdentificationError, Options, Start};
use didim_dynamics::SignalTiming;
use didim_dynamics::robot::Robot;
use didim_dynamics::simulation::{SetupError, SimulationConfig};

impl Options {
    /// Checks that the closed loop of this robot can be simulated for records of this sample rate
    /// \[Hz\] and torque timing. Without a configured controller there is nothing to check.
    ///
    /// # Errors
    /// Those that a method that simulates would return for every such record.
    pub fn validate_simulation(
        &self,
        robot: &Robot,
        sample_rate_hz: f64,
        torque: SignalTiming,
    ) -> Result<(), IdentificationError> {
        let Some(controller) = &self.controller else { return Ok(()) };
        self.simulation.validate()?;
        let setup = IdentificationError::Setup;
        let timing = controller.timing();
        let unit = vec![1.0; robot.joints()];
        controller.for_inertia(&unit).map_err(|error| setup(SetupError::Control(error)))?;
        periods_per_sample(sample_rate_hz, timing)?;
        torque_shift_samples(torque, sample_rate_hz, timing)?;
        let substeps = self.simulation.substeps;
        let config = SimulationConfig { substeps, ..SimulationConfig::default() };
        config.validate(robot.joints()).map_err(setup)?;
        if self.simulation.start == Start::Nominal && robot.nominal().is_none() {
            let robot = robot.name().to_owned();
            return Err(IdentificationError::NoNominalParameters { robot });
        }
        Ok(())
    }
}
