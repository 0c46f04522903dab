//! Sine, cosine and hyperbolic tangent of several numbers at once.
//!
//! Range reduction and a minimax polynomial (Muller, *Elementary Functions*, 3rd ed., ch. 11): one
//! sequence of additions, products and one division for every lane, without branches, so that a
//! compiler finds vector instructions for it. Angles of more than 1e5 rad, which no joint has, are
//! left to the library.

use core::f64::consts::{FRAC_2_PI, LOG2_E};

use super::dispatch::from_lanes;

/// Angle \[rad\] beyond which the standard library is used, because the range reduction would lose
/// digits.
const LARGEST_ANGLE: f64 = 1e5;

/// 1.5 · 2⁵²: added to a number of at most 2⁵¹, it leaves the nearest whole number in the lowest
/// bits.
const ROUND_TO_INTEGER: f64 = 6_755_399_441_055_744.0;

/// π/2 in three parts, of which the first two have 33 bits, so that products with whole numbers up
/// to 2²⁰ are exact (Cody and Waite, *Software Manual for the Elementary Functions*, 1980).
const HALF_PI: [f64; 3] =
    [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

/// ln 2 in two parts, the first of 32 bits.
const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];

/// (sin r − r)/r³ in r² for |r| ≤ π/4, a minimax polynomial (FreeBSD's `k_sin.c`), and
/// (cos r − 1 + r²/2)/r⁴ (`k_cos.c`).
const SIN_COEFFICIENTS: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const COS_COEFFICIENTS: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// 1/2! to 1/13!: e^r − 1 = r + r² (…) is off by r¹⁴/14! or 2e-17 for |r| ≤ ln 2 / 2.
const EXP_COEFFICIENTS: [f64; 12] = [
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

/// Returns c₀ + x (c₁ + x (c₂ + …)).
#[inline(always)]
fn polynomial<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |value, c| value * x + c)
}

/// Returns sines and cosines, each within 2.5e-16 of the exact value.
#[inline(always)]
pub(crate) fn sin_cos<const L: usize>(angles: &[f64; L]) -> ([f64; L], [f64; L]) {
    // The steps run for all lanes one after the other, which lets a compiler find vector
    // instructions: x = k π/2 + r
    let rounded: [f64; L] = from_lanes(
        #[inline(always)]
        |l| angles[l] * FRAC_2_PI + ROUND_TO_INTEGER,
    );
    let r: [f64; L] = from_lanes(
        #[inline(always)]
        |l| {
            let k = rounded[l] - ROUND_TO_INTEGER;
            ((angles[l] - k * HALF_PI[0]) - k * HALF_PI[1]) - k * HALF_PI[2]
        },
    );
    let square: [f64; L] = from_lanes(
        #[inline(always)]
        |l| r[l] * r[l],
    );
    let sin: [f64; L] = from_lanes(
        #[inline(always)]
        |l| r[l] + r[l] * square[l] * polynomial(&SIN_COEFFICIENTS, square[l]),
    );
    let cos: [f64; L] = from_lanes(
        #[inline(always)]
        |l| {
            (1.0 - 0.5 * square[l])
                + square[l] * square[l] * polynomial(&COS_COEFFICIENTS, square[l])
        },
    );
    let quarters = |l: usize| rounded[l].to_bits();
    let mut sines = from_lanes(
        #[inline(always)]
        |l| in_quadrant(sin[l], cos[l], quarters(l), quarters(l)),
    );
    let mut cosines = from_lanes(
        #[inline(always)]
        |l| in_quadrant(cos[l], sin[l], quarters(l), quarters(l).wrapping_add(1)),
    );
    // A NaN among the angles has already produced NaN.
    if angles.iter().any(|x| x.abs() > LARGEST_ANGLE) {
        for ((sine, cosine), x) in sines.iter_mut().zip(&mut cosines).zip(angles) {
            if x.abs() > LARGEST_ANGLE {
                (*sine, *cosine) = (x.sin(), x.cos());
            }
        }
    }
    (sines, cosines)
}

