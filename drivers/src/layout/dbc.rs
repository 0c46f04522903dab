//! A DBC file with distinguishable messages, and the lookup of its signals by name.

use can_dbc::{
    AttributeValue, AttributeValueType, Dbc, DbcError, Message, MessageId, MultiplexIndicator,
    NumericValue, Signal, SignalExtendedValueType,
};

use super::error::LayoutError;
use super::field::{ByteOrder, EXACT_BITS, Encoding, Field};
use super::selector::Selector;
use crate::frame::{FrameId, MAX_CLASSIC_PAYLOAD, MAX_PAYLOAD, is_fd_length};

/// Smallest similarity of two names at which one is suggested for the other (1 is equal).
const SIMILARITY: f64 = 0.6;

/// A parsed and checked DBC file.
#[derive(Clone, Debug)]
pub struct Database<'a> {
    text: &'a str,
    dbc: Dbc,
}

/// Frame format of one message.
#[derive(Clone, Debug, PartialEq)]
pub struct MessageFormat {
    /// Name of the message.
    pub name: String,
    /// Identifier of the message.
    pub id: FrameId,
    /// True if the frames are CAN FD (`VFrameFormat`, or longer than 8 bytes).
    pub is_fd: bool,
    /// Length of the message in the DBC file \[bytes\].
    pub length: u8,
}

/// Format of one signal: its bits, its unit and its declared range.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalFormat {
    /// Name of the signal, as `Message.Signal`.
    pub name: String,
    /// Bits of the signal in the payload.
    pub field: Field,
    /// Unit of the signal, as the DBC file writes it.
    pub unit: String,
    /// Range that the DBC file declares, in the unit of the signal; `None` for `[0|0]`.
    pub range: Option<(f64, f64)>,
}

/// A signal, with the names of its message and of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NamedSignal<'a> {
    /// Name of the message.
    pub message: &'a str,
    /// Identifier of the message.
    pub id: FrameId,
    /// Name of the signal.
    pub name: &'a str,
    /// Unit of the signal, as the DBC file writes it.
    pub unit: &'a str,
}

fn frame_id(id: MessageId) -> FrameId {
    match id {
        MessageId::Standard(id) => FrameId::Standard(id),
        MessageId::Extended(id) => FrameId::Extended(id),
    }
}

impl MessageFormat {
    /// Returns the length of the frames of this message \[bytes\]. CAN FD frames have only certain
    /// lengths between 8 and 64 bytes (ISO 11898-1), so it may exceed [`Self::length`].
    pub fn wire_length(&self) -> u8 {
        let lengths = self.length..=u8::MAX;
        lengths.into_iter().find(|length| is_fd_length((*length).into())).unwrap_or(self.length)
    }
}

impl<'a> Database<'a> {
    /// Parses a DBC file and checks that its messages are distinguishable.
    ///
    /// # Errors
    /// [`LayoutError::Syntax`], [`LayoutError::IdOutOfRange`], [`LayoutError::DuplicateId`],
    /// [`LayoutError::DuplicateName`].
    pub fn parse(text: &'a str) -> Result<Self, LayoutError> {
        check_ids(text)?;
        let dbc = Dbc::try_from(text).map_err(|error| {
            let detail = match error {
                DbcError::Pest(error) => error.to_string(),
                other => other.to_string(),
            };
            LayoutError::Syntax { line: line_in(&detail), detail }
        })?;
        for (k, message) in dbc.messages.iter().enumerate() {
            for other in &dbc.messages[..k] {
                if other.id == message.id {
                    return Err(LayoutError::DuplicateId {
                        id: message.id.raw(),
                        first: other.name.clone(),
                        second: message.name.clone(),
                    });
                }
                if other.name == message.name {
                    return Err(LayoutError::DuplicateName { name: message.name.clone() });
                }
            }
            for (k, signal) in message.signals.iter().enumerate() {
                if message.signals[..k].iter().any(|other| other.name == signal.name) {
                    let name = format!("{}.{}", message.name, signal.name);
                    return Err(LayoutError::DuplicateName { name });
                }
            }
        }
        Ok(Self { text, dbc })
    }

