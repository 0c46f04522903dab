//! Faults of an experiment's signals.

use core::ops::Range;

use thiserror::Error;

use didim_dynamics::SignalTiming;

/// Why signals are no experiment. Axes are named from 1, samples from 0.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ExperimentError {
    /// The sample rate is not a positive number. Remedy: state the rate of the record in Hz.
    #[error("sample rate of {sample_rate_hz} Hz is not a positive number")]
    SampleRate {
        /// The rate given \[Hz\].
        sample_rate_hz: f64,
    },
    /// Not as many axes as the arm has joints, or beyond
    /// [`MAX_JOINTS`](didim_dynamics::MAX_JOINTS). Remedy: check the columns of the record against
    /// the robot file.
    #[error("the {signal} has {axes} axes where {expected} are expected")]
    Axes {
        /// Name of the signal.
        signal: &'static str,
        /// Axes it has.
        axes: usize,
        /// Axes it should have.
        expected: usize,
    },
    /// Signals of different length. Remedy: cut them to the same window.
    #[error("the {signal} of axis {axis} has {samples} samples where {expected} are expected")]
    Samples {
        /// Name of the signal.
        signal: &'static str,
        /// Axis, from 1.
        axis: usize,
        /// Samples it has.
        samples: usize,
        /// Samples of the first position.
        expected: usize,
    },
    /// There is no sample at all. Remedy: record something.
    #[error("the record is empty")]
    Empty,
    /// A value is NaN or infinite. Remedy: cut the record there; a filter would spread the hole.
    #[error("the {signal} of axis {axis} is {value} at sample {sample}")]
    NotFinite {
        /// Name of the signal.
        signal: &'static str,
        /// Axis, from 1.
        axis: usize,
        /// Sample, from 0.
        sample: usize,
        /// The value found.
        value: f64,
    },
    /// A time of validity is not finite, a hold is negative, or the shift exceeds the record.
    /// Remedy: state both in seconds; a hold is usually one sample period.
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
    /// Recordings do not go together. Remedy: identify from each by itself, or resample.
    #[error("the {what} of recording {recording} is not that of the first")]
    Different {
        /// Number of the recording, from 1.
        recording: usize,
        /// The quantity that differs.
        what: &'static str,
    },
    /// The counted samples are none, or not all in the record. Remedy: a non-empty part of
    /// `0..samples`.
    #[error(
        "samples {} to {} are not a part of the record's {samples} samples",
        counted.start, counted.end
    )]
    Counted {
        /// The range given.
        counted: Range<usize>,
        /// Samples of the record.
        samples: usize,
    },
}
