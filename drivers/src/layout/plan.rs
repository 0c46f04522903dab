//! The compiled plan: from a frame to numbers without a name, a search or an allocation.

use std::fmt;

use didim_core::Reading;
use didim_core::identification::SignalTiming;

use super::dbc::{MessageFormat, SignalFormat};
use super::field::Field;
use super::process_data::ProcessData;
use super::spec::{CyclesBy, FollowingError};
use crate::frame::{Frame, FrameId, FrameKind};

/// One entry for every identifier of 11 bits.
const STANDARD_IDS: usize = 1 << 11;

/// The entry of an identifier that the plan does not know.
const NONE: u8 = u8::MAX;

/// What a signal of the layout is.
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
    /// A state of another kind of drive, which has one value where it is enabled.
    Enabled,
    /// Counter of the packed frame; of no axis, `axis` is 0.
    Counter,
    /// What the EtherCAT network said of itself in the cycle: AL status, and whether the working
    /// counters are the expected ones.
    NetworkState,
    /// What a drive tells besides.
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

/// What a message is to a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Its arrival is the instant of a sample. It carries no signal, unless signals are valid at the
    /// arrival of their frames.
    Sync,
    /// It carries what a sample cannot be without.
    Sample,
    /// It carries nothing but references.
    Target,
    /// It carries nothing but readings, and may come seldom.
    Reading,
}

/// The message whose arrival is the instant of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SampledBy {
    /// The SYNC message.
    Sync,
    /// The packed message itself.
    Packed,
}

/// Why the plan cannot read a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unreadable {
    /// An error report of the controller.
    Error,
    /// A remote request: it carries no data.
    Remote,
    /// No message of the layout has this identifier.
    UnknownId,
    /// A classic frame where the message is CAN FD, or the reverse.
    WrongFormat,
    /// Not the length of the message.
    WrongLength,
    /// By its content something else than the message.
    Excepted,
}

/// One signal of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Extraction {
    /// What it is.
    pub quantity: Quantity,
    /// Of which axis, from 0.
    pub axis: usize,
    /// Its bits, unit and range.
    pub signal: SignalFormat,
}

impl Extraction {
    /// The value in the unit of the DBC file, or `None` where it is not finite or outside of the
    /// range that the file declares. An integer's limits are taken with half a step to spare: 32767
    /// times 0.1 is not the number that 3276.7 is.
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
    /// What its frames look like.
    pub format: MessageFormat,
    /// What it is to a sample.
    pub role: Role,
    /// Its signals, in the order position, torque, reference, status word, state, readings, counter.
    pub extractions: Vec<Extraction>,
    /// Frames in which such an integer has one of these values carry something else.
    pub except: Vec<(Field, Vec<u16>)>,
}

/// When the signals of a plan are valid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Validity {
    pub(super) at_arrival: bool,
    pub(super) torque: SignalTiming,
    pub(super) reference_at_next_sync: bool,
    /// What the references are, where they are following errors and no positions.
    pub(super) following_error: Option<FollowingError>,
    /// The value that the states have of drives that are enabled.
    pub(super) enabled: u16,
}

