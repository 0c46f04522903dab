//! Motion of a link.

use super::vector::Vector3;
use crate::numeric::Scalar;
use crate::robot::JointKind;

/// Motion of a link, in its own frame. Gravity is an acceleration of the base by −g, so that
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

    /// Returns the acceleration that the link's joint changes.
    #[inline(always)]
    pub(super) fn accelerated_by(&mut self, joint: JointKind) -> &mut Vector3<T> {
        match joint {
            JointKind::Revolute => &mut self.angular_acceleration,
            JointKind::Prismatic => &mut self.acceleration,
        }
    }
}