/// Returns sine or cosine after a number of quarter turns: the other one where the number is odd,
/// and negative where the second bit of `sign` is set.
#[inline(always)]
fn in_quadrant(own: f64, other: f64, quarters: u64, sign: u64) -> f64 {
    let odd = 0_u64.wrapping_sub(quarters & 1);
    let (own, other) = (own.to_bits(), other.to_bits());
    f64::from_bits((own ^ ((own ^ other) & odd)) ^ ((sign & 2) << 62))
}

/// Argument beyond which the hyperbolic tangent is ±1 to the last bit.
const TANH_SATURATION: f64 = 20.0;

/// Returns hyperbolic tangents with relative errors of at most 5e-16.
#[inline(always)]
pub(crate) fn tanh<const L: usize>(values: &[f64; L]) -> [f64; L] {
    let twice = from_lanes::<L>(
        #[inline(always)]
        |l| {
            // `min` would lose a NaN.
            let size = values[l].abs();
            2.0 * if size > TANH_SATURATION { TANH_SATURATION } else { size }
        },
    );
    // 2 |x| = k ln 2 + r, and e^(2|x|) − 1 = 2^k (e^r − 1) + 2^k − 1.
    let rounded = from_lanes::<L>(
        #[inline(always)]
        |l| twice[l] * LOG2_E + ROUND_TO_INTEGER,
    );
    let r = from_lanes::<L>(
        #[inline(always)]
        |l| {
            let k = rounded[l] - ROUND_TO_INTEGER;
            (twice[l] - k * LN_2[0]) - k * LN_2[1]
        },
    );
    let small = from_lanes::<L>(
        #[inline(always)]
        |l| r[l] + r[l] * r[l] * polynomial(&EXP_COEFFICIENTS, r[l]),
    );
    from_lanes(
        #[inline(always)]
        |l| {
            let power = f64::from_bits(rounded[l].to_bits().wrapping_add(1023) << 52);
            let grown = power * small[l] + (power - 1.0);
            (grown / (grown + 2.0)).copysign(values[l])
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers between −size and size, dense near 0 as well.
    fn numbers(size: f64) -> impl Iterator<Item = f64> {
        (0..400_000_u32).map(move |k| {
            let share = f64::from(k) / 200_000.0 - 1.0;
            size * if k % 2 == 0 { share } else { share.powi(9) }
        })
    }

    #[test]
    fn sines_and_cosines_are_within_their_bound() {
        for size in [1.0, 10.0, 1e3, 9e4] {
            for x in numbers(size) {
                let ([_, sin], [_, cos]) = sin_cos(&[0.3, x]);
                // The library's are within half a unit of the last place, 6e-17.
                assert!((sin - x.sin()).abs() < 3e-16, "sin {x}");
                assert!((cos - x.cos()).abs() < 3e-16, "cos {x}");
            }
        }
    }

    #[test]
    #[allow(clippy::float_cmp, reason = "values that must be exact")]
    fn extremes_are_those_of_the_library() {
        for x in [1e6, -3e9, 1e300] {
            assert_eq!(sin_cos(&[x]), ([x.sin()], [x.cos()]));
        }
        assert_eq!(sin_cos(&[0.0, -0.0]), ([0.0; 2], [1.0; 2]));
        for x in [f64::NAN, f64::INFINITY] {
            let ([sin], [cos]) = sin_cos(&[x]);
            assert!(sin.is_nan() && cos.is_nan());
        }
        assert!(tanh(&[f64::NAN])[0].is_nan());
        assert_eq!(tanh(&[f64::INFINITY, -1e9, 20.5, -0.0]), [1.0, -1.0, 1.0, 0.0]);
    }

    #[test]
    fn hyperbolic_tangents_are_within_their_bound() {
        for size in [1e-3, 0.5, 3.0, 25.0] {
            for x in numbers(size) {
                let [found, other] = tanh(&[x, -x]);
                assert!((found - x.tanh()).abs() <= 7e-16 * x.tanh().abs(), "{x}");
                assert!((found + other).abs() <= 0.0, "{x}");
            }
        }
    }
}
