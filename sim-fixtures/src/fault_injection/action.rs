//! Kinds of fault injection.

use serde::Deserialize;

/// Fault of a record. Axes and motors count from 1; a signal is that of the motor.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum RecordFault {
    /// Fault of a measured or sent value.
    Of(SignalFault),
    /// Frames.
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
    /// A wrong gain.
    Scale { signal: AxisSignal, axis: Option<usize>, factor: f64 },
    /// A wrong gain for torques of one sign, 1 or −1.
    ScalePositive { axis: usize, factor: f64, sign: f64 },
    /// A torque is clipped at this magnitude \[N·m\].
    Saturate { axis: usize, limit: f64 },
    /// A first-order filter.
    LowPass { signal: AxisSignal, axis: Option<usize>, cutoff_hz: f64 },
    /// A torque ripple with the sine of the motor's angle \[N·m\].
    Ripple { axis: usize, amplitude: f64 },
    /// White noise with a uniform distribution \[rad, N·m\].
    Noise { signal: AxisSignal, axis: Option<usize>, rms: f64, seed: u64 },
    /// Coarse quantisation steps \[rad, N·m\].
    Quantise { signal: AxisSignal, axis: Option<usize>, step: f64 },
    /// A position wraps at this range, centred on 0; `offset` is added first \[rad\].
    Wrap {
        axis: usize,
        range: f64,
        #[serde(default)]
        offset: f64,
    },
    /// `ratio` samples replace each expected sample, interpolated between the old ones.
    Resample { ratio: f64 },
    /// The cycles are repeated once, directly after themselves.
    Repeat,
    /// The cycles are removed.
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

/// Fault of frames. Without an axis it affects all axes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is said with its kind")]
pub enum FrameFault {
    /// It is lost.
    Drop { frame: FrameRole, axis: Option<usize> },
    /// It comes twice.
    Double { frame: FrameRole, axis: Option<usize> },
    /// An axis's sample arrives twice, the second time with another position.
    Contradict { axis: usize },
    /// A bit of the payload is inverted, counted from the lowest bit of the first byte.
    Flip { frame: FrameRole, axis: Option<usize>, bit: usize },
    /// The last byte is missing.
    Truncate { frame: FrameRole, axis: Option<usize> },
    /// An axis's sample arrives after the next SYNC.
    Late { axis: usize },
    /// All frames but the first arrive in reverse order.
    Reverse,
    /// The frames of this cycle and of the next are swapped.
    Exchange,
    /// `length` cycles are read at once, when the last of them is present.
    Burst { length: usize },
    /// The controller reports an error of this class (`linux/can/error.h`).
    Error { class: u32 },
    /// Another node requests a sample's frame.
    Remote,
    /// N frames that do not belong to the layout.
    Foreign { frames: u16 },
    /// All frames arrive later by up to this time \[µs\], with a uniform distribution.
    Jitter { us: f64, seed: u64 },
    /// The period is multiplied by this ratio, relative to the layout.
    Stretch { ratio: f64 },
    /// Stamps are shifted by this time, later or earlier \[ms\].
    ClockStep { ms: f64 },
    /// Samples of the same arm from `offset` cycles later, with the same identifiers.
    SecondArm { offset: usize },
    /// Another SYNC, later by this time \[µs\].
    SecondSync { after_us: f64 },
}

impl RecordFault {
    /// Returns the axis, from 1, if one is given; the larger of two.
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
