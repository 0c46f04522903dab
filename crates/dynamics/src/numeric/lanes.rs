//! Several numbers at once (SIMD): one computation on several motions or parameter sets.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use super::dispatch::{from_lanes, with_vector_instructions};
use super::elementary;
use super::scalar::Scalar;

/// `L` numbers that go through the same computation. Every lane has the bits of the same
/// computation in `f64`. The compiler uses vector instructions. The alignment keeps a vector
/// register within one cache line; a store across two lines takes twice as long.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Lanes<const L: usize>(pub [f64; L]);

impl<const L: usize> Lanes<L> {
    /// Creates lanes from `value` of each lane.
    #[inline(always)]
    pub fn from_fn(value: impl FnMut(usize) -> f64) -> Self {
        Self(from_lanes(value))
    }

    #[inline(always)]
    fn zip(self, other: Self, operation: impl Fn(f64, f64) -> f64) -> Self {
        Self(from_lanes(
            #[inline(always)]
            |l| operation(self.0[l], other.0[l]),
        ))
    }

    #[inline(always)]
    fn map(self, operation: impl Fn(f64) -> f64) -> Self {
        Self(from_lanes(
            #[inline(always)]
            |l| operation(self.0[l]),
        ))
    }
}

impl<const L: usize> Add for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, Add::add)
    }
}

impl<const L: usize> AddAssign for Lanes<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize> Sub for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, Sub::sub)
    }
}

impl<const L: usize> SubAssign for Lanes<L> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const L: usize> Mul for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, Mul::mul)
    }
}

impl<const L: usize> MulAssign for Lanes<L> {
    #[inline(always)]
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl<const L: usize> Div for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, Div::div)
    }
}

impl<const L: usize> Neg for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(Neg::neg)
    }
}

impl<const L: usize> Scalar for Lanes<L> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self([value; L])
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = elementary::sin_cos(&self.0);
        (Self(sin), Self(cos))
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        Self(elementary::tanh(&self.0))
    }
    #[inline(always)]
    fn vectorised<R>(work: impl FnOnce() -> R) -> R {
        with_vector_instructions(work)
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        self.0.iter().all(|value| *value == 0.0)
    }
    #[inline(always)]
    fn sign(self) -> Self {
        self.map(Scalar::sign)
    }
    #[inline(always)]
    fn dead_band_sign(self, threshold: f64) -> Self {
        self.map(
            #[inline(always)]
            |value| value.dead_band_sign(threshold),
        )
    }
    #[inline(always)]
    fn apply(self, function: impl Fn(f64) -> [f64; 2]) -> Self {
        self.map(
            #[inline(always)]
            |number| number.apply(&function),
        )
    }
    #[inline(always)]
    fn all_positive(self) -> bool {
        // The fold has no branch per lane.
        self.0.iter().fold(true, |all, value| all & (*value > 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lane must not know of the others: neither of their values nor of their number.
    #[test]
    fn every_lane_has_the_bits_of_a_number_alone() {
        let values = [0.3, -2.7, 2e5, 1e-9, -0.0, f64::NAN, -880.0, 19.9];
        let x = Lanes(values);
        let y = Lanes::<8>::from_fn(|l| values[7 - l] + 0.1);
        let ((sin, cos), tanh) = (x.sin_cos(), x.tanh());
        for (l, &a) in values.iter().enumerate() {
            let b = y.0[l];
            let pairs = [
                (sin, Scalar::sin_cos(a).0),
                (cos, Scalar::sin_cos(a).1),
                (tanh, Scalar::tanh(a)),
                (x + y, a + b),
                (x - y, a - b),
                (x * y, a * b),
                (x / y, a / b),
                (-x, -a),
                (x.sign(), Scalar::sign(a)),
                (x.dead_band_sign(3.0), a.dead_band_sign(3.0)),
            ];
            for (k, (found, expected)) in pairs.into_iter().enumerate() {
                assert!(
                    found.0[l].to_bits() == expected.to_bits()
                        || (found.0[l].is_nan() && expected.is_nan()),
                    "operation {k} of {a}: {} is not {expected}",
                    found.0[l]
                );
            }
        }
    }

    #[test]
    fn one_lane_decides_for_all() {
        assert!(Lanes([1.0, 2.0]).all_positive());
        assert!(!Lanes([1.0, 0.0]).all_positive() && !Lanes([f64::NAN, 1.0]).all_positive());
        assert!(Lanes([0.0, -0.0]).is_zero() && !Lanes([0.0, 1e-300]).is_zero());
    }
}
