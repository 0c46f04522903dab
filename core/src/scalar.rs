//! The arithmetic that the dynamics need, so that one source serves `f64`, SIMD lanes and dual
//! numbers.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::elementary;

/// A field with the few functions that rigid-body dynamics and friction use.
///
/// Branches on a value are expressed as functions (`sign`, `dead_band_sign`), so that a type that
/// holds several values at once can implement them.
pub trait Scalar:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// The constant `value` in every lane, with no derivative.
    fn constant(value: f64) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// Whether it is 0 in every lane with every derivative; false where that is not known.
    fn is_zero(self) -> bool {
        false
    }
    /// Sines and cosines of several angles, which may be faster together; as many of each as angles.
    #[inline(always)]
    fn sin_cos_each(angles: &[Self], sines: &mut [Self], cosines: &mut [Self]) {
        for ((angle, sin), cos) in angles.iter().zip(sines).zip(cosines) {
            (*sin, *cos) = angle.sin_cos();
        }
    }
    /// Hyperbolic tangents of several values in place, which may be faster together.
    #[inline(always)]
    fn tanh_each(values: &mut [Self]) {
        for value in values {
            *value = value.tanh();
        }
    }
    /// Square root; NaN for a negative value.
    fn sqrt(self) -> Self;
    /// −1, 0 or 1; 0 at exactly 0.
    fn sign(self) -> Self;
    /// −1 or 1 where the magnitude reaches `threshold`, 0 below it.
    fn dead_band_sign(self, threshold: f64) -> Self;
    /// Whether every lane is above 0; false for NaN.
    fn all_positive(self) -> bool;

    /// The additive identity.
    fn zero() -> Self {
        Self::constant(0.0)
    }
}

/// Numbers that go through an elementary function at once: those of the widest vector register that
/// is looked for.
const TOGETHER: usize = 4;

/// At most [`TOGETHER`] numbers, and zeros.
#[inline(always)]
fn filled(values: &[f64]) -> [f64; TOGETHER] {
    let mut filled = [0.0; TOGETHER];
    filled[..values.len()].copy_from_slice(values);
    filled
}

impl Scalar for f64 {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let ([sin], [cos]) = elementary::sin_cos(&[self]);
        (sin, cos)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        let [tanh] = elementary::tanh(&[self]);
        tanh
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        self == 0.0
    }
    #[inline(always)]
    fn sin_cos_each(angles: &[Self], sines: &mut [Self], cosines: &mut [Self]) {
        let sides = sines.chunks_mut(TOGETHER).zip(cosines.chunks_mut(TOGETHER));
        for (angles, (sines, cosines)) in angles.chunks(TOGETHER).zip(sides) {
            let (sin, cos) = elementary::sin_cos(&filled(angles));
            sines.copy_from_slice(&sin[..angles.len()]);
            cosines.copy_from_slice(&cos[..angles.len()]);
        }
    }
    #[inline(always)]
    fn tanh_each(values: &mut [Self]) {
        for values in values.chunks_mut(TOGETHER) {
            let tanh = elementary::tanh(&filled(values));
            values.copy_from_slice(&tanh[..values.len()]);
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn sign(self) -> Self {
        if self > 0.0 {
            1.0
        } else if self < 0.0 {
            -1.0
        } else {
            0.0
        }
    }
    #[inline(always)]
    fn dead_band_sign(self, threshold: f64) -> Self {
        if self.abs() < threshold { 0.0 } else { Scalar::sign(self) }
    }
    #[inline(always)]
    fn all_positive(self) -> bool {
        self > 0.0
    }
}