    /// Returns the selector of the frames that carry a signal, or `None` if every frame of its
    /// message does.
    ///
    /// # Errors
    /// [`LayoutError::NoMessage`], [`LayoutError::Signal`].
    pub(super) fn selector(
        &self,
        key: &'static str,
        message: &str,
        name: &str,
    ) -> Result<Option<Selector>, LayoutError> {
        let signals = &self.find_message(key, message)?.signals;
        let indicator = signals.iter().find(|signal| signal.name == name);
        let indicator = indicator.map(|signal| signal.multiplexer_indicator);
        let Some(MultiplexIndicator::MultiplexedSignal(value)) = indicator else {
            return Ok(None);
        };
        let multiplexer = |signal: &&Signal| {
            matches!(signal.multiplexer_indicator, MultiplexIndicator::Multiplexor)
        };
        let Some(multiplexer) = signals.iter().find(multiplexer) else {
            return Err(LayoutError::Signal {
                signal: format!("{message}.{name}"),
                line: line_of_signal(self.text, message, name),
                reason: "multiplexed, and its message has no multiplexer (M)".into(),
            });
        };
        let SignalFormat { field, .. } = self.signal(key, message, &multiplexer.name)?;
        Ok(Some(Selector { field, value }))
    }

    /// Returns every signal that can be named in a layout, in the order of the file.
    pub fn signals(&self) -> impl Iterator<Item = NamedSignal<'_>> {
        self.dbc.messages.iter().flat_map(|message| {
            let id = frame_id(message.id);
            let plain = message.signals.iter().filter(|signal| {
                let of_signal = signal.multiplexer_indicator;
                use MultiplexIndicator::{MultiplexedSignal, Plain};
                matches!(of_signal, Plain | MultiplexedSignal(_))
            });
            plain.map(move |signal| NamedSignal {
                message: &message.name,
                id,
                name: &signal.name,
                unit: &signal.unit,
            })
        })
    }

    /// Returns the messages by name, in the order of the file.
    pub fn messages(&self) -> impl Iterator<Item = (&str, FrameId)> {
        self.dbc.messages.iter().map(|message| (message.name.as_str(), frame_id(message.id)))
    }

    /// Returns the frame format of a message; `key` is the layout key that names it.
    ///
    /// # Errors
    /// [`LayoutError::NoMessage`], [`LayoutError::Format`].
    pub fn message(&self, key: &'static str, name: &str) -> Result<MessageFormat, LayoutError> {
        let message = self.find_message(key, name)?;
        let refuse = |reason| LayoutError::Format {
            message: name.to_owned(),
            line: line_of_message(self.text, name),
            reason,
        };
        let length = usize::try_from(message.size)
            .ok()
            .filter(|length| *length <= MAX_PAYLOAD)
            .ok_or_else(|| refuse("a frame has at most 64 bytes"))?;
        let id = frame_id(message.id);
        let extended = matches!(id, FrameId::Extended(_));
        let fd = match self.frame_format(message.id).as_deref() {
            None => length > MAX_CLASSIC_PAYLOAD,
            Some("StandardCAN") if !extended => false,
            Some("StandardCAN_FD") if !extended => true,
            Some("ExtendedCAN") if extended => false,
            Some("ExtendedCAN_FD") if extended => true,
            Some(_) => return Err(refuse("its VFrameFormat does not match its identifier")),
        };
        if !fd && length > MAX_CLASSIC_PAYLOAD {
            return Err(refuse(
                "longer than the 8 bytes of a classic frame; set VFrameFormat to StandardCAN_FD",
            ));
        }
        let length = u8::try_from(length).map_err(|_| refuse("a frame has at most 64 bytes"))?;
        Ok(MessageFormat { name: name.to_owned(), id, is_fd: fd, length })
    }

    /// Returns a signal of a message; `key` is the layout key that names it.
    ///
    /// # Errors
    /// [`LayoutError::NoMessage`], [`LayoutError::NoSignal`], [`LayoutError::Signal`].
    pub fn signal(
        &self,
        key: &'static str,
        message: &str,
        name: &str,
    ) -> Result<SignalFormat, LayoutError> {
        let message_found = self.find_message(key, message)?;
        let signal =
            message_found.signals.iter().find(|signal| signal.name == name).ok_or_else(|| {
                LayoutError::NoSignal {
                    key,
                    message: message.to_owned(),
                    signal: name.to_owned(),
                    similar: similar_names(
                        name,
                        message_found.signals.iter().map(|signal| signal.name.as_str()),
                    ),
                }
            })?;
        let full_name = format!("{message}.{name}");
        self.format(message_found, signal).map_err(|reason| LayoutError::Signal {
            signal: full_name.clone(),
            line: line_of_signal(self.text, message, name),
            reason,
        })
    }

    fn format(&self, message: &Message, signal: &Signal) -> Result<SignalFormat, String> {
        match signal.multiplexer_indicator {
            MultiplexIndicator::Plain
            | MultiplexIndicator::Multiplexor
            | MultiplexIndicator::MultiplexedSignal(_) => {}
            MultiplexIndicator::MultiplexorAndMultiplexedSignal(_) => {
                return Err("a multiplexer that is multiplexed itself, which is not read".into());
            }
        }
        let extended = self
            .dbc
            .signal_extended_value_type_list
            .iter()
            .find(|entry| entry.message_id == message.id && entry.signal_name == signal.name);
        let encoding = match extended.map(|entry| entry.signal_extended_value_type) {
            Some(SignalExtendedValueType::IEEEfloat32Bit) => Encoding::Float32,
            Some(SignalExtendedValueType::IEEEdouble64bit) => Encoding::Float64,
            Some(SignalExtendedValueType::SignedOrUnsignedInteger) | None => {
                match signal.value_type {
                    can_dbc::ValueType::Signed => Encoding::Signed,
                    can_dbc::ValueType::Unsigned => Encoding::Unsigned,
                }
            }
        };
        let widths = match encoding {
            Encoding::Float32 => 32..=32,
            Encoding::Float64 => 64..=64,
            Encoding::Signed | Encoding::Unsigned => 1..=u64::from(EXACT_BITS),
        };
        if !widths.contains(&signal.size) {
            return Err(format!(
                "{} bits; {} to {} can be read exactly",
                signal.size,
                widths.start(),
                widths.end()
            ));
        }
        let (factor, offset) = (signal.factor, signal.offset);
        if !factor.is_finite() || factor == 0.0 || !offset.is_finite() {
            return Err(format!("the factor {factor} and the offset {offset} give no value"));
        }
        let order = match signal.byte_order {
            can_dbc::ByteOrder::LittleEndian => ByteOrder::LittleEndian,
            can_dbc::ByteOrder::BigEndian => ByteOrder::BigEndian,
        };
        let length = usize::try_from(message.size).unwrap_or(usize::MAX).min(MAX_PAYLOAD);
        let field = Field::new(
            signal.start_bit,
            signal.size,
            order,
            encoding,
            (factor, offset),
            length,
        )
        .ok_or_else(|| {
            format!(
                "its {} bits from start bit {} reach beyond the {length} bytes of its message",
                signal.size, signal.start_bit
            )
        })?;
        let (minimum, maximum) = (to_float(&signal.min), to_float(&signal.max));
        let range = (minimum < maximum).then_some((minimum, maximum));
        let name = format!("{}.{}", message.name, signal.name);
        Ok(SignalFormat { name, field, unit: signal.unit.clone(), range })
    }

    fn find_message(&self, key: &'static str, name: &str) -> Result<&Message, LayoutError> {
        self.dbc.messages.iter().find(|message| message.name == name).ok_or_else(|| {
            LayoutError::NoMessage {
                key,
                message: name.to_owned(),
                similar: similar_names(
                    name,
                    self.dbc.messages.iter().map(|message| message.name.as_str()),
                ),
            }
        })
    }

    /// Returns the frame format of a message (`VFrameFormat`): the value of the message itself, or
    /// otherwise the default of the file.
    fn frame_format(&self, id: MessageId) -> Option<String> {
        const FORMAT_ATTRIBUTE: &str = "VFrameFormat";
        let names =
            self.dbc.attribute_definitions.iter().find_map(|definition| match definition {
                can_dbc::AttributeDefinition::Message(name, AttributeValueType::Enum(names))
                    if name == FORMAT_ATTRIBUTE =>
                {
                    Some(names)
                }
                _ => None,
            })?;
        let values = &self.dbc.attribute_values_message;
        let attributes =
            values.iter().find(|value| value.name == FORMAT_ATTRIBUTE && value.message_id == id);
        let default =
            self.dbc.attribute_defaults.iter().find(|value| value.name == FORMAT_ATTRIBUTE);
        let value = attributes.map(|own| &own.value).or(default.map(|default| &default.value))?;
        match value {
            AttributeValue::String(name) => Some(name.clone()),
            AttributeValue::Uint(index) => names.get(usize::try_from(*index).ok()?).cloned(),
            // The value is neither a name nor an index. No format has an empty name, so the message
            // is refused.
            AttributeValue::Int(_) | AttributeValue::Double(_) => Some(String::new()),
        }
    }
}

