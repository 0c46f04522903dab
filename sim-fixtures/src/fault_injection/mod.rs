//! Fault injection between the arm and the receiver, in measured values and in frames. The faults
//! are data. A [`Fault`](crate::Fault) affects one cycle while a device plays; the faults of this
//! module affect a complete record.

mod action;
mod frames;
mod signals;

use std::borrow::Cow;

use didim_drivers::frame::{Frame, FrameError};
use didim_dynamics::Signals;
use serde::Deserialize;

pub use action::{AxisSignal, FrameFault, FrameRole, RecordFault, SignalFault};

use crate::{CycleEncoder, CycleError};

/// Fault that affects some of the cycles of a record.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InjectedFault {
    /// Kind of fault.
    pub action: RecordFault,
    /// First affected cycle, counted from 0.
    #[serde(default)]
    pub from: usize,
    /// Number of cycles from the first one on; all cycles of the record by default.
    pub cycles: Option<usize>,
    /// Distance between affected cycles: the fault affects the first cycle and every N-th cycle
    /// after it.
    #[serde(default = "single_step")]
    pub every: usize,
}

fn single_step() -> usize {
    1
}

/// Reason why a fault cannot be injected into a record.
#[derive(Debug, thiserror::Error)]
pub enum FaultInjectionError {
    /// The axis does not exist. Axes count from 1.
    #[error("there is no axis {axis}: the arm has axes 1 to {axes}")]
    Axis {
        /// Axis that the fault names.
        axis: usize,
        /// Number of axes of the arm.
        axes: usize,
    },
    /// A value does not fit its signal. Choose a smaller fault.
    #[error(transparent)]
    Encode(#[from] CycleError),
    /// A frame of a fault cannot exist.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

impl InjectedFault {
    /// Returns true if the fault affects a cycle.
    pub fn affects_cycle(&self, cycle: usize) -> bool {
        let after = cycle.checked_sub(self.from);
        after.is_some_and(|after| {
            self.cycles.is_none_or(|cycles| after < cycles)
                && after.is_multiple_of(self.every.max(1))
        })
    }
}

/// Returns the frames that the drives of a record send, cycle by cycle, with all faults injected.
/// Faults of measured values are injected first, then faults of frames. The record contains
/// motor-side signals, with one sample for each bus cycle.
///
/// # Errors
/// [`FaultInjectionError`].
pub fn damaged_frames(
    record: &Signals,
    faults: &[InjectedFault],
    encoder: &CycleEncoder,
    epoch_ns: u64,
) -> Result<Vec<Vec<Frame>>, FaultInjectionError> {
    let axes = encoder.layout().axes();
    let beyond = faults.iter().filter_map(|fault| fault.action.axis());
    if let Some(axis) = beyond.into_iter().find(|axis| !(1..=axes).contains(axis)) {
        return Err(FaultInjectionError::Axis { axis, axes });
    }
    let mut signals = Cow::Borrowed(record);
    for corrupt in faults {
        if let RecordFault::Of(action) = &corrupt.action {
            corrupt.corrupt_signals(action, signals.to_mut());
        }
    }
    let mut cycles = encode_record(&signals, encoder, epoch_ns)?;
    for corrupt_value in faults {
        if let RecordFault::Frames(action) = &corrupt_value.action {
            corrupt_value.corrupt_frames(action, encoder.layout(), &mut cycles)?;
        }
    }
    Ok(cycles)
}

/// Returns the frames that the drives send for a record.
fn encode_record(
    signals: &Signals,
    encoder: &CycleEncoder,
    epoch_ns: u64,
) -> Result<Vec<Vec<Frame>>, CycleError> {
    let samples = signals.position_rad.first().map_or(0, Vec::len);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a period: 1e4 to 1e9"
    )]
    let period_ns = encoder.layout().period_ns() as u64;
    (0..samples)
        .map(|k: usize| {
            let mut frames = Vec::new();
            encoder.encode(
                &encoder.cycle_of(signals, k),
                epoch_ns + k as u64 * period_ns,
                &mut frames,
            )?;
            Ok(frames)
        })
        .collect()
}
