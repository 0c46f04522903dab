//! Signals that are valid at the arrival of their own frames, brought to the instant of the sample.
//!
//! On a bus without SYNC every axis has instants of its own. Between the last value before the instant t
//! of a cycle, which came at t₀, and the first from t on, which came at t₁, a signal is taken to be
//! linear: x(t) = x₁ + (x₀ − x₁) (t₁ − t) / (t₁ − t₀). A frame that comes at t is taken as it is. For a
//! motion of the acceleration a the position is off by a (t₁ − t₀)² / 8 at most.
//!
//! The memory is one value of each signal. Over more than [`REACH`] periods nothing is interpolated: the
//! frame between did not come.

use didim_core::MAX_JOINTS;

use super::losses::CycleCause;
use super::values::{References, Values, read_values};
use crate::frame::Frame;
use crate::layout::{MessagePlan, Quantity};

/// The longest time between two values that are interpolated, in nominal periods. A frame that did not
/// come costs its own cycle, and makes it two for the one after, whose instant is near the later value.
pub(super) const REACH: f64 = 2.5;

/// Values with the arrivals of their frames \[ns\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Arrived {
    pub(super) values: Values,
    pub(super) position_ns: [Option<u64>; MAX_JOINTS],
    pub(super) torque_ns: [Option<u64>; MAX_JOINTS],
    pub(super) references: References,
}

impl Arrived {
    /// Reads the signals of a frame, as [`read_values`].
    pub(super) fn read(
        &mut self,
        index: usize,
        message: &MessagePlan,
        frame: &Frame,
        enabled: u16,
    ) -> Option<CycleCause> {
        let fault = read_values(message, frame.data(), &mut self.values, enabled);
        for extraction in &message.extractions {
            let axis = extraction.axis.min(MAX_JOINTS - 1);
            match extraction.quantity {
                Quantity::Position => self.position_ns[axis] = Some(frame.stamp_ns),
                Quantity::Torque => self.torque_ns[axis] = Some(frame.stamp_ns),
                _ => {}
            }
        }
        self.references.read(index, message, frame.data(), frame.stamp_ns);
        fault
    }
}

/// Two values of a signal, one on each side of an instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) instant_ns: u64,
    pub(super) before_ns: Option<u64>,
    pub(super) after_ns: Option<u64>,
    /// The longest that is interpolated over \[ns\].
    pub(super) reach_ns: u64,
}

impl Span {
    /// How much of the value before is in that of the instant; nothing where there is none to take, or
    /// from too long ago.
    pub(super) fn share_before(self) -> Option<f64> {
        let later_ns = self.after_ns?.checked_sub(self.instant_ns)?;
        if later_ns == 0 {
            return Some(0.0);
        }
        let span_ns = later_ns + self.instant_ns.checked_sub(self.before_ns?)?;
        (span_ns <= self.reach_ns).then_some(later_ns as f64 / span_ns as f64)
    }
}