/// Checks the identifiers of the messages in the text. can-dbc truncates an identifier without bit
/// 31 to 16 bits, which would turn one message into another.
fn check_ids(text: &str) -> Result<(), LayoutError> {
    const EXTENDED_ID_BIT: u64 = 1 << 31;
    // Editors store signals without a message under this identifier, which no frame has.
    const INDEPENDENT_SIGNALS: (u64, &str) = (0xC000_0000, "VECTOR__INDEPENDENT_SIG_MSG");
    for (k, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        if words.next() != Some("BO_") {
            continue;
        }
        // Leave anything that is not a number to the parser.
        let Some(Ok(id)) = words.next().map(str::parse::<u64>) else { continue };
        let name = words.next().map(|word| word.trim_end_matches(':'));
        if (id, name) == (INDEPENDENT_SIGNALS.0, Some(INDEPENDENT_SIGNALS.1)) {
            continue;
        }
        if id > 0x7FF && !(EXTENDED_ID_BIT..=EXTENDED_ID_BIT + 0x1FFF_FFFF).contains(&id) {
            let (line, message) = (k + 1, name.unwrap_or_default().to_owned());
            return Err(LayoutError::IdOutOfRange { line, message, id });
        }
    }
    Ok(())
}

#[allow(clippy::cast_precision_loss, reason = "a declared limit, not a measured value")]
fn to_float(value: &NumericValue) -> f64 {
    match *value {
        NumericValue::Uint(value) => value as f64,
        NumericValue::Int(value) => value as f64,
        NumericValue::Double(value) => value,
    }
}

