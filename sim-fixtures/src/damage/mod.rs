//! What hurts a recording between the arm and whoever listens, as data: in what the drives measure, and in
//! their frames. [`Fault`](crate::Fault) is what a device that plays does in one cycle; this is of a record as a whole.

mod action;
mod frames;
mod signals;

use std::borrow::Cow;

use didim_core::identification::Signals;
use didim_drivers::frame::{Frame, FrameError};
use serde::Deserialize;

pub use action::{Action, FrameOf, FrameRole, Of, SignalOf};

use crate::{CycleEncoder, CycleError};

/// Something that hurts some cycles of a record.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Damage {
    /// What.
    pub action: Action,
    /// The first cycle, from 0.
    #[serde(default)]
    pub from: usize,
    /// How many from there on; all that there are when absent.
    pub cycles: Option<usize>,
    /// Of these the first, and every so many after it.
    #[serde(default = "one")]
    pub every: usize,
}

fn one() -> usize {
    1
}

/// Why a record cannot be damaged so.
#[derive(Debug, thiserror::Error)]
pub enum DamageError {
    /// There is no such axis. Axes count from 1.
    #[error("there is no axis {axis}: the arm has axes 1 to {axes}")]
    Axis {
        /// The axis.
        axis: usize,
        /// Of the arm.
        axes: usize,
    },
    /// A value does not fit its signal: damage it less.
    #[error(transparent)]
    Encode(#[from] CycleError),
    /// A frame cannot be.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

impl Damage {
    /// Whether it hurts a cycle.
    pub fn hits(&self, cycle: usize) -> bool {
        let after = cycle.checked_sub(self.from);
        after.is_some_and(|after| {
            self.cycles.is_none_or(|cycles| after < cycles)
                && after.is_multiple_of(self.every.max(1))
        })
    }
}

/// The frames that the drives of a record send, cycle by cycle, hurt one damage after the other: first all that change
/// what is measured, then those of frames. The record is of motors, on the grid of the bus.
///
/// # Errors
/// [`DamageError`].
pub fn damaged_frames(
    record: &Signals,
    damages: &[Damage],
    encoder: &CycleEncoder,
    epoch_ns: u64,
) -> Result<Vec<Vec<Frame>>, DamageError> {
    let axes = encoder.layout().axes();
    let beyond = damages.iter().filter_map(|damage| damage.action.axis());
    if let Some(axis) = beyond.into_iter().find(|axis| !(1..=axes).contains(axis)) {
        return Err(DamageError::Axis { axis, axes });
    }
    let mut signals = Cow::Borrowed(record);
    for damage in damages {
        if let Action::Of(action) = &damage.action {
            damage.hurt_signals(action, signals.to_mut());
        }
    }
    let mut cycles = encoded(&signals, encoder, epoch_ns)?;
    for damage in damages {
        if let Action::Frames(action) = &damage.action {
            damage.hurt_frames(action, encoder.layout(), &mut cycles)?;
        }
    }
    Ok(cycles)
}

/// What the drives send of a record.
fn encoded(
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
    let cycle = |k: usize| {
        let mut frames = Vec::new();
        encoder.encode(
            &encoder.cycle_of(signals, k),
            epoch_ns + k as u64 * period_ns,
            &mut frames,
        )?;
        Ok(frames)
    };
    (0..samples).map(cycle).collect()
}
