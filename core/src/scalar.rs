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
    /// Sines and cosines of several angles, which may be faster together.
    fn sin_cos_of<const L: usize>(angles: [Self; L]) -> ([Self; L], [Self; L]) {
        let both = angles.map(Self::sin_cos);
        (both.map(|(sin, _)| sin), both.map(|(_, cos)| cos))
    }
    /// Hyperbolic tangents of several values, which may be faster together.
    fn tanh_of<const L: usize>(values: [Self; L]) -> [Self; L] {
        values.map(Self::tanh)
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

impl Scalar for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn sin_cos(self) -> (Self, Self) {
        let ([sin], [cos]) = elementary::sin_cos([self]);
        (sin, cos)
    }
    fn tanh(self) -> Self {
        let [tanh] = elementary::tanh([self]);
        tanh
    }
    fn is_zero(self) -> bool {
        self == 0.0
    }
    fn sin_cos_of<const L: usize>(angles: [Self; L]) -> ([Self; L], [Self; L]) {
        elementary::sin_cos(angles)
    }
    fn tanh_of<const L: usize>(values: [Self; L]) -> [Self; L] {
        elementary::tanh(values)
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn sign(self) -> Self {
        if self > 0.0 {
            1.0
        } else if self < 0.0 {
            -1.0
        } else {
            0.0
        }
    }
    fn dead_band_sign(self, threshold: f64) -> Self {
        if self.abs() < threshold { 0.0 } else { Scalar::sign(self) }
    }
    fn all_positive(self) -> bool {
        self > 0.0
    }
}
