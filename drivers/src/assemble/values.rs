//! Values of frames, in the units of the DBC file.

use didim_dynamics::MAX_JOINTS;

use super::losses::CycleCause;
use crate::layout::{
    AL_ERROR, BELOW_SAFE_OPERATIONAL, MessagePlan, Quantity, SAFE_OPERATIONAL, WRONG_COUNTER,
};

/// Bits of a CiA 402 status word (6041h) that encode the state, and their value for "operation
/// enabled".
const STATE_MASK: u16 = 0x6F;
const OPERATION_ENABLED: u16 = 0x27;

/// Values of the frames of one cycle, in the units of the DBC file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Values {
    pub(super) position: [f64; MAX_JOINTS],
    pub(super) torque: [f64; MAX_JOINTS],
    pub(super) status_word: [u16; MAX_JOINTS],
    pub(super) counter: u64,
}

/// References for each axis, and the number of frames that carried only references.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct References {
    pub(super) value: [f64; MAX_JOINTS],
    pub(super) stamp_ns: [u64; MAX_JOINTS],
    /// Axes with a reference, one bit for each axis.
    pub(super) axes: u64,
    /// Received messages, one bit for each index of a message.
    messages: u64,
    pub(super) frames: u64,
}

/// Returns the bit of the index of a message or an axis. A layout has at most 57 messages, so an
/// index fits a `u64`.
pub(super) fn index_bit(index: usize) -> u64 {
    1 << (index & 63)
}

/// Reads all signals of a frame except references. Returns the cause that costs the cycle its
/// sample, if there is one, such as a value out of range. `enabled` is the value that means an
/// enabled drive, if the layout uses no status word.
pub(super) fn read_values(
    message: &MessagePlan,
    payload: &[u8],
    values: &mut Values,
    enabled: u16,
) -> Option<CycleCause> {
    let mut fault = None;
    for extraction in &message.extractions {
        let axis = extraction.axis.min(MAX_JOINTS - 1);
        let place = match extraction.quantity {
            Quantity::Position => &mut values.position[axis],
            Quantity::Torque => &mut values.torque[axis],
            Quantity::Reference | Quantity::Reading(_) => continue,
            Quantity::Counter => {
                values.counter = extraction.signal.field.bits(payload);
                continue;
            }
            Quantity::NetworkState => {
                if let Some(cause) = network_fault(extraction.signal.field.bits(payload)) {
                    fault = prior_cause(fault, cause);
                }
                continue;
            }
            Quantity::Enabled => {
                // Store the state as a status word with the same meaning.
                let is = extraction.signal.field.bits(payload) == u64::from(enabled);
                values.status_word[axis] = if is { OPERATION_ENABLED } else { 0 };
                if !is {
                    fault = prior_cause(fault, CycleCause::NotEnabled);
                }
                continue;
            }
            Quantity::StatusWord => {
                let word = extraction.signal.field.bits(payload);
                // The compiler ensures that it is 16 bits wide.
                let word = u16::try_from(word).unwrap_or(0);
                values.status_word[axis] = word;
                if !is_enabled(word) {
                    fault = prior_cause(fault, CycleCause::NotEnabled);
                }
                continue;
            }
        };
        match extraction.value(payload) {
            Some(value) => *place = value,
            None => {
                *place = 0.0;
                fault = prior_cause(fault, CycleCause::OutOfRange);
            }
        }
    }
    fault
}

/// Returns the cause by which the state of an EtherCAT network costs a cycle, if there is one.
fn network_fault(state: u64) -> Option<CycleCause> {
    let state = u8::try_from(state).unwrap_or(0);
    // One byte holds the states of all slaves, combined by OR.
    if state & (BELOW_SAFE_OPERATIONAL | AL_ERROR) != 0 {
        Some(CycleCause::NotOperational)
    } else if state & SAFE_OPERATIONAL != 0 {
        Some(CycleCause::SafeOperational)
    } else {
        (state & WRONG_COUNTER != 0).then_some(CycleCause::WorkingCounter)
    }
}

/// Returns the cause that is counted if two causes apply to the same cycle.
pub(super) fn prior_cause(fault: Option<CycleCause>, other: CycleCause) -> Option<CycleCause> {
    Some(fault.map_or(other, |fault| fault.min(other)))
}

impl References {
    /// Reads the references of a frame. If an axis has several, the latest one counts, as in the
    /// drive. Returns true if this message had arrived before. A reference out of range is dropped.
    pub(super) fn read_references(
        &mut self,
        index: usize,
        message: &MessagePlan,
        payload: &[u8],
        stamp_ns: u64,
    ) -> bool {
        for extraction in &message.extractions {
            if extraction.quantity != Quantity::Reference {
                continue;
            }
            let axis = extraction.axis.min(MAX_JOINTS - 1);
            self.axes &= !index_bit(axis);
            if let Some(value) = extraction.value(payload) {
                self.value[axis] = value;
                self.stamp_ns[axis] = stamp_ns;
                self.axes |= index_bit(axis);
            }
        }
        let again = self.messages & index_bit(index) != 0;
        self.messages |= index_bit(index);
        again
    }

    /// Drops the references that arrived before `oldest_ns`.
    pub(super) fn drop_older(&mut self, oldest_ns: u64) {
        for (axis, stamp_ns) in self.stamp_ns.iter().enumerate() {
            if *stamp_ns < oldest_ns {
                self.axes &= !index_bit(axis);
            }
        }
    }
}

/// Returns true if a status word means "operation enabled".
pub(super) fn is_enabled(word: u16) -> bool {
    word & STATE_MASK == OPERATION_ENABLED
}