/// Returns the line number in a message of the parser, which starts with ` --> line:column`.
fn line_in(detail: &str) -> Option<usize> {
    let (_, rest) = detail.split_once("-->")?;
    rest.split(':').next()?.trim().parse().ok()
}

fn line_of_message(text: &str, message: &str) -> Option<usize> {
    text.lines().position(|line| is_line_of(line, "BO_", message, 2)).map(|k| k + 1)
}

fn line_of_signal(text: &str, message: &str, signal: &str) -> Option<usize> {
    let first = line_of_message(text, message)?;
    text.lines()
        .skip(first)
        .position(|line| is_line_of(line, "SG_", signal, 1))
        .map(|k| first + k + 1)
}

/// Returns true if a line begins with `keyword` and its word number `at` is `name`, with or without
/// a colon. Words count from 0.
fn is_line_of(line: &str, keyword: &str, name: &str, at: usize) -> bool {
    let mut words = line.split_whitespace();
    words.next() == Some(keyword)
        && words.nth(at - 1).is_some_and(|word| word.split(':').next() == Some(name))
}

/// Returns the three names that are most similar to `name`.
fn similar_names<'n>(name: &str, names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let mut similar: Vec<(f64, &str)> = names
        .map(|other| (strsim::normalized_damerau_levenshtein(name, other), other))
        .filter(|(likeness, _)| *likeness >= SIMILARITY)
        .collect();
    similar.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(b.1)));
    similar.into_iter().take(3).map(|(_, name)| name.to_owned()).collect()
}
