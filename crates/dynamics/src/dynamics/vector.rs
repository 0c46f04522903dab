//! Three-dimensional vectors over any [`Scalar`].
//!
//! nalgebra's vectors require more of their entries (equality, a numeric tower) than SIMD lanes and
//! dual numbers have.

use core::ops::{Add, Sub};

use crate::numeric::Scalar;

#[derive(Clone, Copy, Debug)]
pub(super) struct Vector3<T> {
    pub(super) x: T,
    pub(super) y: T,
    pub(super) z: T,
}

impl<T: Scalar> Vector3<T> {
    #[inline(always)]
    pub(super) fn new(x: T, y: T, z: T) -> Self {
        Self { x, y, z }
    }

    #[inline(always)]
    pub(super) fn zero() -> Self {
        Self::new(T::zero(), T::zero(), T::zero())
    }

    #[inline(always)]
    pub(super) fn constant(value: [f64; 3]) -> Self {
        let [x, y, z] = value.map(T::constant);
        Self { x, y, z }
    }

    #[inline(always)]
    pub(super) fn along_z(z: T) -> Self {
        Self::new(T::zero(), T::zero(), z)
    }

    #[inline(always)]
    pub(super) fn scale(self, factor: T) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }

    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> T {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Returns v × (0, 0, z), without the products that are 0.
    #[inline(always)]
    pub(super) fn cross_along_z(self, z: T) -> Self {
        Self::new(self.y * z, -(self.x * z), T::zero())
    }

    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }
}

impl<T: Scalar> Add for Vector3<T> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<T: Scalar> Sub for Vector3<T> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}
