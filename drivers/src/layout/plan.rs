//! Compiled plan, which reads numbers from a frame without names and without allocations.

use std::fmt;

use didim_dynamics::Reading;
use didim_dynamics::SignalTiming;

use super::dbc::{MessageFormat, SignalFormat};
use super::field::Field;
use super::process_data::ProcessData;
use super::selector::Selector;
use super::spec::{CyclesBy, FollowingErrorSign};
use crate::frame::{Frame, FrameId, FrameKind};

/// Number of 11-bit identifiers, each of which has an entry in the plan.
const STANDARD_IDS: usize = 1 << 11;

/// Entry of an identifier that is not in the plan.
const NO_MESSAGE: u8 = u8::MAX;

/// Quantity of a layout signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Measured motor position.
    Position,
    /// Motor torque.
    Torque,
    /// Commanded motor position.
    Reference,
    /// CiA 402 status word.
    StatusWord,
    /// State of a drive without a CiA 402 status word; one of its values means enabled.
    Enabled,
    /// Counter of the packed frame. It belongs to no axis, and its [`Extraction::axis`] is 0.
    Counter,
    /// State of the EtherCAT network in the cycle: AL status, and whether the working counters
    /// match the expected ones.
    NetworkState,
    /// Additional reading of a drive.
    Reading(Reading),
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Position => "position",
            Self::Torque => "torque",
            Self::Reference => "reference",
            Self::StatusWord => "status word",
            Self::Enabled => "state",
            Self::Counter => "counter",
            Self::NetworkState => "network state",
            Self::Reading(Reading::Temperature) => "temperature",
            Self::Reading(Reading::SupplyVoltage) => "supply voltage",
            Self::Reading(Reading::Mode) => "mode",
            Self::Reading(Reading::Stiffness) => "stiffness",
            Self::Reading(Reading::Damping) => "damping",
            Self::Reading(Reading::SpeedTarget) => "speed target",
            Self::Reading(Reading::TorqueTarget) => "torque target",
        })
    }
}

/// Role of a message for a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// The arrival of the message is the instant of a sample. The message carries no signal, unless
    /// signals are valid at the arrival of their frames.
    Sync,
    /// The message carries signals that a sample requires.
    Sample,
    /// The message carries only references.
    Target,
    /// The message carries only readings, and may arrive rarely.
    Reading,
}

/// Kind of message whose arrival is the instant of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SampledBy {
    /// The SYNC message.
    Sync,
    /// The packed message itself.
    Packed,
}

/// Reason why the plan cannot read a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unreadable {
    /// An error report of the controller.
    Error,
    /// A remote request: it carries no data.
    Remote,
    /// No message of the layout has this identifier.
    UnknownId,
    /// The frame is classic and the message is CAN FD, or the reverse.
    WrongFormat,
    /// The length of the frame differs from that of the message.
    WrongLength,
    /// The content shows that the frame is something else than the message.
    Excepted,
}

/// One signal of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Extraction {
    /// Quantity of the signal.
    pub quantity: Quantity,
    /// Axis of the signal, from 0.
    pub axis: usize,
    /// Bits, unit and range of the signal.
    pub signal: SignalFormat,
}

impl Extraction {
    /// Returns the value in the unit of the DBC file, or `None` if it is not finite or outside of
    /// the declared range. The range of an integer signal is widened by half a count on either
    /// side, because 32767 × 0.1 and 3276.7 differ as floating-point numbers.
    pub fn value(&self, payload: &[u8]) -> Option<f64> {
        let field = &self.signal.field;
        let value = field.value(payload);
        let (minimum, maximum) = self.signal.range.unwrap_or((f64::MIN, f64::MAX));
        let spare = 0.5 * field.step();
        (minimum - spare..=maximum + spare).contains(&value).then_some(value)
    }
}

