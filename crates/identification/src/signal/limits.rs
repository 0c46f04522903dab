//! Limits of the filter design.

/// Highest supported filter order.
pub const MAX_ORDER: usize = 12;

/// Smallest distance of the ratio of cut-off to Nyquist frequency from 0 and from 1. At 1e-4,
/// rounding of the coefficients changes the gain by about 1e-8. This error grows with the inverse
/// square of the distance.
pub(super) const CUTOFF_MARGIN: f64 = 1e-4;

/// Range of accepted pass-band ripples \[dB\].
pub(super) const RIPPLE_RANGE_DB: (f64, f64) = (1e-6, 20.0);
