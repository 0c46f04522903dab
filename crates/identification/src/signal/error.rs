//! Faults of a filter or of its signal.

use thiserror::Error;

use super::limits::{CUTOFF_MARGIN, MAX_ORDER, RIPPLE_RANGE_DB};

/// Reason why a filter cannot be designed or a signal cannot be filtered. Nothing is changed on
/// error.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum SignalError {
    /// The order is 0 or above [`MAX_ORDER`]. Remedy: the usual orders are 4 (positions) and 8
    /// (decimation).
    #[error("filter order {order} is outside 1 to {MAX_ORDER}")]
    Order {
        /// Requested order.
        order: usize,
    },
    /// The cut-off is not strictly between 0 and the Nyquist frequency, or so close to either end
    /// that coefficients in double precision no longer describe the filter. Remedy: choose a
    /// cut-off below half the sample rate; for a very low one, decimate first.
    #[error(
        "cut-off at {ratio} of the Nyquist frequency is outside {CUTOFF_MARGIN} to {}; \
         the Nyquist frequency is half the sample rate", 1.0 - CUTOFF_MARGIN
    )]
    Cutoff {
        /// Cut-off frequency divided by the Nyquist frequency.
        ratio: f64,
    },
    /// The pass-band ripple is out of range. Remedy: 0.05 dB is usual for decimation.
    #[error(
        "pass-band ripple of {ripple_db} dB is outside {} to {} dB",
        RIPPLE_RANGE_DB.0, RIPPLE_RANGE_DB.1
    )]
    Ripple {
        /// Requested ripple \[dB\].
        ripple_db: f64,
    },
    /// The record has too few samples for the edge padding or the difference. Remedy: record
    /// longer, or shorten the padding.
    #[error("the signal has {samples} samples; at least {needed} are needed")]
    TooShort {
        /// Samples of the signal.
        samples: usize,
        /// Least sufficient number.
        needed: usize,
    },
    /// A value is NaN or infinite. Remedy: repair or cut out the sample; a zero-phase filter would
    /// spread it over the whole record.
    #[error("the value at sample {index} is not finite")]
    NotFinite {
        /// Index of the first such sample.
        index: usize,
    },
    /// A sample rate is zero, negative or not finite. Remedy: state the rate of the record in Hz.
    #[error("sample rate of {sample_rate_hz} Hz is not a positive number")]
    SampleRate {
        /// Given rate \[Hz\].
        sample_rate_hz: f64,
    },
    /// A delay is not finite. Remedy: state it in samples as a number.
    #[error("a delay of {samples} samples is not a number")]
    Delay {
        /// Given delay \[samples\].
        samples: f64,
    },
    /// The decimation factor is 0. Remedy: 1 keeps every sample.
    #[error("a decimation factor of 0 keeps no sample")]
    Factor,
}

impl SignalError {
    /// Returns the same error with its index counted in a longer signal, of which the filtered
    /// signal is the part from this sample on.
    #[must_use]
    pub(crate) fn later_by(self, samples: usize) -> Self {
        match self {
            Self::NotFinite { index } => Self::NotFinite { index: index + samples },
            other => other,
        }
    }
}