/// One message of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct MessagePlan {
    /// Format of the message's frames.
    pub format: MessageFormat,
    /// Role of the message for a sample.
    pub role: Role,
    /// Signals of the message, in the order position, torque, reference, status word, state,
    /// readings, counter.
    pub extractions: Vec<Extraction>,
    /// Integer fields, each with the values that mark a frame with other content than the message.
    pub excluded_values: Vec<(Field, Vec<u16>)>,
    /// Value of the multiplexer in the frames of this message, if it is multiplexed. Messages with
    /// the same identifier differ in it.
    pub selector: Option<Selector>,
}

/// Validity times of the signals of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Validity {
    pub(super) at_arrival: bool,
    pub(super) torque: SignalTiming,
    pub(super) reference_at_next_sync: bool,
    /// Sign convention of the following errors; `None` if the references are positions.
    pub(super) following_error: Option<FollowingErrorSign>,
    /// Value of the state signal of an enabled drive.
    pub(super) enabled_value: u16,
}

/// A layout that is ready to read frames. It does not change after its creation.
#[derive(Clone, Debug, PartialEq)]
pub struct CompiledLayout {
    messages: Vec<MessagePlan>,
    standard_ids: Box<[u8]>,
    extended_ids: Vec<(u32, u8)>,
    sampled_by: SampledBy,
    axes: usize,
    period_ns: f64,
    validity: Validity,
    cycles_by: CyclesBy,
    process_data: Option<ProcessData>,
}

impl CompiledLayout {
    pub(super) fn new(
        mut messages: Vec<MessagePlan>,
        sampled_by: SampledBy,
        axes: usize,
        period_ns: f64,
        validity: Validity,
        cycles_by: CyclesBy,
    ) -> Self {
        messages.sort_by_key(|message| sort_key(message.format.id));
        let mut standard = vec![NO_MESSAGE; STANDARD_IDS].into_boxed_slice();
        let mut extended = Vec::new();
        for (k, message) in (0u8..).zip(&messages) {
            match message.format.id {
                FrameId::Standard(id) => {
                    // Multiplexed messages follow the first one of their identifier.
                    let entry = standard.get_mut(usize::from(id));
                    if let Some(entry) = entry.filter(|entry| **entry == NO_MESSAGE) {
                        *entry = k;
                    }
                }
                FrameId::Extended(id) if extended.last().is_some_and(|(last, _)| *last == id) => {}
                FrameId::Extended(id) => extended.push((id, k)),
            }
        }
        Self {
            messages,
            standard_ids: standard,
            extended_ids: extended,
            sampled_by,
            axes,
            period_ns,
            validity,
            cycles_by,
            process_data: None,
        }
    }

    pub(super) fn with_process_data(self, process_data: ProcessData) -> Self {
        Self { process_data: Some(process_data), ..self }
    }

    /// Returns the conversion of EtherCAT datagrams to the frames of the plan, or `None` for a CAN
    /// bus.
    pub fn process_data(&self) -> Option<&ProcessData> {
        self.process_data.as_ref()
    }

    /// Returns a text description of the layout: a line for each message and each datagram.
    pub fn description(&self) -> String {
        let datagrams = self.process_data.iter().flat_map(|data| &data.datagrams);
        let datagrams = datagrams.map(|datagram| format!("{datagram:?}\n"));
        self.messages
            .iter()
            .map(|message: &MessagePlan| {
                let signals = message.extractions.iter().map(|e| e.signal.name.as_str());
                let signals: Vec<&str> = signals.collect();
                format!("{} {}: {}\n", message.format.id, message.format.name, signals.join(" "))
            })
            .chain(datagrams)
            .collect()
    }

    /// Returns how bus cycles are counted.
    pub fn cycles_by(&self) -> CyclesBy {
        self.cycles_by
    }

    /// Returns the messages, ordered by identifier.
    pub fn messages(&self) -> &[MessagePlan] {
        &self.messages
    }

