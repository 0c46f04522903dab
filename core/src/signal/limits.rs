//! Which filters are designed here.

/// The highest filter order that is designed here.
pub const MAX_ORDER: usize = 12;

/// How close to 0 and to 1 the ratio of cut-off and Nyquist frequency may come: at 1e-4 rounding of
/// the coefficients changes the gain by about 1e-8, and the loss grows with the square.
pub(super) const CUTOFF_MARGIN: f64 = 1e-4;

/// The pass-band ripples that are accepted \[dB\].
pub(super) const RIPPLE_RANGE_DB: (f64, f64) = (1e-6, 20.0);
