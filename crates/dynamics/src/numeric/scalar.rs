//! The arithmetic that the dynamics need, so that one source serves `f64`, SIMD lanes and dual
//! numbers.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use super::dispatch::{WIDTH, with_vector_instructions};
use super::elementary;

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
    /// Returns the constant `value` in every lane, with derivative 0.
    fn constant(value: f64) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// True if it is 0 in every lane with every derivative; false if that is unknown.
    fn is_zero(self) -> bool {
        false
    }
    /// Computes sines and cosines of several angles, which may be faster together. All slices have
    /// the same length.
    #[inline(always)]
    fn sin_cos_each(angles: &[Self], sines: &mut [Self], cosines: &mut [Self]) {
        for ((angle, sin), cos) in angles.iter().zip(sines).zip(cosines) {
            (*sin, *cos) = angle.sin_cos();
        }
    }
    /// Replaces several values by their hyperbolic tangents, which may be faster together.
    #[inline(always)]
    fn tanh_each(values: &mut [Self]) {
        for value in values {
            *value = value.tanh();
        }
    }
    /// −1, 0 or 1; 0 at exactly 0.
    fn sign(self) -> Self;
    /// −1 or 1 where the magnitude reaches `threshold`, 0 below it.
    fn dead_band_sign(self, threshold: f64) -> Self;
    /// Applies a function of one number, given by its value and its derivative, in every lane.
    fn apply(self, function: impl Fn(f64) -> [f64; 2]) -> Self;
    /// True if every lane is above 0; false for NaN.
    fn all_positive(self) -> bool;

    /// Runs `work`, a computation over this type, with the vector instructions that it can use.
    #[inline(always)]
    fn vectorised<R>(work: impl FnOnce() -> R) -> R {
        work()
    }

    /// The additive identity.
    fn zero() -> Self {
        Self::constant(0.0)
    }
}

/// Number of values that an elementary function processes at once.
const GROUP_SIZE: usize = WIDTH;

/// Returns [`GROUP_SIZE`] of the numbers from `start` on, with zeros beyond the end.
#[inline(always)]
fn load_lanes(values: &[f64], start: usize) -> [f64; GROUP_SIZE] {
    let values = &values[start..];
    if let Some(window) = values.first_chunk() {
        return *window;
    }
    let mut window = [0.0; GROUP_SIZE];
    window[..values.len()].copy_from_slice(values);
    window
}

/// Writes a group of lanes back, without the part beyond the end.
#[inline(always)]
fn set_window(values: &mut [f64], start: usize, window: &[f64; GROUP_SIZE]) {
    let values = &mut values[start..];
    match values.first_chunk_mut() {
        Some(values) => *values = *window,
        None => values.copy_from_slice(&window[..values.len()]),
    }
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
    fn sin_cos_each(angles: &[Self], sines: &mut [Self], cosines: &mut [Self]) {
        with_vector_instructions(
            #[inline(always)]
            || {
                // The last window overlaps the one before rather than being filled up.
                let last = angles.len().saturating_sub(GROUP_SIZE);
                for start in (0..last).step_by(GROUP_SIZE).chain([last]) {
                    let (sin, cos) = elementary::sin_cos(&load_lanes(angles, start));
                    set_window(sines, start, &sin);
                    set_window(cosines, start, &cos);
                }
            },
        );
    }
    fn tanh_each(values: &mut [Self]) {
        with_vector_instructions(
            #[inline(always)]
            || {
                // The last window overlaps: it is read before the others are replaced.
                let last = values.len().saturating_sub(GROUP_SIZE);
                let of_last = elementary::tanh(&load_lanes(values, last));
                for start in (0..last).step_by(GROUP_SIZE) {
                    let tanh = elementary::tanh(&load_lanes(values, start));
                    set_window(values, start, &tanh);
                }
                set_window(values, last, &of_last);
            },
        );
    }
    #[inline(always)]
    fn sign(self) -> Self {
        // The computation has no branch, because no processor could predict it.
        let [above, below] = [self > 0.0, self < 0.0].map(|is| if is { 1.0 } else { 0.0 });
        above - below
    }
    #[inline(always)]
    fn dead_band_sign(self, threshold: f64) -> Self {
        if self.abs() < threshold { 0.0 } else { Scalar::sign(self) }
    }
    #[inline(always)]
    fn apply(self, function: impl Fn(f64) -> [f64; 2]) -> Self {
        let [value, _] = function(self);
        value
    }
    #[inline(always)]
    fn all_positive(self) -> bool {
        self > 0.0
    }
}
