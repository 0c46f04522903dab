//! Faults of an experiment's signals.

use core::ops::Range;

use thiserror::Error;

use didim_dynamics::SignalTiming;

/// Reason why signals do not form an experiment. Axes are counted from 1, samples from 0.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ExperimentError {
    /// The sample rate is not a positive number. Remedy: configure the rate of the record in Hz.
    #[error("sample rate of {sample_rate_hz} Hz is not a positive number")]
    SampleRate {
        /// The rate given \[Hz\].
        sample_rate_hz: f64,
    },
    /// The number of axes differs from the number of joints, or exceeds
    /// [`MAX_JOINTS`](didim_dynamics::MAX_JOINTS). Remedy: check the columns of the record against
    /// the robot file.
    #[error("the {signal} has {axes} axes where {expected} are expected")]
    Axes {
        /// Name of the signal.
        signal: &'static str,
        /// Number of axes of the signal.
        axes: usize,
        /// Expected number of axes.
        expected: usize,
    },
    /// Signals have different lengths. Remedy: cut them to the same window.
    #[error("the {signal} of axis {axis} has {samples} samples where {expected} are expected")]
    Samples {
        /// Name of the signal.
        signal: &'static str,
        /// Axis, from 1.
        axis: usize,
        /// Number of samples of the signal.
        samples: usize,
        /// Number of samples of the first position.
        expected: usize,
    },
    /// The record has no samples. Remedy: record a motion.
    #[error("the record is empty")]
    Empty,
    /// A value is NaN or infinite. Remedy: cut the record there, because a filter would spread the
    /// invalid value.
    #[error("the {signal} of axis {axis} is {value} at sample {sample}")]
    NotFinite {
        /// Name of the signal.
        signal: &'static str,
        /// Axis, from 1.
        axis: usize,
        /// Sample, from 0.
        sample: usize,
        /// Invalid value.
        value: f64,
    },
    /// A delay is not finite, a hold time is negative, or the shift exceeds the record. Remedy:
    /// enter both in seconds; a hold time is usually one sample period.
    #[error(
        "a {signal} held for {} s and delayed by {} s is impossible in this record; \
         both are seconds, a hold is usually one sample period", timing.hold_s, timing.delay_s
    )]
    Timing {
        /// Name of the signal.
        signal: &'static str,
        /// The timing given.
        timing: SignalTiming,
    },
    /// Recordings cannot be joined. Remedy: identify from each recording separately, or resample.
    #[error("the {what} of recording {recording} is not that of the first")]
    Different {
        /// Number of the recording, from 1.
        recording: usize,
        /// The quantity that differs.
        what: &'static str,
    },
    /// The range of counted samples is empty or not inside the record. Remedy: choose a non-empty
    /// part of `0..samples`.
    #[error(
        "samples {} to {} are not a part of the record's {samples} samples",
        counted.start, counted.end
    )]
    Counted {
        /// The range given.
        counted: Range<usize>,
        /// Number of samples of the record.
        samples: usize,
    },
}
