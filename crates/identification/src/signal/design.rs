//! Butterworth and Chebyshev low-pass filters by the bilinear transform
//! (Oppenheim & Schafer, *Discrete-Time Signal Processing*, chapter 7).

use core::f64::consts::PI;

use super::error::SignalError;
use super::limits::{CUTOFF_MARGIN, MAX_ORDER, RIPPLE_RANGE_DB};
use super::sections::{SecondOrderSections, Section};

/// Designs a Butterworth low-pass filter: 3 dB down at the cut-off on one pass, 6 dB forward and
/// backward.
///
/// `cutoff_ratio` is the cut-off frequency divided by the Nyquist frequency (half the sample rate),
/// pre-warped so that it is exact. The response is that of SciPy's `butter(order, cutoff_ratio)`.
///
/// # Errors
/// [`SignalError::Order`] and [`SignalError::Cutoff`].
pub fn butterworth_low_pass(
    order: usize,
    cutoff_ratio: f64,
) -> Result<SecondOrderSections, SignalError> {
    check_design(order, cutoff_ratio)?;
    Ok(low_pass(order, cutoff_ratio, PoleEllipse { real: 1.0, imaginary: 1.0 }, 1.0))
}

/// Designs a Chebyshev type I low-pass filter. The gain varies within `ripple_db` up to the cut-off
/// and decreases monotonically above it.
///
/// The response is that of SciPy's `cheby1(order, ripple_db, cutoff_ratio)`; an even order has the
/// gain −`ripple_db` at zero frequency.
///
/// # Errors
/// [`SignalError::Order`], [`SignalError::Cutoff`] and [`SignalError::Ripple`].
pub fn chebyshev1_low_pass(
    order: usize,
    ripple_db: f64,
    cutoff_ratio: f64,
) -> Result<SecondOrderSections, SignalError> {
    check_design(order, cutoff_ratio)?;
    if !(RIPPLE_RANGE_DB.0..=RIPPLE_RANGE_DB.1).contains(&ripple_db) {
        return Err(SignalError::Ripple { ripple_db });
    }
    // ε² = 10^(ripple/10) − 1 and μ = asinh(1/ε)/order place the poles on an ellipse.
    let epsilon_squared = (0.1 * ripple_db * core::f64::consts::LN_10).exp_m1();
    let mu = (1.0 / epsilon_squared.sqrt()).asinh() / order as f64;
    let gain = if order.is_multiple_of(2) { 1.0 / (1.0 + epsilon_squared).sqrt() } else { 1.0 };
    let ellipse = PoleEllipse { real: mu.sinh(), imaginary: mu.cosh() };
    Ok(low_pass(order, cutoff_ratio, ellipse, gain))
}

/// Half axes of the ellipse with the poles of the analogue prototype with cut-off 1 rad/s; a circle
/// for Butterworth.
struct PoleEllipse {
    real: f64,
    imaginary: f64,
}

fn check_design(order: usize, cutoff_ratio: f64) -> Result<(), SignalError> {
    if !(1..=MAX_ORDER).contains(&order) {
        return Err(SignalError::Order { order });
    }
    if !(CUTOFF_MARGIN..=1.0 - CUTOFF_MARGIN).contains(&cutoff_ratio) {
        return Err(SignalError::Cutoff { ratio: cutoff_ratio });
    }
    Ok(())
}

fn low_pass(
    order: usize,
    cutoff_ratio: f64,
    ellipse: PoleEllipse,
    gain: f64,
) -> SecondOrderSections {
    // s = (z − 1)/(z + 1) maps the digital cut-off π·ratio to tan(π·ratio/2).
    let cutoff = (0.5 * PI * cutoff_ratio).tan();
    // Poles −real·cos θ ± j imaginary·sin θ at θ = π m/(2·order), m = order−1, order−3, … ≥ 0.
    let mut sections: Vec<Section> = (0..order.div_ceil(2))
        .map(|pair| {
            let m = order - 1 - 2 * pair;
            let (sin, cos) = (0.5 * PI * m as f64 / order as f64).sin_cos();
            let (re, im) = (cutoff * ellipse.real * cos, cutoff * ellipse.imaginary * sin);
            if m == 0 {
                // re/(s + re)
                let lead = 1.0 + re;
                let b = re / lead;
                Section { b: [b, b, 0.0], a: [(re - 1.0) / lead, 0.0] }
            } else {
                // c/(s² + 2 re s + c) with c = re² + im²
                let c = re * re + im * im;
                let lead = 1.0 + 2.0 * re + c;
                let b = c / lead;
                Section {
                    b: [b, 2.0 * b, b],
                    a: [2.0 * (c - 1.0) / lead, (1.0 - 2.0 * re + c) / lead],
                }
            }
        })
        .collect();
    // The section with the least damping is last, so that no earlier section amplifies a signal
    // much more than the complete filter.
    sections.reverse();
    if let Some(first) = sections.first_mut() {
        first.b = first.b.map(|b| gain * b);
    }
    SecondOrderSections::new(sections, order)
}
