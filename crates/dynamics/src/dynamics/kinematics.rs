//! Poses and motions of all links, each in its own frame: the recursion from the base to the tip.

use super::model::Model;
use super::motion::Motion;
use super::pose::Pose;
use super::vector::Vector3;
use super::workspace::Workspace;
use crate::MAX_JOINTS;
use crate::numeric::Scalar;
use crate::robot::JointKind;
use crate::sample::FEW_JOINTS;

impl Model {
    /// Computes the poses of all links.
    #[inline(always)]
    pub(super) fn compute_poses<T: Scalar>(&self, ws: &mut Workspace<T>, q: &[T]) {
        if self.has_few_joints() {
            self.compute_poses_up_to::<T, FEW_JOINTS>(ws, q);
        } else {
            self.compute_poses_up_to::<T, MAX_JOINTS>(ws, q);
        }
    }

    /// Does so for an arm with at most `N` joints.
    #[inline(always)]
    pub(super) fn compute_poses_up_to<T: Scalar, const N: usize>(
        &self,
        ws: &mut Workspace<T>,
        q: &[T],
    ) {
        let mut angles = [T::zero(); N];
        for ((angle, joint), q) in angles.iter_mut().zip(&self.chain).zip(q) {
            if joint.kind == JointKind::Revolute {
                *angle = *q;
            }
        }
        let (mut sines, mut cosines) = ([T::zero(); N], [T::zero(); N]);
        let n = self.joints().min(N);
        T::sin_cos_each(&angles[..n], &mut sines[..n], &mut cosines[..n]);
        let poses = ws.poses[..N].iter_mut().zip(&self.chain).zip(q);
        // Arrays are passed by reference, because passing them by value would copy them.
        for (((pose, joint), q), (sin, cos)) in poses.zip(sines.iter().zip(&cosines)) {
            *pose = Pose::new(joint, *q, (*sin, *cos));
        }
    }

    /// Computes the motions of the first `links` links from their poses. It is the outward
    /// recursion of Luh, Walker and Paul in Khalil's form (Khalil and Dombre, ch. 9.5). A is the
    /// rotation from the previous link's frame to the link's frame, p is the position of the link's
    /// origin in the previous frame, and ω, ω̇ and a are the angular velocity, the angular
    /// acceleration and the acceleration of the previous link:
    ///
    /// ```text
    /// revolute:  ω_j = A ω + q̇ z,  ω̇_j = A ω̇ + q̈ z + A ω × q̇ z,
    ///            a_j = A (a + ω̇ × p + ω × (ω × p))
    /// prismatic: ω_j = A ω,  ω̇_j = A ω̇,  a_j = A (…) + q̈ z + 2 A ω × q̇ z
    /// ```
    #[inline(always)]
    pub(super) fn compute_motions<T: Scalar>(
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
            // The base has no angular velocity and no angular acceleration.
            if j == 0 {
                motion.acceleration = pose.to_link(acceleration);
            } else {
                let transferred = if pose.has_offset {
                    let tangential = angular_acceleration.cross(pose.origin);
                    let centripetal = angular_velocity.cross(angular_velocity.cross(pose.origin));
                    acceleration + tangential + centripetal
                } else {
                    acceleration
                };
                motion.angular_velocity = pose.to_link(angular_velocity);
                motion.angular_acceleration = pose.to_link(angular_acceleration);
                motion.acceleration = pose.to_link(transferred);
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
