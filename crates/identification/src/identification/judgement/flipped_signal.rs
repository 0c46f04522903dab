//! Which signal of a joint is sign-flipped: its torque or its position.

use didim_dynamics::robot::JointIndex;

use super::refit::{INSPECTED, Refit};
use crate::identification::problem::Context;

/// A sign-flipped signal of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlippedSignal {
    /// Its torque.
    Torque,
    /// Its position.
    Position,
}

impl FlippedSignal {
    /// Returns the signal whose inversion leaves the smaller residual. `None` if neither can be
    /// fitted.
    pub(super) fn find(context: &Context<'_>, joint: JointIndex) -> Option<Self> {
        let logged = context.experiment.first_samples(INSPECTED);
        // A signal without a solution does not fit better.
        let torque = Refit::new(context, &logged.with_opposite_torque(joint)).ok();
        let position = Refit::new(context, &logged.with_opposite_position(joint)).ok();
        match (torque, position) {
            (Some(torque), Some(position)) if position.remaining < torque.remaining => {
                Some(Self::Position)
            }
            (Some(_), _) => Some(Self::Torque),
            (None, Some(_)) => Some(Self::Position),
            (None, None) => None,
        }
    }
}
