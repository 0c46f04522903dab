//! Smooth shape of a power spectrum, described by few coefficients: linear prediction on a part of
//! the frequency band.

use super::limits::RegressionLimits;
use didim_dynamics::numeric::{Lanes, Scalar, WIDTH, with_vector_instructions};

/// Highest order that is tried.
const MAX_ORDER: usize = 24;

/// Number of autocorrelations in the test for whiteness.
const TESTED_LAG_COUNT: usize = 12;

/// Number of values of a spectrum that are computed in parallel.
const VALUES_AT_ONCE: usize = WIDTH;

/// Number of groups of lags, starting from 0, that are computed in parallel.
const LAG_GROUPS: usize = (if MAX_ORDER > TESTED_LAG_COUNT { MAX_ORDER } else { TESTED_LAG_COUNT }
    + 1)
.div_ceil(VALUES_AT_ONCE);

/// Common data of spectra on one band.
#[derive(Clone, Debug)]
pub(super) struct PassBand {
    /// cos(π k/K) over a full revolution, where K + 1 is the number of frequencies of a
    /// periodogram.
    cosines: Vec<f64>,
    /// cos φ and sin φ of the required spectrum values, and their number.
    directions: Vec<[Lanes<VALUES_AT_ONCE>; 2]>,
    count: usize,
}

impl PassBand {
    /// Creates a band for periodograms of this number of values, and for spectra at these φ.
    pub(super) fn new(periodogram: usize, phases: impl Iterator<Item = f64>) -> Self {
        let steps = periodogram.saturating_sub(1).max(1);
        let turn: Vec<f64> = (0..2 * steps)
            .map(|k| (core::f64::consts::PI * k as f64 / steps as f64).cos())
            .collect();
        let phases: Vec<[f64; 2]> = phases.map(|phi| [phi.cos(), phi.sin()]).collect();
        let directions = phases.chunks(VALUES_AT_ONCE).map(|phases| {
            let part =
                |which: usize| Lanes::from_fn(|l| phases.get(l).map_or(1.0, |phi| phi[which]));
            [part(0), part(1)]
        });
        Self { cosines: turn, directions: directions.collect(), count: phases.len() }
    }

    /// Returns `r_l = 1/K Σ'' I_k cos(π k l/K)`, l = 0 … `lags`, with the ends of the sum halved.
    fn autocovariances(&self, periodogram: &[f64], lag_count: usize) -> Vec<f64> {
        let last = periodogram.len().saturating_sub(1);
        let mut sums = [Lanes::<VALUES_AT_ONCE>::zero(); LAG_GROUPS];
        with_vector_instructions(
            #[inline(always)]
            || {
                for (k, power) in periodogram.iter().enumerate() {
                    let end = k == 0 || k == last;
                    let power = Lanes::constant(if end { 0.5 * power } else { *power });
                    // cos(π k l/K) for one lag l after the other.
                    let mut place = 0;
                    for sum in &mut sums {
                        *sum += power
                            * Lanes::from_fn(|_| {
                                let cosine = self.cosines[place];
                                place += k;
                                place -= if place >= self.cosines.len() {
                                    self.cosines.len()
                                } else {
                                    0
                                };
                                cosine
                            });
                    }
                }
            },
        );
        let of_lag_counts = sums.iter().flat_map(|sums| sums.0).take(lag_count + 1);
        of_lag_counts.map(|sum| sum / last.max(1) as f64).collect()
    }
}

/// Smooth spectrum on a band, `g(φ) = σ²/|1 + Σ a_i e^{−jiφ}|²`. The band is mapped to 0 ≤ φ ≤ π
/// (selective linear prediction, Makhoul, *Proc. IEEE* 63, 1975, section V).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SmoothSpectrum {
    /// Coefficients a_1 … a_p; empty for a flat spectrum.
    coefficients: Vec<f64>,
    /// Level σ².
    level: f64,
    /// Autocorrelations r_1, r_2, … of the band, as many as the test for whiteness uses.
    pub(super) autocorrelations: Vec<f64>,
}

