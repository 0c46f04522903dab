//! Options that cannot work, found before anything is recorded.

use super::alignment::torque_shift_samples;
use super::{DidimOptions, Start};
use crate::identification::error::IdentificationError;
use crate::identification::experiment::SignalTiming;
use crate::identification::simulator::periods_per_sample;
use crate::robot::Robot;
use crate::simulation::{SetupError, SimulationConfig};

impl DidimOptions {
    /// Whether the loop of this robot can be simulated for records of this sample rate \[Hz\] with
    /// torques that act then.
    ///
    /// # Errors
    /// What [`didim`](super::didim()) would meet with any record.
    pub fn validate(
        &self,
        robot: &Robot,
        sample_rate_hz: f64,
        torque: SignalTiming,
    ) -> Result<(), IdentificationError> {
        let setup = IdentificationError::Setup;
        self.convergence.validate()?;
        let unit = vec![1.0; robot.joints()];
        self.controller.for_inertia(&unit).map_err(|error| setup(SetupError::Control(error)))?;
        periods_per_sample(sample_rate_hz, self.controller.timing())?;
        torque_shift_samples(torque, sample_rate_hz, self.controller.timing())?;
        let config = SimulationConfig { substeps: self.substeps, ..SimulationConfig::default() };
        config.validate(robot.joints()).map_err(setup)?;
        if self.start == Start::Nominal && robot.nominal().is_none() {
            let robot = robot.name().to_owned();
            return Err(IdentificationError::NoNominalParameters { robot });
        }
        Ok(())
    }
}
