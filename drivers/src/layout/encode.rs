//! Encoding of numbers to the frames that a drive and its controller would send. The simulated
//! robot and tests use it; the service itself sends nothing.

use didim_dynamics::{MAX_JOINTS, Reading};

use super::field::DoesNotFit;
use super::plan::{CompiledLayout, MessagePlan, Quantity, Role};
use super::process_data::OPERATIONAL;
use crate::frame::{Direction, Frame, FrameKind, MAX_PAYLOAD};

/// Values that one axis sends in one cycle, in the units of the DBC file.
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
    /// Additional readings of the drive, in the units and the order of [`Reading`].
    pub readings: [f64; Reading::ALL.len()],
}

/// Values that all axes send in one cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CycleValues {
    /// Values of each axis. Entries beyond the axes of the arm are not read.
    pub axes: [AxisValues; MAX_JOINTS],
    /// Counter of the packed frame. It is taken modulo the range of its signal.
    pub counter: u64,
}

/// Error for a value that does not fit its signal. No value is saturated or wrapped silently.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("signal `{signal}`: {reason}")]
pub struct EncodeError {
    /// Name of the signal, as `Message.Signal`.
    pub signal: String,
    /// The value, and the limits of the signal.
    #[source]
    pub reason: DoesNotFit,
}

impl CompiledLayout {
    /// Appends one frame for every message with a role, ordered by identifier. All frames have the
    /// same stamp. Bits outside of the signals of the layout are zero.
    ///
    /// # Errors
    /// [`EncodeError`] if a value does not fit its signal; then no frame is appended.
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
    /// Encodes one frame of this message.
    ///
    /// # Errors
    /// [`EncodeError`] if a value does not fit its signal.
    pub fn encode(&self, values: &CycleValues, stamp_ns: u64) -> Result<Frame, EncodeError> {
        let mut payload = [0; MAX_PAYLOAD];
        if let Some(selector) = &self.selector {
            selector.field.write_bits(&mut payload, selector.value);
        }
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
                    // The field stores only its low bits, so a counter wraps at 2^width.
                    extraction.signal.field.write_bits(&mut payload, values.counter);
                    continue;
                }
            };
            let field = &extraction.signal.field;
            let bits = field
                .bits_for(value)
                .map_err(|reason| EncodeError { signal: extraction.signal.name.clone(), reason })?;
            field.write_bits(&mut payload, bits);
        }
        let kind = if self.format.is_fd {
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
