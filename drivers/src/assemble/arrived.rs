//! Interpolation of signals that are valid at the arrival of their own frames to the instant of the
//! sample.
//!
//! On a bus without SYNC every axis is measured at its own instants. A cycle has the instant t. The
//! last value before t arrives at t₀, and the first value at or after t arrives at t₁. Between the
//! two arrivals the signal is assumed to be linear: x(t) = x₁ + (x₀ − x₁) (t₁ − t) / (t₁ − t₀). The
//! value of a frame that arrives at t is used unchanged. For a motion with the acceleration a the
//! position error is at most a (t₁ − t₀)² / 8.
//!
//! The module stores one value of each signal. It does not interpolate over more than
//! [`AssemblyLimits::interpolation_periods`](super::AssemblyLimits), because a frame between the
//! two values is then missing.

use didim_dynamics::MAX_JOINTS;

use super::losses::CycleCause;
use super::values::{References, Values, read_values};
use crate::frame::Frame;
use crate::layout::{MessagePlan, Quantity};

/// Values and the arrival times of their frames \[ns\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ArrivedValues {
    pub(super) values: Values,
    pub(super) position_ns: [Option<u64>; MAX_JOINTS],
    pub(super) torque_ns: [Option<u64>; MAX_JOINTS],
    pub(super) references: References,
}

impl ArrivedValues {
    /// Reads the signals of a frame, like [`read_values`].
    pub(super) fn read_arrivals(
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
        self.references.read_references(index, message, frame.data(), frame.stamp_ns);
        fault
    }
}

/// Two values of a signal, one on each side of an instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct InterpolationSpan {
    pub(super) instant_ns: u64,
    pub(super) before_ns: Option<u64>,
    pub(super) after_ns: Option<u64>,
    /// Longest time between the two values \[ns\].
    pub(super) reach_ns: u64,
}

impl InterpolationSpan {
    /// Returns the weight of the earlier value in the interpolated value. Returns `None` if there
    /// is no earlier value or if the earlier value is too old.
    pub(super) fn weight_of_earlier(self) -> Option<f64> {
        let later_ns = self.after_ns?.checked_sub(self.instant_ns)?;
        if later_ns == 0 {
            return Some(0.0);
        }
        let span_ns = later_ns + self.instant_ns.checked_sub(self.before_ns?)?;
        (span_ns <= self.reach_ns).then_some(later_ns as f64 / span_ns as f64)
    }
}
