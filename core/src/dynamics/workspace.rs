//! Scratch memory.

use super::factor::Factor;
use super::motion::Motion;
use super::pose::Pose;
use crate::MAX_JOINTS;
use crate::numeric::Scalar;

/// All scratch memory of the algorithms; one serves robots of every size.
#[derive(Clone, Debug)]
pub struct Workspace<T> {
    pub(super) poses: [Pose<T>; MAX_JOINTS],
    pub(super) motions: [Motion<T>; MAX_JOINTS],
    /// Where friction that lags at reversals stands at every joint, −1 to 1; at a state without a history the joint has
    /// gone on for long.
    pub(super) hysteresis: Option<[T; MAX_JOINTS]>,
    /// Of the mass matrix of the last direct dynamics that had no error.
    pub(super) factor: Factor<T>,
}

impl<T: Scalar> Workspace<T> {
    /// Scratch memory for one thread.
    pub fn new() -> Self {
        Self {
            poses: [Pose::identity(); MAX_JOINTS],
            motions: [Motion::zero(); MAX_JOINTS],
            hysteresis: None,
            factor: Factor::zero(),
        }
    }

    /// Where friction that lags at reversals stands, as it was said last.
    pub(crate) fn hysteresis(&self) -> Option<[T; MAX_JOINTS]> {
        self.hysteresis
    }

    /// Says where friction that lags at reversals stands at every joint, −1 to 1, until it is said anew; nothing at states
    /// without a history, where joints have gone on for long.
    pub fn set_hysteresis(&mut self, shares: Option<[T; MAX_JOINTS]>) {
        self.hysteresis = shares;
    }
}

impl<T: Scalar> Default for Workspace<T> {
    fn default() -> Self {
        Self::new()
    }
}
