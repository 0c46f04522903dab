//! Cycles whose signals are valid at the arrival of their own frames.

use super::State;
use super::losses::FrameCause;
use super::values::{index_bit, prior_cause};
use crate::frame::Frame;
use crate::layout::{MessagePlan, Role};

impl State {
    /// Takes a frame whose signals are valid at its arrival. A SYNC frame first begins its cycle
    /// and is then passed to this function. Only the first frame of a message in a cycle counts. A
    /// second frame of the message describes another instant and is no contradiction.
    pub(super) fn arrival_frame(&mut self, index: usize, message: &MessagePlan, frame: &Frame) {
        let is_sync = message.role == Role::Sync;
        let refusal = if is_sync { None } else { self.refusal_at(frame.stamp_ns) };
        let (None, Some(cycle)) = (refusal, &mut self.open_cycle) else {
            return self.losses.frames.count(refusal.unwrap_or(FrameCause::Late), 1);
        };
        if is_sync && (cycle.stamp_ns != frame.stamp_ns || cycle.messages & index_bit(index) != 0) {
            return; // The same SYNC twice, and counted.
        }
        let mut latest = self.latest_arrivals;
        let fault = latest.read_arrivals(index, message, frame, self.enabled_value);
        if fault.is_none() {
            self.latest_arrivals = latest;
        }
        if cycle.messages & index_bit(index) != 0 {
            return self.losses.frames.count(FrameCause::Duplicate, 1);
        }
        cycle.messages |= index_bit(index);
        message.read_readings(frame, &mut self.readings);
        match message.role {
            Role::Sync | Role::Reading => {}
            Role::Sample => cycle.frames += 1,
            Role::Target => cycle.references.frames += 1,
        }
        cycle.first_arrivals.read_arrivals(index, message, frame, self.enabled_value);
        cycle.values = cycle.first_arrivals.values;
        if let Some(fault) = fault {
            cycle.fault = prior_cause(cycle.fault, fault);
        }
    }
}