/// A layout ready to read frames. Immutable after it is made.
#[derive(Clone, Debug, PartialEq)]
pub struct CompiledLayout {
    messages: Vec<MessagePlan>,
    standard: Box<[u8]>,
    extended: Vec<(u32, u8)>,
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
        messages.sort_by_key(|message| order(message.format.id));
        let mut standard = vec![NONE; STANDARD_IDS].into_boxed_slice();
        let mut extended = Vec::new();
        for (k, message) in (0u8..).zip(&messages) {
            match message.format.id {
                FrameId::Standard(id) => {
                    if let Some(entry) = standard.get_mut(usize::from(id)) {
                        *entry = k;
                    }
                }
                FrameId::Extended(id) => extended.push((id, k)),
            }
        }
        Self {
            messages,
            standard,
            extended,
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

    /// How EtherCAT datagrams become the frames of the plan; nothing where they come as they are.
    pub fn process_data(&self) -> Option<&ProcessData> {
        self.process_data.as_ref()
    }

    /// What the layout reads, as text: a line for each message and each datagram.
    pub fn described(&self) -> String {
        let message = |message: &MessagePlan| {
            let signals = message.extractions.iter().map(|e| e.signal.name.as_str());
            let signals: Vec<&str> = signals.collect();
            format!("{} {}: {}\n", message.format.id, message.format.name, signals.join(" "))
        };
        let datagrams = self.process_data.iter().flat_map(|data| &data.datagrams);
        let datagrams = datagrams.map(|datagram| format!("{datagram:?}\n"));
        self.messages.iter().map(message).chain(datagrams).collect()
    }

    /// How bus cycles are counted.
    pub fn cycles_by(&self) -> CyclesBy {
        self.cycles_by
    }

    /// The messages, ordered by identifier.
    pub fn messages(&self) -> &[MessagePlan] {
        &self.messages
    }

    /// The message of a frame and its index in [`Self::messages`].
    ///
    /// # Errors
    /// [`Unreadable`] says why the frame is none of the layout's.
    pub fn read(&self, frame: &Frame) -> Result<(usize, &MessagePlan), Unreadable> {
        let fd = match frame.kind {
            FrameKind::Error => return Err(Unreadable::Error),
            FrameKind::Remote => return Err(Unreadable::Remote),
            FrameKind::Classic => false,
            FrameKind::Fd { .. } => true,
        };
        let index = self.find(frame.id).ok_or(Unreadable::UnknownId)?;
        let message = self.messages.get(index).ok_or(Unreadable::UnknownId)?;
        if message.format.fd != fd {
            return Err(Unreadable::WrongFormat);
        }
        if frame.length != message.format.length && frame.length != message.format.wire_length() {
            return Err(Unreadable::WrongLength);
        }
        let says = |field: &Field, value: &u16| field.bits(frame.data()) == u64::from(*value);
        let mut except = message.except.iter();
        if except.any(|(field, values)| values.iter().any(|value| says(field, value))) {
            return Err(Unreadable::Excepted);
        }
        Ok((index, message))
    }

    fn find(&self, id: FrameId) -> Option<usize> {
        let index = match id {
            FrameId::Standard(id) => *self.standard.get(usize::from(id))?,
            FrameId::Extended(id) => {
                let at = self.extended.binary_search_by_key(&id, |(id, _)| *id).ok()?;
                self.extended.get(at)?.1
            }
        };
        (index != NONE).then_some(usize::from(index))
    }

    /// The message whose arrival is the instant of a sample.
    pub fn sampled_by(&self) -> SampledBy {
        self.sampled_by
    }

    /// Number of axes.
    pub fn axes(&self) -> usize {
        self.axes
    }

    /// The nominal period of the bus cycle \[ns\].
    pub fn period_ns(&self) -> f64 {
        self.period_ns
    }

    /// When the torque acts, relative to the instant of its sample.
    pub fn torque_timing(&self) -> SignalTiming {
        self.validity.torque
    }

    /// Whether every signal is valid at the arrival of its own frame; else all are valid at the instant
    /// of the sample, or as [`Self::torque_timing`] and [`Self::reference_at_next_sync`] say.
    pub fn at_arrival(&self) -> bool {
        self.validity.at_arrival
    }

    /// The value that a [`Quantity::Enabled`] has where the drive is enabled.
    pub fn enabled_value(&self) -> u16 {
        self.validity.enabled
    }

    /// Whether a reference takes effect in the sample after the one whose cycle carries it.
    pub fn reference_at_next_sync(&self) -> bool {
        self.validity.reference_at_next_sync
    }

    /// What the references are, where they are following errors and no positions.
    pub fn following_error(&self) -> Option<FollowingError> {
        self.validity.following_error
    }

    /// The signal that carries a quantity of an axis (from 0), if the layout has it.
    pub fn signal(&self, quantity: Quantity, axis: usize) -> Option<&SignalFormat> {
        let mut all = self.messages.iter().flat_map(|message| &message.extractions);
        all.find(|e| e.quantity == quantity && e.axis == axis).map(|e| &e.signal)
    }

    /// Whether the layout has a reference.
    pub fn has_reference(&self) -> bool {
        self.signal(Quantity::Reference, 0).is_some()
    }
}

/// The order in which messages are found: standard identifiers before extended ones.
fn order(id: FrameId) -> (bool, u32) {
    match id {
        FrameId::Standard(id) => (false, u32::from(id)),
        FrameId::Extended(id) => (true, id),
    }
}
