//! Options that cannot work, found before anything is recorded.

use super::alignment::torque_shift_samples;
use crate::identification::closed_loop::simulator::{LoopOptions, periods_per_sample};
use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::SignalTiming;
use crate::identification::given::simulation::{DidimOptions, Start};
use crate::robot::Robot;
use crate::simulation::{SetupError, SimulationConfig};

impl DidimOptions {
    /// Whether the loop of this robot can be simulated for records of this sample rate \[Hz\] with
    /// torques that act then.
    ///
    /// # Errors
    /// What [`didim`](crate::identification::didim()) would meet with any record.
    pub fn validate(
        &self,
        robot: &Robot,
        sample_rate_hz: f64,
        torque: SignalTiming,
    ) -> Result<(), IdentificationError> {
        self.convergence.validate()?;
        validate_loop(self.loop_options(), self.start, robot, sample_rate_hz, torque)
    }
}

/// Whether a loop of this robot can be simulated and started, for every method that does.
pub(crate) fn validate_loop(
    options: LoopOptions<'_>,
    start: Start,
    robot: &Robot,
    sample_rate_hz: f64,
    torque: SignalTiming,
) -> Result<(), IdentificationError> {
    let setup = IdentificationError::Setup;
    let (controller, timing) = (options.controller, options.controller.timing());
    let unit = vec![1.0; robot.joints()];
    controller.for_inertia(&unit).map_err(|error| setup(SetupError::Control(error)))?;
    periods_per_sample(sample_rate_hz, timing)?;
    torque_shift_samples(torque, sample_rate_hz, timing)?;
    let config = SimulationConfig { substeps: options.substeps, ..SimulationConfig::default() };
    config.validate(robot.joints()).map_err(setup)?;
    if start == Start::Nominal && robot.nominal().is_none() {
        let robot = robot.name().to_owned();
        return Err(IdentificationError::NoNominalParameters { robot });
    }
    Ok(())
}
