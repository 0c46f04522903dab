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
    /// Of the mass matrix of the last direct dynamics that had no error.
    pub(super) factor: Factor<T>,
}

impl<T: Scalar> Workspace<T> {
    /// Scratch memory for one thread.
    pub fn new() -> Self {
        Self {
            poses: [Pose::identity(); MAX_JOINTS],
            motions: [Motion::zero(); MAX_JOINTS],
            factor: Factor::zero(),
        }
    }
}

impl<T: Scalar> Default for Workspace<T> {
    fn default() -> Self {
        Self::new()
    }
}
