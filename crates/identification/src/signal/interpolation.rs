//! Shift of a signal in time by less than a sample.

use super::error::SignalError;

/// Returns the signal delayed by `samples` (may be fractional or negative):
/// `y[k] = x(k − samples)`, linear between samples, constant beyond the ends.
///
/// Half a sample gives exactly the mean of two neighbours. This is the effective value of a command
/// that is held over the period, at the instant where it changes.
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
    let (Some(&first), Some(&last)) = (signal.first(), signal.last()) else {
        return Ok(Vec::new());
    };
    let whole_samples = (-samples).floor();
    let fraction = -samples - whole_samples;
    // Sample k of the delayed signal lies between sample k + steps and the next one.
    #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
    let steps = whole_samples as isize;
    let missing = 0_usize.saturating_add_signed(steps.saturating_neg()).min(signal.len());
    let first_index = 0_usize.saturating_add_signed(steps).min(signal.len());
    let mut delayed = vec![first; missing];
    let between = |pair: &[f64; 2]| (1.0 - fraction) * pair[0] + fraction * pair[1];
    let pairs = signal[first_index..].array_windows().take(signal.len() - missing);
    delayed.extend(pairs.map(between));
    delayed.resize(signal.len(), last);
    Ok(delayed)
}
