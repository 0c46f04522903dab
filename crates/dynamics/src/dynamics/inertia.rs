//! Ten parameters of a rigid body about the origin of a frame.

use super::motion::Motion;
use super::pose::Pose;
use super::vector::Vector3;
use crate::numeric::Scalar;
use crate::robot::JointKind;

/// Inertia about the frame's origin, first moments and mass. No function here divides by the mass
/// or needs a centre of mass. Parameter sets without a physical body therefore work.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inertia<T> {
    xx: T,
    xy: T,
    xz: T,
    yy: T,
    yz: T,
    zz: T,
    pub(super) first_moment: Vector3<T>,
    pub(super) mass: T,
}

/// Force through the frame's origin and moment about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wrench<T> {
    pub(super) force: Vector3<T>,
    pub(super) moment: Vector3<T>,
}

impl<T: Scalar> Inertia<T> {
    /// Creates a body from ten parameters in the order xx xy xz yy yz zz mx my mz m.
    #[inline(always)]
    pub(super) fn from_parameters(p: &[T; 10]) -> Self {
        let [xx, xy, xz, yy, yz, zz, mx, my, mz, mass] = *p;
        Self { xx, xy, xz, yy, yz, zz, first_moment: Vector3::new(mx, my, mz), mass }
    }

    /// Returns the columns of ½ tr(J) 1 − J.
    #[inline(always)]
    pub(super) fn pseudo_inertia(&self) -> [Vector3<T>; 3] {
        let half = (self.xx + self.yy + self.zz) * T::constant(0.5);
        [
            Vector3::new(half - self.xx, -self.xy, -self.xz),
            Vector3::new(-self.xy, half - self.yy, -self.yz),
            Vector3::new(-self.xz, -self.yz, half - self.zz),
        ]
    }

    /// Returns the inertia times the z axis, J z.
    #[inline(always)]
    pub(super) fn about_z(&self) -> Vector3<T> {
        Vector3::new(self.xz, self.yz, self.zz)
    }

    /// Returns the inertia times a vector, J v.
    #[inline(always)]
    pub(super) fn inertia_times_vector(&self, v: Vector3<T>) -> Vector3<T> {
        Vector3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// Returns the wrench for the motion of the body (Newton and Euler about the frame's origin),
    /// with ms the first moments: F = m a + ω̇ × ms + ω × (ω × ms) and N = J ω̇ + ω × J ω + ms × a.
    #[inline(always)]
    pub(super) fn wrench(&self, motion: &Motion<T>) -> Wrench<T> {
        let Motion { angular_velocity: w, angular_acceleration: dw, acceleration: a } = *motion;
        let ms = self.first_moment;
        Wrench {
            force: a.scale(self.mass) + dw.cross(ms) + w.cross(w.cross(ms)),
            moment: self.inertia_times_vector(dw)
                + w.cross(self.inertia_times_vector(w))
                + ms.cross(a),
        }
    }

    /// Returns the same body in the previous link's frame.
    #[inline(always)]
    pub(super) fn to_previous(self, pose: &Pose<T>) -> Self {
        let rotated = self.rotated(
            #[inline(always)]
            |v| pose.to_previous(v),
        );
        if pose.has_offset { rotated.translated(pose.origin) } else { rotated }
    }

    /// Returns the same body in a frame with the same origin and other axes: A J Aᵀ and A ms. The
    /// argument rotates a vector.
    #[inline(always)]
    pub(super) fn rotated(self, rotate: impl Fn(Vector3<T>) -> Vector3<T>) -> Self {
        // Columns of A J, then those of A (A J)ᵀ = A J Aᵀ.
        let a = rotate(Vector3::new(self.xx, self.xy, self.xz));
        let b = rotate(Vector3::new(self.xy, self.yy, self.yz));
        let c = rotate(Vector3::new(self.xz, self.yz, self.zz));
        let x = rotate(Vector3::new(a.x, b.x, c.x));
        let y = rotate(Vector3::new(a.y, b.y, c.y));
        let z = rotate(Vector3::new(a.z, b.z, c.z));
        Self {
            xx: x.x,
            xy: x.y,
            xz: x.z,
            yy: y.y,
            yz: y.z,
            zz: z.z,
            first_moment: rotate(self.first_moment),
            mass: self.mass,
        }
    }

    /// Returns the same body in a frame with the same axes, in which this frame's origin is at p: J
    /// + (2 p·ms + m p·p) I − p msᵀ − ms pᵀ − m p pᵀ and ms + m p.
    #[inline(always)]
    pub(super) fn translated(self, p: Vector3<T>) -> Self {
        // With h = ms + m p / 2, the shift is 2 p·h I − p hᵀ − h pᵀ.
        let half = self.first_moment + p.scale(self.mass * T::constant(0.5));
        let (px, py, pz) = (p.x * half.x, p.y * half.y, p.z * half.z);
        let two = T::constant(2.0);
        Self {
            xx: self.xx + two * (py + pz),
            xy: self.xy - p.x * half.y - p.y * half.x,
            xz: self.xz - p.x * half.z - p.z * half.x,
            yy: self.yy + two * (px + pz),
            yz: self.yz - p.y * half.z - p.z * half.y,
            zz: self.zz + two * (px + py),
            first_moment: self.first_moment + p.scale(self.mass),
            mass: self.mass,
        }
    }

    /// Returns both bodies as one.
    #[inline(always)]
    pub(super) fn combined(self, other: Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            xz: self.xz + other.xz,
            yy: self.yy + other.yy,
            yz: self.yz + other.yz,
            zz: self.zz + other.zz,
            first_moment: self.first_moment + other.first_moment,
            mass: self.mass + other.mass,
        }
    }
}

impl<T: Scalar> Wrench<T> {
    #[inline(always)]
    pub(super) fn zero() -> Self {
        Self { force: Vector3::zero(), moment: Vector3::zero() }
    }

    /// Returns the generalised force on a joint: the moment about its axis or the force along it.
    #[inline(always)]
    pub(super) fn generalised_force(&self, joint: JointKind) -> T {
        match joint {
            JointKind::Revolute => self.moment.z,
            JointKind::Prismatic => self.force.z,
        }
    }

    /// Returns the same wrench at the previous link's origin: (A f, A n + p × A f).
    #[inline(always)]
    pub(super) fn to_previous(self, pose: &Pose<T>) -> Self {
        let force = pose.to_previous(self.force);
        let moment = pose.to_previous(self.moment);
        if pose.has_offset {
            Self { force, moment: moment + pose.origin.cross(force) }
        } else {
            Self { force, moment }
        }
    }

    #[inline(always)]
    pub(super) fn combined(self, other: Self) -> Self {
        Self { force: self.force + other.force, moment: self.moment + other.moment }
    }
}