    /// Returns the message of a frame and its index in [`Self::messages`].
    ///
    /// # Errors
    /// [`Unreadable`] gives the reason why the frame does not belong to the layout.
    pub fn read(&self, frame: &Frame) -> Result<(usize, &MessagePlan), Unreadable> {
        let fd = match frame.kind {
            FrameKind::Error => return Err(Unreadable::Error),
            FrameKind::Remote => return Err(Unreadable::Remote),
            FrameKind::Classic => false,
            FrameKind::Fd { .. } => true,
        };
        let index = self.find(frame.id).ok_or(Unreadable::UnknownId)?;
        let message = self.messages.get(index).ok_or(Unreadable::UnknownId)?;
        if message.format.is_fd != fd {
            return Err(Unreadable::WrongFormat);
        }
        if frame.length != message.format.length && frame.length != message.format.wire_length() {
            return Err(Unreadable::WrongLength);
        }
        let same_id = self.messages.iter().enumerate().skip(index);
        let mut same_id = same_id.take_while(|(_, other)| other.format.id == frame.id);
        let selected = same_id.find(|(_, message)| {
            message.selector.as_ref().is_none_or(|selector| selector.is_in(frame.data()))
        });
        let (index, message) = selected.ok_or(Unreadable::Excepted)?;
        let says = |field: &Field, value: &u16| field.bits(frame.data()) == u64::from(*value);
        let mut except = message.excluded_values.iter();
        if except.any(|(field, values)| values.iter().any(|value| says(field, value))) {
            return Err(Unreadable::Excepted);
        }
        Ok((index, message))
    }

    fn find(&self, id: FrameId) -> Option<usize> {
        let index = match id {
            FrameId::Standard(id) => *self.standard_ids.get(usize::from(id))?,
            FrameId::Extended(id) => {
                let place = self.extended_ids.binary_search_by_key(&id, |(id, _)| *id).ok()?;
                self.extended_ids.get(place)?.1
            }
        };
        (index != NO_MESSAGE).then_some(usize::from(index))
    }

    /// Returns the kind of message whose arrival is the instant of a sample.
    pub fn sampled_by(&self) -> SampledBy {
        self.sampled_by
    }

    /// Returns the number of axes.
    pub fn axes(&self) -> usize {
        self.axes
    }

    /// Returns the nominal period of the bus cycle \[ns\].
    pub fn period_ns(&self) -> f64 {
        self.period_ns
    }

    /// Returns the time at which the torque acts, relative to the instant of its sample.
    pub fn torque_timing(&self) -> SignalTiming {
        self.validity.torque
    }

    /// Returns true if every signal is valid at the arrival of its own frame. Otherwise all are
    /// valid at the instant of the sample, or as given by [`Self::torque_timing`] and
    /// [`Self::reference_at_next_sync`].
    pub fn at_arrival(&self) -> bool {
        self.validity.at_arrival
    }

    /// Returns the value of [`Quantity::Enabled`] that means an enabled drive.
    pub fn enabled_value(&self) -> u16 {
        self.validity.enabled_value
    }

    /// Returns true if a reference takes effect in the sample after the one whose cycle carries it.
    pub fn reference_at_next_sync(&self) -> bool {
        self.validity.reference_at_next_sync
    }

    /// Returns the sign convention of the following errors, or `None` if the references are
    /// positions.
    pub fn following_error(&self) -> Option<FollowingErrorSign> {
        self.validity.following_error
    }

    /// Returns the signal that carries a quantity of an axis (from 0), or `None` if the layout has
    /// none.
    pub fn signal(&self, quantity: Quantity, axis: usize) -> Option<&SignalFormat> {
        let mut extractions = self.messages.iter().flat_map(|message| &message.extractions);
        extractions.find(|e| e.quantity == quantity && e.axis == axis).map(|e| &e.signal)
    }

    /// Returns true if the layout has a reference.
    pub fn has_reference(&self) -> bool {
        self.signal(Quantity::Reference, 0).is_some()
    }
}

/// Returns the key by which messages are sorted: standard identifiers before extended ones.
fn sort_key(id: FrameId) -> (bool, u32) {
    match id {
        FrameId::Standard(id) => (false, u32::from(id)),
        FrameId::Extended(id) => (true, id),
    }
}
