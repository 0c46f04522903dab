//! Dual numbers: a value carries a derivative along (Griewank & Walther, *Evaluating Derivatives*,
//! ch. 3).

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use didim_dynamics::numeric::Scalar;

/// A value and its derivative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dual(pub(crate) f64, pub(crate) f64);

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}
impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}
impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0, self.1 * other.0 + self.0 * other.1)
    }
}
impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.0 / other.0;
        Self(value, (self.1 - value * other.1) / other.0)
    }
}
impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}
impl AddAssign for Dual {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl SubAssign for Dual {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
impl MulAssign for Dual {
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl Scalar for Dual {
    fn constant(value: f64) -> Self {
        Self(value, 0.0)
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.0.sin_cos();
        (Self(sin, cos * self.1), Self(cos, -sin * self.1))
    }
    fn tanh(self) -> Self {
        let value = self.0.tanh();
        Self(value, (1.0 - value * value) * self.1)
    }
    fn sign(self) -> Self {
        Self(Scalar::sign(self.0), 0.0)
    }
    fn dead_band_sign(self, threshold: f64) -> Self {
        Self(self.0.dead_band_sign(threshold), 0.0)
    }
    fn apply(self, function: impl Fn(f64) -> [f64; 2]) -> Self {
        let [value, slope] = function(self.0);
        Self(value, slope * self.1)
    }
    fn all_positive(self) -> bool {
        self.0 > 0.0
    }
}
