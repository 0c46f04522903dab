//! Kinds of fault injection.

use serde::Deserialize;

/// Fault of a record. Axes and motors count from 1, and signals are those of the motors.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum RecordFault {
    /// Fault of a measured or a sent value.
    Of(SignalFault),
    /// Fault of frames.
    Frames(FrameFault),
}

/// Selection of an axis's signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "named as the signals")]
pub enum AxisSignal {
    Position,
    Torque,
    All,
}

/// Fault of measured values. Without an axis it affects all axes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is said with its kind")]
pub enum SignalFault {
    /// The value of the previous cycle is repeated.
    Freeze { signal: AxisSignal, axis: Option<usize> },
    /// A value is updated only every `length` cycles.
    Hold { signal: AxisSignal, axis: Option<usize>, length: usize },
    /// A value arrives `by` cycles late.
    Delay { signal: AxisSignal, axis: Option<usize>, by: usize },
    /// Two axes are swapped.
    Swap { signal: AxisSignal, axes: [usize; 2] },
    /// A constant is added \[rad, N·m\].
    Add { signal: AxisSignal, axis: Option<usize>, value: f64 },
    /// A gain is wrong by a factor.
    Scale { signal: AxisSignal, axis: Option<usize>, factor: f64 },
    /// The gain of torques of one sign, 1 or −1, is wrong by a factor.
    ScalePositive { axis: usize, factor: f64, sign: f64 },
    /// A torque is clipped at this magnitude \[N·m\].
    Saturate { axis: usize, limit: f64 },
    /// A signal passes a first-order low-pass filter.
    LowPass { signal: AxisSignal, axis: Option<usize>, cutoff_hz: f64 },
    /// A torque ripple is added, proportional to the sine of the motor angle \[N·m\].
    Ripple { axis: usize, amplitude: f64 },
    /// White noise with a uniform distribution is added \[rad, N·m\].
    Noise { signal: AxisSignal, axis: Option<usize>, rms: f64, seed: u64 },
    /// A value is rounded to coarse steps \[rad, N·m\].
    Quantise { signal: AxisSignal, axis: Option<usize>, step: f64 },
    /// A position wraps at the ends of this range, which is centred on 0. `offset` is added first
    /// \[rad\].
    Wrap {
        axis: usize,
        range: f64,
        #[serde(default)]
        offset: f64,
    },
    /// The record is resampled to `ratio` times its number of samples, by interpolation.
    Resample { ratio: f64 },
    /// The affected cycles are repeated once, directly after themselves.
    Repeat,
    /// The affected cycles are removed.
    Cut,
}

/// Role of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "named as the roles of a layout")]
pub enum FrameRole {
    Sync,
    Sample,
    Target,
    All,
}

/// Fault of frames. Without an axis it affects the frames of all axes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is said with its kind")]
pub enum FrameFault {
    /// The frame is lost.
    Drop { frame: FrameRole, axis: Option<usize> },
    /// The frame arrives twice.
    Double { frame: FrameRole, axis: Option<usize> },
    /// The sample of an axis arrives twice, the second time with another position.
    Contradict { axis: usize },
    /// A bit of the payload is inverted. Bits count from the lowest bit of the first byte.
    Flip { frame: FrameRole, axis: Option<usize>, bit: usize },
    /// The last byte of the frame is missing.
    Truncate { frame: FrameRole, axis: Option<usize> },
    /// The sample of an axis arrives after the next SYNC.
    Late { axis: usize },
    /// All frames of a cycle but the first arrive in reverse order.
    Reverse,
    /// The frames of the affected cycle and of the next cycle are swapped.
    Exchange,
    /// The frames of `length` cycles are received together, when the last cycle has arrived.
    Burst { length: usize },
    /// The controller reports an error of this class (`linux/can/error.h`).
    Error { class: u32 },
    /// Another node sends a remote request for the frame of a sample.
    Remote,
    /// `frames` frames arrive that do not belong to the layout.
    Foreign { frames: u16 },
    /// All frames of a cycle arrive later by a random time of at most this value \[µs\], with a
    /// uniform distribution.
    Jitter { us: f64, seed: u64 },
    /// The period of the bus is multiplied by this ratio, compared with the layout.
    Stretch { ratio: f64 },
    /// The stamps are shifted by this time \[ms\], later if positive, earlier if negative.
    ClockStep { ms: f64 },
    /// Samples of the same arm from `offset` cycles later arrive with the same identifiers.
    SecondArm { offset: usize },
    /// A second SYNC arrives after the first one, later by this time \[µs\].
    SecondSync { after_us: f64 },
}

impl RecordFault {
    /// Returns the axis of the fault, counted from 1, or the larger of two axes. Returns `None` if
    /// the fault names no axis.
    pub(super) fn axis(&self) -> Option<usize> {
        match self {
            Self::Of(
                SignalFault::Freeze { axis, .. }
                | SignalFault::Hold { axis, .. }
                | SignalFault::Delay { axis, .. }
                | SignalFault::Add { axis, .. }
                | SignalFault::Scale { axis, .. }
                | SignalFault::LowPass { axis, .. }
                | SignalFault::Noise { axis, .. }
                | SignalFault::Quantise { axis, .. },
            )
            | Self::Frames(
                FrameFault::Drop { axis, .. }
                | FrameFault::Double { axis, .. }
                | FrameFault::Flip { axis, .. }
                | FrameFault::Truncate { axis, .. },
            ) => *axis,
            Self::Of(SignalFault::Swap { axes: [one, other], .. }) => Some(*one.max(other)),
            Self::Of(
                SignalFault::ScalePositive { axis, .. }
                | SignalFault::Saturate { axis, .. }
                | SignalFault::Ripple { axis, .. }
                | SignalFault::Wrap { axis, .. },
            )
            | Self::Frames(FrameFault::Contradict { axis } | FrameFault::Late { axis }) => {
                Some(*axis)
            }
            _ => None,
        }
    }
}