impl SmoothSpectrum {
    /// Creates a flat spectrum.
    pub(super) fn flat(level: f64) -> Self {
        Self { coefficients: Vec::new(), level, autocorrelations: Vec::new() }
    }

    /// Fits a periodogram with equal steps from one end of the band to the other. `samples` is the
    /// number of independent samples of the record. The order is the one with the smallest
    /// corrected information criterion (Hurvich & Tsai, *Biometrika* 76, 1989), `n ln σ_p² + n (n +
    /// p)/(n − p − 2)`.
    pub(super) fn fit(band: &PassBand, periodogram: &[f64], samples: f64) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count"
        )]
        let highest = ((samples / RegressionLimits::DEFAULT.rows_per_coefficient).max(0.0)
            as usize)
            .min(MAX_ORDER);
        let r = band.autocovariances(periodogram, highest.max(TESTED_LAG_COUNT));
        let power = r[0];
        if power <= 0.0 || !power.is_finite() {
            return Self::flat(0.0);
        }
        let tested = TESTED_LAG_COUNT.min(highest);
        let autocorrelations = r[1..=tested].iter().map(|r| r / power).collect();
        let criterion = |error: f64, p: f64| {
            samples * error.ln() + samples * (samples + p) / (samples - p - 2.0)
        };
        // Levinson and Durbin's recursion.
        let mut best = (criterion(power, 0.0), Vec::new(), power);
        let (mut a, mut error): (Vec<f64>, f64) = (Vec::new(), power);
        for p in 1..=highest {
            let past: f64 = a.iter().zip(r[1..p].iter().rev()).map(|(a, r)| a * r).sum();
            let reflection = -(r[p] + past) / error;
            let mirrored: Vec<f64> = a.iter().rev().copied().collect();
            for (a, m) in a.iter_mut().zip(mirrored) {
                *a += reflection * m;
            }
            a.push(reflection);
            error *= 1.0 - reflection * reflection;
            if error <= f64::EPSILON * power {
                break;
            }
            let value = criterion(error, p as f64);
            if value < best.0 {
                best = (value, a.clone(), error);
            }
        }
        let (_, coefficients, level) = best;
        Self { coefficients, level, autocorrelations }
    }

    /// Returns g(0).
    pub(super) fn at_zero(&self) -> f64 {
        let sum = 1.0 + self.coefficients.iter().sum::<f64>();
        self.level / (sum * sum)
    }

    /// Returns g(φ) at the angles φ of the band.
    pub(super) fn values(&self, band: &PassBand) -> Vec<f64> {
        let mut values = Vec::with_capacity(band.directions.len() * VALUES_AT_ONCE);
        with_vector_instructions(
            #[inline(always)]
            || {
                for &[cos, sin] in &band.directions {
                    // Horner's scheme in e^{−jφ}.
                    let (mut re, mut im) = (Lanes::zero(), Lanes::zero());
                    for a in self.coefficients.iter().rev().chain([&1.0]) {
                        (re, im) = (re * cos + im * sin + Lanes::constant(*a), im * cos - re * sin);
                    }
                    let value = Lanes::constant(self.level) / (re * re + im * im);
                    values.extend_from_slice(&value.0);
                }
            },
        );
        values.truncate(band.count);
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_value_at_zero_is_that_of_the_spectrum() {
        let phases = [0.0, 0.5, 1.0];
        let band = PassBand::new(65, phases.into_iter());
        // The spectrum of x_k = 0.8 x_(k−1) + e_k.
        let power = |phi: f64| 1.0 / (1.64 - 1.6 * phi.cos());
        let periodogram: Vec<f64> =
            (0..65).map(|k| power(core::f64::consts::PI * f64::from(k) / 64.0)).collect();
        let fitted = SmoothSpectrum::fit(&band, &periodogram, 1e4);
        let values = fitted.values(&band);
        assert!((fitted.at_zero() / values[0] - 1.0).abs() < 1e-9, "{}", fitted.at_zero());
        for (value, phi) in values.iter().zip(phases) {
            assert!((value / power(phi) - 1.0).abs() < 0.01, "{value} at {phi}");
        }
    }
}
