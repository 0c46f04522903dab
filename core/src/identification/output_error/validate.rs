//! Options that cannot work, found before anything is recorded.

use super::OutputErrorOptions;
use crate::identification::didim::validate::validate_loop;
use crate::identification::error::IdentificationError;
use crate::identification::experiment::SignalTiming;
use crate::robot::Robot;

impl OutputErrorOptions {
    /// Whether the loop of this robot can be simulated for records of this sample rate \[Hz\] with
    /// torques that act then.
    ///
    /// # Errors
    /// What [`clie`](super::clie()) and [`cloe`](super::cloe()) would meet with any record.
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
