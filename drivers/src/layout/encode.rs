//! Numbers to frames: what a drive and its controller would send. For the simulated robot and for
//! tests; the service itself sends nothing.

use didim_core::{MAX_JOINTS, Reading};

use super::field::DoesNotFit;
use super::plan::{CompiledLayout, MessagePlan, Quantity, Role};
use super::process_data::OPERATIONAL;
use crate::frame::{Direction, Frame, FrameKind, MAX_PAYLOAD};

/// What one axis puts on the bus in one cycle, in the units of the DBC file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisValues {
    /// Measured motor position.
    pub position: f64,
    /// Motor torque.
    pub torque: f64,
    /// Commanded motor position.
    pub reference: f64,
    /// CiA 402 status word, or the state of another kind of drive.
    pub status_word: u16,
    /// What the drive tells besides, in the units of [`Reading`] and their order.
    pub readings: [f64; Reading::ALL.len()],
}

/// What all axes put on the bus in one cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CycleValues {
    /// Per axis; entries beyond the arm's axes are not read.
    pub axes: [AxisValues; MAX_JOINTS],
    /// The counter of the packed frame; taken modulo its width.
    pub counter: u64,
}

/// A value that its signal cannot hold. Nothing is saturated or wrapped in silence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("signal `{signal}`: {reason}")]
pub struct EncodeError {
    /// `Message.Signal`.
    pub signal: String,
    /// What does not fit.
    #[source]
    pub reason: DoesNotFit,
}

impl CompiledLayout {
    /// Appends the frames of every message of a role, ordered by identifier, all with one stamp.
    /// Bits that are no signal of the layout are zero.
    ///
    /// # Errors
    /// [`EncodeError`] where a value does not fit its signal; then nothing is appended.
    pub fn encode(
        &self,
        role: Role,
        values: &CycleValues,
        stamp_ns: u64,
        frames: &mut Vec<Frame>,
    ) -> Result<(), EncodeError> {
        let before = frames.len();
        for message in self.messages().iter().filter(|message| message.role == role) {
            match message.encode(values, stamp_ns) {
                Ok(frame) => frames.push(frame),
                Err(error) => {
                    frames.truncate(before);
                    return Err(error);
                }
            }
        }
        Ok(())
    }
}

impl MessagePlan {
    /// One frame of this message.
    ///
    /// # Errors
    /// [`EncodeError`] where a value does not fit its signal.
    pub fn encode(&self, values: &CycleValues, stamp_ns: u64) -> Result<Frame, EncodeError> {
        let mut payload = [0; MAX_PAYLOAD];
        for extraction in &self.extractions {
            let axis = values.axes.get(extraction.axis).copied().unwrap_or_default();
            let value = match extraction.quantity {
                Quantity::Position => axis.position,
                Quantity::Torque => axis.torque,
                Quantity::Reference => axis.reference,
                Quantity::StatusWord | Quantity::Enabled => f64::from(axis.status_word),
                Quantity::NetworkState => f64::from(OPERATIONAL),
                Quantity::Reading(reading) => axis.readings[reading as usize],
                Quantity::Counter => {
                    // `insert` keeps the low bits: a counter starts again at 2^width.
                    extraction.signal.field.insert(&mut payload, values.counter);
                    continue;
                }
            };
            let field = &extraction.signal.field;
            let bits = field
                .bits_for(value)
                .map_err(|reason| EncodeError { signal: extraction.signal.name.clone(), reason })?;
            field.insert(&mut payload, bits);
        }
        let kind = if self.format.fd {
            FrameKind::Fd { bit_rate_switch: true, error_state_indicator: false }
        } else {
            FrameKind::Classic
        };
        Ok(Frame {
            stamp_ns,
            interface: 0,
            id: self.format.id,
            kind,
            direction: Direction::Received,
            length: self.format.wire_length(),
            payload,
        })
    }
}
