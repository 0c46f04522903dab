//! The shape of a power spectrum from few numbers: linear prediction on a part of the band.

/// Rows per coefficient at least, so that a short record does not choose a shape of its own.
const ROWS_PER_COEFFICIENT: f64 = 8.0;

/// Highest order that is tried.
const MAX_ORDER: usize = 24;

/// Autocorrelations that the test for whiteness looks at.
const TESTED_LAGS: usize = 12;

/// A smooth spectrum on a band, `g(φ) = σ²/|1 + Σ a_i e^{−jiφ}|²`, the band stretched to 0 ≤ φ ≤ π
/// (selective linear prediction, Makhoul, *Proc. IEEE* 63, 1975, section V).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SmoothSpectrum {
    /// a_1 … a_p; none where the spectrum is flat.
    coefficients: Vec<f64>,
    /// σ².
    level: f64,
    /// r_1, r_2, … of what the band holds, as many as are tested for whiteness.
    pub(super) autocorrelations: Vec<f64>,
}

impl SmoothSpectrum {
    /// A flat spectrum.
    pub(super) fn flat(level: f64) -> Self {
        Self { coefficients: Vec::new(), level, autocorrelations: Vec::new() }
    }

    /// Fits a periodogram given at equal steps from one end of the band to the other, which came
    /// from `samples` independent samples. The order is that of the smallest corrected information
    /// criterion (Hurvich & Tsai, *Biometrika* 76, 1989), `n ln σ_p² + n (n + p)/(n − p − 2)`.
    pub(super) fn fit(periodogram: &[f64], samples: f64) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count"
        )]
        let highest = ((samples / ROWS_PER_COEFFICIENT).max(0.0) as usize).min(MAX_ORDER);
        let r = autocovariances(periodogram, highest.max(TESTED_LAGS));
        let power = r[0];
        if power <= 0.0 || !power.is_finite() {
            return Self::flat(0.0);
        }
        let tested = TESTED_LAGS.min(highest);
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

    /// g(φ).
    pub(super) fn at(&self, phi: f64) -> f64 {
        // Horner's scheme in e^{−jφ}.
        let (sin, cos) = phi.sin_cos();
        let (mut re, mut im) = (0.0, 0.0);
        for a in self.coefficients.iter().rev().chain([&1.0]) {
            (re, im) = (re * cos + im * sin + a, im * cos - re * sin);
        }
        self.level / (re * re + im * im)
    }
}

/// `r_l = 1/K Σ'' I_k cos(π k l/K)`, l = 0 … `lags`, the ends of the sum halved.
fn autocovariances(periodogram: &[f64], lags: usize) -> Vec<f64> {
    let last = periodogram.len().saturating_sub(1);
    let steps = last.max(1);
    let cosines: Vec<f64> =
        (0..2 * steps).map(|k| (core::f64::consts::PI * k as f64 / steps as f64).cos()).collect();
    (0..=lags)
        .map(|lag| {
            let terms = periodogram.iter().enumerate().map(|(k, power)| {
                let end = if k == 0 || k == last { 0.5 } else { 1.0 };
                end * power * cosines[k * lag % (2 * steps)]
            });
            terms.sum::<f64>() / steps as f64
        })
        .collect()
}
