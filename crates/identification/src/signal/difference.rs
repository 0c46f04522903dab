//! Differentiation of a sampled signal.

use super::error::SignalError;

/// Computes the derivative by central differences, `(x[k+1] − x[k−1]) f/2`, one-sided at both ends:
/// `numpy.gradient(x, 1/f)` with edge order 1.
///
/// `sample_rate_hz` is f; the result has the signal's unit per second. Central differences have no
/// phase. Their gain is `sin(ωT)/(ωT)`, which is 1 − 7e-4 at 50 Hz and 5 kHz.
///
/// # Errors
/// [`SignalError::SampleRate`], [`SignalError::TooShort`] below two samples,
/// [`SignalError::NotFinite`].
///
/// # Panics
/// If `derivative` is not as long as the signal.
pub fn central_difference(
    signal: &[f64],
    sample_rate_hz: f64,
    derivative: &mut [f64],
) -> Result<(), SignalError> {
    assert_eq!(derivative.len(), signal.len(), "one value per sample");
    if !(sample_rate_hz.is_finite() && sample_rate_hz > 0.0) {
        return Err(SignalError::SampleRate { sample_rate_hz });
    }
    let ([first, .., last], [from, inside @ .., to]) = (signal, derivative) else {
        return Err(SignalError::TooShort { samples: signal.len(), needed: 2 });
    };
    check_finite(signal)?;
    for (derivative, window) in inside.iter_mut().zip(signal.array_windows::<3>()) {
        *derivative = (window[2] - window[0]) * (0.5 * sample_rate_hz);
    }
    *from = (signal[1] - first) * sample_rate_hz;
    *to = (last - signal[signal.len() - 2]) * sample_rate_hz;
    Ok(())
}

/// Returns the samples whose difference, times the factor, is the [`central_difference`] at one
/// sample of a signal. It avoids the differences of the complete signal.
#[inline(always)]
pub(crate) fn difference_neighbours(
    sample: usize,
    samples: usize,
    rate_hz: f64,
) -> (usize, usize, f64) {
    let (before, after) = (sample.saturating_sub(1), (sample + 1).min(samples - 1));
    let inside = after - before == 2;
    (before, after, if inside { 0.5 * rate_hz } else { rate_hz })
}

/// Checks that every sample is finite.
fn check_finite(signal: &[f64]) -> Result<(), SignalError> {
    // Avoids a branch for each sample.
    if signal.iter().fold(true, |finite, x| finite & x.is_finite()) {
        return Ok(());
    }
    let index = signal.iter().position(|x| !x.is_finite()).unwrap_or_default();
    Err(SignalError::NotFinite { index })
}
