//! Options that cannot work, found before anything is recorded.

use super::OutputErrorOptions;
use crate::identification::closed_loop::validate::validate_loop;
use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::SignalTiming;
use crate::robot::Robot;

impl OutputErrorOptions {
    /// Whether the loop of this robot can be simulated for records of this sample rate \[Hz\] with
    /// torques that act then.
    ///
    /// # Errors
    /// What [`clie`](crate::identification::clie()) and [`cloe`](crate::identification::cloe()) would meet with any record.
    pub fn validate(
        &self,
        robot: &Robot,
        sample_rate_hz: f64,
        torque: SignalTiming,
    ) -> Result<(), IdentificationError> {
        self.validate_iteration()?;
        validate_loop(self.loop_options(), self.start, robot, sample_rate_hz, torque)
    }

    /// Whether the iteration can end, and begin.
    pub(super) fn validate_iteration(&self) -> Result<(), IdentificationError> {
        self.convergence.validate()?;
        let (steps, max_simulations) = (self.didim_steps, self.convergence.max_simulations);
        if steps >= max_simulations {
            return Err(IdentificationError::DidimSteps { steps, max_simulations });
        }
        Ok(())
    }
}
