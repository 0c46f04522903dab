//! Pose of a link: its frame in that of the previous one.

use super::vector::Vector3;
use crate::numeric::Scalar;
use crate::robot::{Angle, Joint, JointKind};

/// The frame of a link in that of the previous one: RotX(α) · TransX(d) · RotZ(θ) · TransZ(r).
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose<T> {
    alpha: RotationAboutX<T>,
    cos_theta: T,
    sin_theta: T,
    /// The origin, (d, −r sin α, r cos α).
    pub(super) origin: Vector3<T>,
    /// True if the origin can differ from that of the previous link. With a spherical wrist, half
    /// of the links share their origin with the previous one.
    pub(super) has_offset: bool,
}

impl<T: Scalar> Pose<T> {
    pub(super) fn identity() -> Self {
        Self {
            alpha: RotationAboutX::None,
            cos_theta: T::constant(1.0),
            sin_theta: T::zero(),
            origin: Vector3::zero(),
            has_offset: false,
        }
    }

    /// Creates a pose from the joint's position and its sine and cosine.
    #[inline(always)]
    pub(super) fn new(joint: &Joint, q: T, (sin, cos): (T, T)) -> Self {
        let Joint { kind, alpha, theta, d_m, r_m, .. } = *joint;
        let (cos0, sin0) = (T::constant(theta.cos), T::constant(theta.sin));
        let (cos_theta, sin_theta, origin) = match kind {
            JointKind::Revolute => {
                let origin = Vector3::constant([d_m, r_m * -alpha.sin, r_m * alpha.cos]);
                // The offset is added as a rotation, not to q: quarter turns stay exact.
                (cos * cos0 - sin * sin0, sin * cos0 + cos * sin0, origin)
            }
            JointKind::Prismatic => {
                let (sin, cos) = (T::constant(-alpha.sin), T::constant(alpha.cos));
                let r = T::constant(r_m) + q;
                (cos0, sin0, Vector3::new(T::constant(d_m), r * sin, r * cos))
            }
        };
        let shifted = kind == JointKind::Prismatic || d_m != 0.0 || r_m != 0.0;
        Self {
            alpha: RotationAboutX::new(alpha),
            cos_theta,
            sin_theta,
            origin,
            has_offset: shifted,
        }
    }

    /// Converts a vector from the frame of the link to that of the previous link.
    #[inline(always)]
    pub(super) fn to_previous(self, v: Vector3<T>) -> Vector3<T> {
        let x = self.cos_theta * v.x - self.sin_theta * v.y;
        let y = self.sin_theta * v.x + self.cos_theta * v.y;
        let (y, z) = self.alpha.rotate(y, v.z);
        Vector3::new(x, y, z)
    }

    /// Converts a vector from the frame of the previous link to that of the link.
    #[inline(always)]
    pub(super) fn to_link(self, v: Vector3<T>) -> Vector3<T> {
        let (y, z) = self.alpha.rotate_back(v.y, v.z);
        Vector3::new(
            self.cos_theta * v.x + self.sin_theta * y,
            self.cos_theta * y - self.sin_theta * v.x,
            z,
        )
    }
}

/// A constant rotation about x. Most arms have only quarter turns, which need no multiplication.
#[derive(Clone, Copy, Debug)]
enum RotationAboutX<T> {
    None,
    Quarter,
    Half,
    ThreeQuarters,
    Any { cos: T, sin: T },
}

impl<T: Scalar> RotationAboutX<T> {
    #[inline(always)]
    fn new(Angle { cos, sin }: Angle) -> Self {
        if sin == 0.0 {
            if cos > 0.0 { Self::None } else { Self::Half }
        } else if cos == 0.0 {
            if sin > 0.0 { Self::Quarter } else { Self::ThreeQuarters }
        } else {
            Self::Any { cos: T::constant(cos), sin: T::constant(sin) }
        }
    }

    /// Returns (y, z) after the rotation.
    #[inline(always)]
    fn rotate(self, y: T, z: T) -> (T, T) {
        match self {
            Self::None => (y, z),
            Self::Quarter => (-z, y),
            Self::Half => (-y, -z),
            Self::ThreeQuarters => (z, -y),
            Self::Any { cos, sin } => (cos * y - sin * z, sin * y + cos * z),
        }
    }

    /// Returns (y, z) before the rotation.
    #[inline(always)]
    fn rotate_back(self, y: T, z: T) -> (T, T) {
        match self {
            Self::None => (y, z),
            Self::Quarter => (z, -y),
            Self::Half => (-y, -z),
            Self::ThreeQuarters => (-z, y),
            Self::Any { cos, sin } => (cos * y + sin * z, cos * z - sin * y),
        }
    }
}
