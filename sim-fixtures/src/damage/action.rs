//! The kinds of damage.

use serde::Deserialize;

/// What hurts a record. Axes and motors count from 1; a signal is that of the motor.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Action {
    /// What is measured or sent as a value.
    Of(Of),
    /// Frames.
    Frames(FrameOf),
}

/// Which signals of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "named as the signals")]
pub enum SignalOf {
    Position,
    Torque,
    All,
}

/// Damage of what is measured. Without an axis it is of all.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is said with its kind")]
pub enum Of {
    /// The value of the cycle before comes again.
    Freeze { signal: SignalOf, axis: Option<usize> },
    /// A value is renewed every so many cycles.
    Hold { signal: SignalOf, axis: Option<usize>, length: usize },
    /// A value comes so many cycles late.
    Delay { signal: SignalOf, axis: Option<usize>, by: usize },
    /// Two axes are taken for each other.
    Swap { signal: SignalOf, axes: [usize; 2] },
    /// Something is added \[rad, N·m\].
    Add { signal: SignalOf, axis: Option<usize>, value: f64 },
    /// A wrong gain.
    Scale { signal: SignalOf, axis: Option<usize>, factor: f64 },
    /// A wrong gain of torques of one sign, 1 or −1.
    ScalePositive { axis: usize, factor: f64, sign: f64 },
    /// A torque reads no more than this, either way \[N·m\].
    Saturate { axis: usize, limit: f64 },
    /// A filter of first order.
    LowPass { signal: SignalOf, axis: Option<usize>, cutoff_hz: f64 },
    /// A torque with a sine of the motor's angle \[N·m\].
    Ripple { axis: usize, amplitude: f64 },
    /// White noise, equally distributed \[rad, N·m\].
    Noise { signal: SignalOf, axis: Option<usize>, rms: f64, seed: u64 },
    /// Coarse steps \[rad, N·m\].
    Quantise { signal: SignalOf, axis: Option<usize>, step: f64 },
    /// A position begins again after this range, about 0; `offset` is added before \[rad\].
    Wrap {
        axis: usize,
        range: f64,
        #[serde(default)]
        offset: f64,
    },
    /// So many samples are taken for each that there should be, between the old ones.
    Resample { ratio: f64 },
    /// The cycles come once more after themselves.
    Repeat,
    /// The cycles are left out.
    Cut,
}

/// Which frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "named as the roles of a layout")]
pub enum FrameRole {
    Sync,
    Sample,
    Target,
    All,
}

/// Damage of frames. Without an axis it is of all axes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[expect(missing_docs, reason = "each field is said with its kind")]
pub enum FrameOf {
    /// It is lost.
    Drop { frame: FrameRole, axis: Option<usize> },
    /// It comes twice.
    Double { frame: FrameRole, axis: Option<usize> },
    /// An axis' sample comes twice, the second time with another position.
    Contradict { axis: usize },
    /// A bit of the payload is the other one, counted from the first byte's lowest.
    Flip { frame: FrameRole, axis: Option<usize>, bit: usize },
    /// The last byte is missing.
    Truncate { frame: FrameRole, axis: Option<usize> },
    /// An axis' sample comes after the next SYNC.
    Late { axis: usize },
    /// All but the first come in reverse order.
    Reverse,
    /// Frames of this cycle and the next come in each other's place.
    Exchange,
    /// So many cycles are read at once, when the last of them is there.
    Burst { length: usize },
    /// The controller reports an error of this class (`linux/can/error.h`).
    Error { class: u32 },
    /// Somebody asks for a sample's frame.
    Remote,
    /// So many frames that are none of the layout's.
    Foreign { frames: u16 },
    /// All comes up to so much later \[µs\], equally distributed.
    Jitter { us: f64, seed: u64 },
    /// The period is this times what the layout says.
    Stretch { ratio: f64 },
    /// Stamps are so much later, or earlier \[ms\].
    ClockStep { ms: f64 },
    /// Samples of the same arm so many cycles later, with the same identifiers.
    SecondArm { offset: usize },
    /// Another SYNC, so much later \[µs\].
    SecondSync { after_us: f64 },
}

impl Action {
    /// The axis, from 1, where it is of one; the greater of two.
    pub(super) fn axis(&self) -> Option<usize> {
        match self {
            Self::Of(
                Of::Freeze { axis, .. }
                | Of::Hold { axis, .. }
                | Of::Delay { axis, .. }
                | Of::Add { axis, .. }
                | Of::Scale { axis, .. }
                | Of::LowPass { axis, .. }
                | Of::Noise { axis, .. }
                | Of::Quantise { axis, .. },
            )
            | Self::Frames(
                FrameOf::Drop { axis, .. }
                | FrameOf::Double { axis, .. }
                | FrameOf::Flip { axis, .. }
                | FrameOf::Truncate { axis, .. },
            ) => *axis,
            Self::Of(Of::Swap { axes: [one, other], .. }) => Some(*one.max(other)),
            Self::Of(
                Of::ScalePositive { axis, .. }
                | Of::Saturate { axis, .. }
                | Of::Ripple { axis, .. }
                | Of::Wrap { axis, .. },
            )
            | Self::Frames(FrameOf::Contradict { axis } | FrameOf::Late { axis }) => Some(*axis),
            _ => None,
        }
    }
}
