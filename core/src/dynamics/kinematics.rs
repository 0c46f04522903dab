//! Where the links are and how they move, each in the frame of its own link.

use super::vector::Vector3;
use super::{Model, Workspace};
use crate::MAX_JOINTS;
use crate::numeric::Scalar;
use crate::robot::{Angle, Joint, JointKind};

/// The frame of a link in that of the previous one: RotX(α) · TransX(d) · RotZ(θ) · TransZ(r).
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose<T> {
    alpha: TurnAboutX<T>,
    cos_theta: T,
    sin_theta: T,
    /// The origin, (d, −r sin α, r cos α).
    pub(super) origin: Vector3<T>,
    /// Whether the origin can be elsewhere than that of the previous link: on most arms with a
    /// spherical wrist, half of them are not.
    pub(super) shifted: bool,
}

impl<T: Scalar> Pose<T> {
    pub(super) fn identity() -> Self {
        Self {
            alpha: TurnAboutX::None,
            cos_theta: T::constant(1.0),
            sin_theta: T::zero(),
            origin: Vector3::zero(),
            shifted: false,
        }
    }

    /// From the joint's position and the sine and cosine of it.
    #[inline(always)]
    fn new(joint: &Joint, q: T, (sin, cos): (T, T)) -> Self {
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
        Self { alpha: TurnAboutX::new(alpha), cos_theta, sin_theta, origin, shifted }
    }

    /// A vector of the link, in the frame of the previous link.
    #[inline(always)]
    pub(super) fn to_previous(self, v: Vector3<T>) -> Vector3<T> {
        let x = self.cos_theta * v.x - self.sin_theta * v.y;
        let y = self.sin_theta * v.x + self.cos_theta * v.y;
        let (y, z) = self.alpha.turn(y, v.z);
        Vector3::new(x, y, z)
    }

    /// A vector of the previous link, in the frame of the link.
    #[inline(always)]
    pub(super) fn to_link(self, v: Vector3<T>) -> Vector3<T> {
        let (y, z) = self.alpha.turn_back(v.y, v.z);
        Vector3::new(
            self.cos_theta * v.x + self.sin_theta * y,
            self.cos_theta * y - self.sin_theta * v.x,
            z,
        )
    }
}

/// A constant turn about x. Most arms have quarter turns only, which take no products.
#[derive(Clone, Copy, Debug)]
enum TurnAboutX<T> {
    None,
    Quarter,
    Half,
    ThreeQuarters,
    Any { cos: T, sin: T },
}

impl<T: Scalar> TurnAboutX<T> {
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

    /// (y, z) after the turn.
    #[inline(always)]
    fn turn(self, y: T, z: T) -> (T, T) {
        match self {
            Self::None => (y, z),
            Self::Quarter => (-z, y),
            Self::Half => (-y, -z),
            Self::ThreeQuarters => (z, -y),
            Self::Any { cos, sin } => (cos * y - sin * z, sin * y + cos * z),
        }
    }

    /// (y, z) before the turn.
    #[inline(always)]
    fn turn_back(self, y: T, z: T) -> (T, T) {
        match self {
            Self::None => (y, z),
            Self::Quarter => (z, -y),
            Self::Half => (-y, -z),
            Self::ThreeQuarters => (-z, y),
            Self::Any { cos, sin } => (cos * y + sin * z, cos * z - sin * y),
        }
    }
}

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
    fn accelerated_by(&mut self, joint: JointKind) -> &mut Vector3<T> {
        match joint {
            JointKind::Revolute => &mut self.angular_acceleration,
            JointKind::Prismatic => &mut self.acceleration,
        }
    }
}

impl Model {
    /// Fills the poses of all links.
    #[inline(always)]
    pub(super) fn place<T: Scalar>(&self, ws: &mut Workspace<T>, q: &[T]) {
        let mut angles = [T::zero(); MAX_JOINTS];
        for ((angle, joint), q) in angles.iter_mut().zip(&self.chain).zip(q) {
            if joint.kind == JointKind::Revolute {
                *angle = *q;
            }
        }
        let (mut sines, mut cosines) = ([T::zero(); MAX_JOINTS], [T::zero(); MAX_JOINTS]);
        let n = self.joints().min(MAX_JOINTS);
        T::sin_cos_each(&angles[..n], &mut sines[..n], &mut cosines[..n]);
        let poses = ws.poses.iter_mut().zip(&self.chain).zip(q);
        // By reference: arrays that are handed over are copied.
        for (((pose, joint), q), (sin, cos)) in poses.zip(sines.iter().zip(&cosines)) {
            *pose = Pose::new(joint, *q, (*sin, *cos));
        }
    }

    /// Fills the motions of the first `links` links from their poses: the outward recursion of Luh,
    /// Walker and Paul in Khalil's form (Khalil and Dombre, ch. 9.5). With A the rotation to the
    /// link's frame, p the origin's place, ω, ω̇ and a those of the previous link:
    ///
    /// revolute  ω_j = A ω + q̇ z,  ω̇_j = A ω̇ + q̈ z + A ω × q̇ z,  a_j = A (a + ω̇ × p + ω × (ω × p))
    /// prismatic ω_j = A ω,  ω̇_j = A ω̇,  a_j = A (…) + q̈ z + 2 A ω × q̇ z
    #[inline(always)]
    pub(super) fn propagate<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        links: usize,
        dq: &[T],
        ddq: Option<&[T]>,
    ) {
        let Workspace { poses, motions, .. } = ws;
        let mut previous = Motion::zero();
        previous.acceleration = Vector3::constant(self.gravity_m_s2.map(|g| -g));
        for (j, joint) in self.chain.iter().enumerate().take(links) {
            let pose = &poses[j];
            let Motion { angular_velocity, angular_acceleration, acceleration } = previous;
            let mut motion = Motion::zero();
            // The base neither turns nor starts to.
            if j == 0 {
                motion.acceleration = pose.to_link(acceleration);
            } else {
                let carried = if pose.shifted {
                    let tangential = angular_acceleration.cross(pose.origin);
                    let centripetal = angular_velocity.cross(angular_velocity.cross(pose.origin));
                    acceleration + tangential + centripetal
                } else {
                    acceleration
                };
                motion.angular_velocity = pose.to_link(angular_velocity);
                motion.angular_acceleration = pose.to_link(angular_acceleration);
                motion.acceleration = pose.to_link(carried);
                let across = motion.angular_velocity.cross_along_z(dq[j]);
                let accelerated = motion.accelerated_by(joint.kind);
                *accelerated = *accelerated + across;
                if joint.kind == JointKind::Prismatic {
                    *accelerated = *accelerated + across;
                }
            }
            if joint.kind == JointKind::Revolute {
                motion.angular_velocity.z += dq[j];
            }
            if let Some(ddq) = ddq {
                motion.accelerated_by(joint.kind).z += ddq[j];
            }
            motions[j] = motion;
            previous = motion;
        }
    }
}
