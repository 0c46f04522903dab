//! How a link moves.

use super::vector::Vector3;
use crate::numeric::Scalar;
use crate::robot::JointKind;

/// How a link moves, in its own frame. Gravity is an acceleration of the base by −g, so that
/// `acceleration` is what an accelerometer at the frame's origin would read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion<T> {
    pub(super) angular_velocity: Vector3<T>,
    pub(super) angular_acceleration: Vector3<T>,
    pub(super) acceleration: Vector3<T>,
}

impl<T: Scalar> Motion<T> {
    #[inline(always)]
    pub(super) fn zero() -> Self {
        Self {
            angular_velocity: Vector3::zero(),
            angular_acceleration: Vector3::zero(),
            acceleration: Vector3::zero(),
        }
    }

    /// What the link's joint accelerates.
    #[inline(always)]
    pub(super) fn accelerated_by(&mut self, joint: JointKind) -> &mut Vector3<T> {
        match joint {
            JointKind::Revolute => &mut self.angular_acceleration,
            JointKind::Prismatic => &mut self.acceleration,
        }
    }
}
