//! What one bus cycle has brought so far.

use didim_core::{JointSample, MAX_JOINTS};

use super::losses::CycleCause;
use crate::layout::{
    AL_ERROR, BELOW_SAFE_OPERATIONAL, CompiledLayout, MessagePlan, Quantity, Role,
    SAFE_OPERATIONAL, WRONG_COUNTER,
};
use crate::units::Scales;

/// The bits of a CiA 402 status word (6041h) that tell the state, and "operation enabled".
const STATE_MASK: u16 = 0x6F;
const OPERATION_ENABLED: u16 = 0x27;

/// What the frames of one cycle said, in the units of the DBC file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Values {
    position: [f64; MAX_JOINTS],
    torque: [f64; MAX_JOINTS],
    status_word: [u16; MAX_JOINTS],
    pub(super) counter: u64,
}

/// References, per axis, and the frames that brought nothing else.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct References {
    value: [f64; MAX_JOINTS],
    stamp_ns: [u64; MAX_JOINTS],
    /// One bit per axis.
    axes: u64,
    /// Messages that came, one bit per index.
    messages: u64,
    pub(super) frames: u64,
}

/// One cycle, from its SYNC until it is decided.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cycle {
    pub(super) stamp_ns: u64,
    pub(super) sequence: u64,
    pub(super) values: Values,
    pub(super) references: References,
    /// Messages that came, one bit per index.
    pub(super) messages: u64,
    /// Frames, references aside.
    pub(super) frames: u64,
    /// Messages that the cycle before did not get.
    pub(super) missing_before: u64,
    /// A frame came so late in the cycle that it may be of the next.
    pub(super) doubtful: bool,
    /// The first cause, in the order of [`CycleCause`], that costs the sample.
    pub(super) fault: Option<CycleCause>,
}

/// Which bits make something whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Whole {
    /// Messages that a cycle needs.
    messages: u64,
    /// Axes that have a reference: all or none.
    axes: u64,
}

impl Whole {
    pub(super) fn of(layout: &CompiledLayout) -> Self {
        let messages = layout.messages().iter().enumerate();
        Self {
            messages: messages
                .filter(|(_, message)| message.role == Role::Sample)
                .fold(0, |bits, (index, _)| bits | bit(index)),
            axes: if layout.has_reference() { bit(layout.axes()) - 1 } else { 0 },
        }
    }

    pub(super) fn missing(&self, cycle: &Cycle) -> u64 {
        self.messages & !cycle.messages
    }
}

/// A layout has at most 33 messages, so an index is a bit of a `u64`.
pub(super) fn bit(index: usize) -> u64 {
    1 << (index & 63)
}

/// Reads the signals of a frame, references aside. What is out of range is a fault of the cycle.
pub(super) fn read_values(
    message: &MessagePlan,
    payload: &[u8],
    values: &mut Values,
) -> Option<CycleCause> {
    let mut fault = None;
    for extraction in &message.extractions {
        let axis = extraction.axis.min(MAX_JOINTS - 1);
        let place = match extraction.quantity {
            Quantity::Position => &mut values.position[axis],
            Quantity::Torque => &mut values.torque[axis],
            Quantity::Reference => continue,
            Quantity::Counter => {
                values.counter = extraction.signal.field.bits(payload);
                continue;
            }
            Quantity::NetworkState => {
                if let Some(cause) = network_fault(extraction.signal.field.bits(payload)) {
                    fault = first(fault, cause);
                }
                continue;
            }
            Quantity::StatusWord => {
                let word = extraction.signal.field.bits(payload);
                // The compiler has made sure that it is 16 bits wide.
                let word = u16::try_from(word).unwrap_or(0);
                values.status_word[axis] = word;
                if word & STATE_MASK != OPERATION_ENABLED {
                    fault = first(fault, CycleCause::NotEnabled);
                }
                continue;
            }
        };
        match extraction.value(payload) {
            Some(value) => *place = value,
            None => {
                *place = 0.0;
                fault = first(fault, CycleCause::OutOfRange);
            }
        }
    }
    fault
}

/// What the state of an EtherCAT network costs a cycle.
fn network_fault(state: u64) -> Option<CycleCause> {
    let state = u8::try_from(state).unwrap_or(0);
    // The states of all slaves in one byte, one over the other.
    if state & (BELOW_SAFE_OPERATIONAL | AL_ERROR) != 0 {
        Some(CycleCause::NotOperational)
    } else if state & SAFE_OPERATIONAL != 0 {
        Some(CycleCause::SafeOperational)
    } else {
        (state & WRONG_COUNTER != 0).then_some(CycleCause::WorkingCounter)
    }
}

/// The cause that is counted when two cost the same cycle.
pub(super) fn first(fault: Option<CycleCause>, other: CycleCause) -> Option<CycleCause> {
    Some(fault.map_or(other, |fault| fault.min(other)))
}

impl References {
    /// Reads the references of a frame; the latest of an axis counts, as in the drive. Returns
    /// whether this message had come before. A reference out of range is none.
    pub(super) fn read(
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
            self.axes &= !bit(axis);
            if let Some(value) = extraction.value(payload) {
                self.value[axis] = value;
                self.stamp_ns[axis] = stamp_ns;
                self.axes |= bit(axis);
            }
        }
        let again = self.messages & bit(index) != 0;
        self.messages |= bit(index);
        again
    }

    /// Forgets the references that are from before `oldest_ns`.
    pub(super) fn drop_older(&mut self, oldest_ns: u64) {
        for (axis, stamp_ns) in self.stamp_ns.iter().enumerate() {
            if *stamp_ns < oldest_ns {
                self.axes &= !bit(axis);
            }
        }
    }
}

impl Cycle {
    /// Whether no drive is in the state "operation enabled".
    pub(super) fn is_idle(&self, axes: usize) -> bool {
        let words = self.values.status_word.iter().take(axes);
        words.into_iter().all(|word| word & STATE_MASK != OPERATION_ENABLED)
    }

    /// The sample of this cycle in SI units, whatever came before it.
    ///
    /// # Errors
    /// The cause that costs it.
    pub(super) fn sample(
        &self,
        whole: Whole,
        axes: usize,
        scales: &Scales,
    ) -> Result<JointSample, CycleCause> {
        if whole.missing(self) != 0 {
            return Err(CycleCause::MissingAxis);
        }
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        let mut sample = JointSample::zero(self.sequence, self.stamp_ns);
        sample.has_reference = whole.axes != 0 && self.references.axes == whole.axes;
        for axis in 0..axes.min(MAX_JOINTS) {
            let position = scales.position_rad(axis, self.values.position[axis]);
            sample.motor_position_rad[axis] = position;
            sample.motor_torque_nm[axis] = scales.torque_nm(axis, self.values.torque[axis]);
            if sample.has_reference {
                let reference = scales.reference_rad(axis, self.references.value[axis]);
                sample.motor_reference_rad[axis] = reference;
                sample.has_reference = scales.is_continuous(axis, position, reference);
            }
        }
        if !sample.has_reference {
            sample.motor_reference_rad = [0.0; MAX_JOINTS];
        }
        Ok(sample)
    }
}
