//! Dual numbers: a value with its derivatives in several directions at once.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::scalar::Scalar;

/// A value and its derivative in each of `N` directions (forward differentiation; Griewank &
/// Walther, *Evaluating Derivatives*, ch. 3).
///
/// [`sign`](Scalar::sign) and [`dead_band_sign`](Scalar::dead_band_sign) have the derivative 0,
/// which is theirs everywhere but where they jump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// Its derivatives.
    pub slope: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A value that changes at a rate of 1 in one direction; in none where there is no such one.
    pub fn variable(value: f64, direction: usize) -> Self {
        let mut variable = Self::constant(value);
        if let Some(slope) = variable.slope.get_mut(direction) {
            *slope = 1.0;
        }
        variable
    }

    /// f(x) with f'(x) already known.
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self { value, slope: self.slope.map(|slope| derivative * slope) }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    fn sub(mut self, other: Self) -> Self {
        self -= other;
        self
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl, reason = "(x y)' = x' y + x y'")]
    fn mul(self, other: Self) -> Self {
        let slope = |k: usize| self.slope[k] * other.value + self.value * other.slope[k];
        Self { value: self.value * other.value, slope: core::array::from_fn(slope) }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl, reason = "(x/y)' = (x' − (x/y) y')/y")]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let slope = |k: usize| (self.slope[k] - value * other.slope[k]) / other.value;
        Self { value, slope: core::array::from_fn(slope) }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    fn add_assign(&mut self, other: Self) {
        self.value += other.value;
        for (slope, other) in self.slope.iter_mut().zip(other.slope) {
            *slope += other;
        }
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    fn sub_assign(&mut self, other: Self) {
        self.value -= other.value;
        for (slope, other) in self.slope.iter_mut().zip(other.slope) {
            *slope -= other;
        }
    }
}

impl<const N: usize> MulAssign for Dual<N> {
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl<const N: usize> Scalar for Dual<N> {
    fn constant(value: f64) -> Self {
        Self { value, slope: [0.0; N] }
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = Scalar::sin_cos(self.value);
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    fn tanh(self) -> Self {
        let tanh = Scalar::tanh(self.value);
        self.chain(tanh, 1.0 - tanh * tanh)
    }
    fn sign(self) -> Self {
        Self::constant(Scalar::sign(self.value))
    }
    fn dead_band_sign(self, threshold: f64) -> Self {
        Self::constant(self.value.dead_band_sign(threshold))
    }
    fn all_positive(self) -> bool {
        self.value > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation against the derivative that calculus gives it.
    #[test]
    fn operations_follow_the_rules_of_differentiation() {
        let (a, b) = (0.7, 1.9);
        let (x, y) = (Dual::<2>::variable(a, 0), Dual::<2>::variable(b, 1));
        let near = |found: Dual<2>, value: f64, slope: [f64; 2]| {
            let pairs =
                [(found.value, value), (found.slope[0], slope[0]), (found.slope[1], slope[1])];
            for (found, expected) in pairs {
                // A few roundings of numbers of the order of 1.
                assert!((found - expected).abs() < 1e-15, "{found} is not {expected}");
            }
        };
        near(x * y, a * b, [b, a]);
        near(x / y, a / b, [1.0 / b, -a / (b * b)]);
        near(x - y, a - b, [1.0, -1.0]);
        near(-(x + y), -a - b, [-1.0, -1.0]);
        near(x.tanh(), a.tanh(), [1.0 - a.tanh().powi(2), 0.0]);
        let (sin, cos) = x.sin_cos();
        near(sin, a.sin(), [a.cos(), 0.0]);
        near(cos, a.cos(), [-a.sin(), 0.0]);
        near((-x).sign(), -1.0, [0.0; 2]);
        near(x.dead_band_sign(0.8), 0.0, [0.0; 2]);
    }
}
