//! Scratch memory.

use super::factor::MassMatrixFactor;
use super::motion::Motion;
use super::pose::Pose;
use crate::MAX_JOINTS;
use crate::numeric::Scalar;

/// Scratch memory of all algorithms, large enough for every robot.
#[derive(Clone, Debug)]
pub struct Workspace<T> {
    pub(super) poses: [Pose<T>; MAX_JOINTS],
    pub(super) motions: [Motion<T>; MAX_JOINTS],
    /// Hysteresis of the friction at every joint, −1 to 1. `None` for a state without a history:
    /// every joint is past its presliding distance.
    pub(super) hysteresis: Option<[T; MAX_JOINTS]>,
    /// Factor of the mass matrix of the last successful direct dynamics.
    pub(super) factor: MassMatrixFactor<T>,
}

impl<T: Scalar> Workspace<T> {
    /// Scratch memory for one thread.
    pub fn new() -> Self {
        Self {
            poses: [Pose::identity(); MAX_JOINTS],
            motions: [Motion::zero(); MAX_JOINTS],
            hysteresis: None,
            factor: MassMatrixFactor::zero(),
        }
    }

    /// Returns the hysteresis of the friction that was set last.
    pub fn hysteresis(&self) -> Option<[T; MAX_JOINTS]> {
        self.hysteresis
    }

    /// Sets the hysteresis of the friction at every joint, −1 to 1, until it is set again. `None`
    /// is for states without a history, where every joint is past its presliding distance.
    pub fn set_hysteresis(&mut self, shares: Option<[T; MAX_JOINTS]>) {
        self.hysteresis = shares;
    }
}

impl<T: Scalar> Default for Workspace<T> {
    fn default() -> Self {
        Self::new()
    }
}
