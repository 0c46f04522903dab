//! The reference at one instant.

use crate::MAX_JOINTS;
use crate::control::Setpoint;
use crate::trajectory::Reference;

/// Positions, velocities and accelerations of the reference; zeros beyond the arm's joints.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReferencePoint {
    pub(super) position: [f64; MAX_JOINTS],
    velocity: [f64; MAX_JOINTS],
    acceleration: [f64; MAX_JOINTS],
}

impl ReferencePoint {
    pub(super) const ZERO: Self = Self {
        position: [0.0; MAX_JOINTS],
        velocity: [0.0; MAX_JOINTS],
        acceleration: [0.0; MAX_JOINTS],
    };

    pub(super) fn from_reference<R: Reference>(reference: &R, time_s: f64) -> Self {
        let mut point = Self::ZERO;
        let n = reference.joints();
        reference.evaluate(
            time_s,
            &mut point.position[..n],
            &mut point.velocity[..n],
            &mut point.acceleration[..n],
        );
        point
    }

    pub(super) fn setpoint(&self, joints: usize) -> Setpoint<'_> {
        Setpoint {
            position: &self.position[..joints],
            velocity: &self.velocity[..joints],
            acceleration: &self.acceleration[..joints],
        }
    }

    /// Returns q_r − q.
    pub(super) fn error(&self, position: &[f64]) -> [f64; MAX_JOINTS] {
        let mut error = self.position;
        for (error, q) in error.iter_mut().zip(position) {
            *error -= q;
        }
        error
    }

    pub(super) fn velocity(&self) -> &[f64; MAX_JOINTS] {
        &self.velocity
    }
}
