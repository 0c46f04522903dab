//! Moving a signal in time by less than a sample.

use super::error::SignalError;

/// The signal delayed by `samples` (may be fractional or negative): `y[k] = x(k − samples)`, linear
/// between samples, constant beyond the ends.
///
/// Half a sample gives exactly the mean of two neighbours: what a command held over the period is
/// worth at the instant where it changes.
///
/// # Errors
/// [`SignalError::Delay`] and [`SignalError::NotFinite`].
pub fn delay_linear(signal: &[f64], samples: f64) -> Result<Vec<f64>, SignalError> {
    if !samples.is_finite() {
        return Err(SignalError::Delay { samples });
    }
    if let Some(index) = signal.iter().position(|x| !x.is_finite()) {
        return Err(SignalError::NotFinite { index });
    }
    let Some(last) = signal.len().checked_sub(1) else {
        return Ok(Vec::new());
    };
    let delayed = (0..=last).map(|k| {
        let position = (k as f64 - samples).clamp(0.0, last as f64);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let before = position as usize;
        let fraction = position - before as f64;
        let after = (before + 1).min(last);
        (1.0 - fraction) * signal[before] + fraction * signal[after]
    });
    Ok(delayed.collect())
}
