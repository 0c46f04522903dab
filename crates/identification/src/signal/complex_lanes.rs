//! Complex numbers in the lanes of vector instructions.

use nalgebra::Complex;

use didim_dynamics::numeric::{Lanes, Scalar, WIDTH};

/// Complex number in each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ComplexLanes {
    pub(super) re: Lanes<WIDTH>,
    pub(super) im: Lanes<WIDTH>,
}

impl ComplexLanes {
    pub(super) const ZERO: Self = Self { re: Lanes([0.0; WIDTH]), im: Lanes([0.0; WIDTH]) };

    pub(super) fn from_numbers(numbers: &[Complex<f64>]) -> Self {
        let number = |l: usize| numbers.get(l).copied().unwrap_or_default();
        Self { re: Lanes::from_fn(|l| number(l).re), im: Lanes::from_fn(|l| number(l).im) }
    }

    pub(super) fn numbers(&self) -> impl Iterator<Item = Complex<f64>> {
        self.re.0.into_iter().zip(self.im.0).map(|(re, im)| Complex::new(re, im))
    }

    #[inline(always)]
    pub(super) fn product(&self, other: &Self) -> Self {
        Self {
            re: self.re * other.re - self.im * other.im,
            im: self.re * other.im + self.im * other.re,
        }
    }

    #[inline(always)]
    pub(super) fn sum_with(&self, other: &Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }

    #[inline(always)]
    pub(super) fn difference_from(&self, other: &Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }

    #[inline(always)]
    pub(super) fn scaled(&self, factor: Lanes<WIDTH>) -> Self {
        Self { re: self.re * factor, im: self.im * factor }
    }

    /// Returns the real part of the sum of the products.
    #[inline(always)]
    pub(super) fn dot(&self, other: &Self) -> f64 {
        lane_sum(self.re * other.re - self.im * other.im)
    }

    /// Applies the recursion of a pole p to one more sample: p z + x.
    #[inline(always)]
    pub(super) fn step(&self, pole: &Self, sample: f64) -> Self {
        let Self { re, im } = self.product(pole);
        Self { re: re + Lanes::constant(sample), im }
    }
}

#[inline(always)]
fn lane_sum(Lanes(x): Lanes<WIDTH>) -> f64 {
    (x[0] + x[2]) + (x[1] + x[3])
}
