//! Contents and timing of the PDOs of a node (CiA 301, 7.5.2.35 to 7.5.2.38).

use super::dictionary::{Dictionary, name};
use super::error::EdsError;
use crate::frame::FrameId;

/// Largest size of a PDO on classic CAN \[bits\].
const MAX_BITS: u64 = 64;
/// Bit 31 of a COB-ID; if it is set, the PDO does not exist.
const INVALID_BIT: u64 = 1 << 31;
/// Bit 29 of a COB-ID; if it is set, the identifier has 29 bits.
const EXTENDED_ID_BIT: u64 = 1 << 29;

/// Direction of a PDO, given by its sender.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::layout) enum Direction {
    /// The node sends the PDO (TPDO).
    Transmit,
    /// The controller of the node sends the PDO (RPDO).
    Receive,
}

impl Direction {
    pub(in crate::layout) fn name(self) -> &'static str {
        match self {
            Self::Transmit => "TPDO",
            Self::Receive => "RPDO",
        }
    }

    /// Returns the index of the first communication object and that of the first mapping object.
    fn first_objects(self) -> (u16, u16) {
        match self {
            Self::Transmit => (0x1800, 0x1A00),
            Self::Receive => (0x1400, 0x1600),
        }
    }
}

/// Index and sub-index of an object of the dictionary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::layout) struct Object {
    pub(in crate::layout) index: u16,
    pub(in crate::layout) sub_index: u8,
}

impl Object {
    /// Parses an object such as `6064:00`, with index and sub-index in hexadecimal.
    pub(in crate::layout) fn parse(text: &str) -> Option<Self> {
        let (index, sub) = text.split_once(':')?;
        let hex = |text: &str| text.bytes().all(|b| b.is_ascii_hexdigit());
        if index.len() != 4 || sub.len() != 2 || !hex(index) || !hex(sub) {
            return None;
        }
        let index = u16::from_str_radix(index, 16).ok()?;
        Some(Self { index, sub_index: u8::from_str_radix(sub, 16).ok()? })
    }
}

impl core::fmt::Display for Object {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:04X}:{:02X}", self.index, self.sub_index)
    }
}

/// Position of an object in a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::layout) struct Mapped {
    pub(in crate::layout) object: Object,
    pub(in crate::layout) first_bit: u64,
    pub(in crate::layout) bits: u64,
}

/// One PDO and its contents.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::layout) struct Pdo {
    pub(in crate::layout) direction: Direction,
    /// Number of the PDO, from 0.
    number: u16,
    pub(in crate::layout) mapped: Vec<Mapped>,
    bits: u64,
}

/// Transmission of a PDO: its time and its identifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::layout) struct Transmission {
    pub(in crate::layout) id: FrameId,
}

/// Remedy for a file without the transmission settings of a PDO.
const NO_SETTINGS_REMEDY: &str =
    "the layout needs the identifier and the transmission type; take a DCF that has them";

impl Pdo {
    /// Returns every PDO of a direction that maps at least one object.
    pub(in crate::layout) fn read_all(
        dictionary: &Dictionary<'_>,
        direction: Direction,
    ) -> Result<Vec<Self>, EdsError> {
        let (_, first) = direction.first_objects();
        dictionary
            .existing_indices(first, first + 0x1FF)
            .map(|index| Self::read(dictionary, direction, index - first))
            .filter(|read| !matches!(read, Ok(pdo) if pdo.mapped.is_empty()))
            .collect()
    }

    fn read(
        dictionary: &Dictionary<'_>,
        direction: Direction,
        number: u16,
    ) -> Result<Self, EdsError> {
        let index = direction.first_objects().1 + number;
        let mut pdo = Self { direction, number, mapped: Vec::new(), bits: 0 };
        // The PDO maps nothing if the number of entries is missing, or if it marks a multiplexed
        // PDO.
        let Some(count) = dictionary.value(index, 0)? else { return Ok(pdo) };
        let Ok(count @ 1..=64) = u8::try_from(count.number) else { return Ok(pdo) };
        for sub in 1..=count {
            let remedy = "the file states this number of mapped objects; give them all";
            let entry = dictionary.required_value(index, sub, remedy)?;
            let word = u32::try_from(entry.number).map_err(|_| {
                dictionary
                    .value_error(&entry, "has more than 32 bits; write index, sub, bits".into())
            })?;
            let [high, low, sub, bits] = word.to_be_bytes();
            let bits = u64::from(bits);
            if bits == 0 || pdo.bits + bits > MAX_BITS {
                let reason = format!(
                    "{bits} bits after {}; a mapped object has at least one, and a PDO at most \
                     {MAX_BITS}",
                    pdo.bits
                );
                return Err(dictionary.value_error(&entry, reason));
            }
            // Objects with an index below 1000h are data types. They mark gaps of their size.
            let object = Object { index: u16::from_be_bytes([high, low]), sub_index: sub };
            pdo.mapped.push(Mapped { object, first_bit: pdo.bits, bits });
            pdo.bits += bits;
        }
        Ok(pdo)
    }

    /// Returns the name of the PDO, such as `TPDO1`.
    pub(in crate::layout) fn name(&self) -> String {
        format!("{}{}", self.direction.name(), self.number + 1)
    }

    /// Returns the length of the PDO's frames \[bytes\].
    pub(in crate::layout) fn bytes(&self) -> u8 {
        u8::try_from(self.bits.div_ceil(8)).unwrap_or(u8::MAX)
    }

    /// Returns the position of an object in the PDO, or `None` if the PDO does not carry it.
    pub(in crate::layout) fn find(&self, object: Object) -> Option<Mapped> {
        self.mapped.iter().copied().find(|mapped| mapped.object == object)
    }

    /// Returns the transmission of a PDO that is synchronous. Only the SYNC gives a value its
    /// instant.
    ///
    /// # Errors
    /// Returns a description if the PDO does not exist, or if an event triggers it.
    pub(in crate::layout) fn synchronous_transmission(
        &self,
        dictionary: &Dictionary<'_>,
    ) -> Result<Transmission, EdsError> {
        let Transmission { id } = self.transmission(dictionary)?;
        let kind = dictionary.required_value(
            self.direction.first_objects().0 + self.number,
            2,
            NO_SETTINGS_REMEDY,
        )?;
        match (self.direction, kind.number) {
            (Direction::Transmit, 1) | (Direction::Receive, 0..=240) => Ok(Transmission { id }),
            (Direction::Transmit, 0) => Err(dictionary.value_error(
                &kind,
                "type 0 is sent only when a value has changed, so that samples would be missing; \
                 set it to 1"
                    .into(),
            )),
            (Direction::Transmit, every @ 2..=240) => Err(dictionary.value_error(
                &kind,
                format!("type {every} is sent at every {every}th SYNC only; set it to 1"),
            )),
            (_, other) => {
                let index = self.direction.first_objects().0 + self.number;
                let timer_ms = dictionary.value(index, 5)?.map_or(0, |timer| timer.number);
                let cycle = match timer_ms {
                    0 => String::new(),
                    _ => format!(" (its event timer sends it every {timer_ms} ms)"),
                };
                let problem = format!(
                    "type {other} does not go by the SYNC{cycle}, so its values have no instant; \
                     set it to 1 (synchronous) in the drive and give its DCF"
                );
                Err(dictionary.value_error(&kind, problem))
            }
        }
    }

    /// Returns the transmission of the PDO, regardless of the time at which it is sent.
    ///
    /// # Errors
    /// Returns a description if the PDO does not exist.
    pub(in crate::layout) fn transmission(
        &self,
        dictionary: &Dictionary<'_>,
    ) -> Result<Transmission, EdsError> {
        let index = self.direction.first_objects().0 + self.number;
        let cob_id = dictionary.required_value(index, 1, NO_SETTINGS_REMEDY)?;
        let refuse = |sub, reason: String| EdsError::Pdo {
            file: dictionary.file.to_owned(),
            section: name(index, sub),
            pdo: self.name(),
            node: dictionary.node,
            reason,
        };
        if cob_id.number & INVALID_BIT != 0 {
            return Err(refuse(
                1,
                format!(
                    "bit 31 of the COB-ID 0x{:X} says that the PDO does not exist; clear it in the \
                     drive and give its DCF",
                    cob_id.number
                ),
            ));
        }
        let id =
            identifier(cob_id.number).map_err(|reason| dictionary.value_error(&cob_id, reason))?;
        Ok(Transmission { id })
    }
}

/// Returns the identifier that a COB-ID contains.
pub(in crate::layout) fn identifier(cob_id: u64) -> Result<FrameId, String> {
    let number = u32::try_from(cob_id & 0x1FFF_FFFF).unwrap_or(u32::MAX);
    if cob_id > u64::from(u32::MAX) {
        return Err(format!("0x{cob_id:X} has more than 32 bits"));
    }
    let id = if cob_id & EXTENDED_ID_BIT != 0 {
        FrameId::extended(number).ok()
    } else {
        u16::try_from(number).ok().and_then(|number| FrameId::standard(number).ok())
    };
    id.filter(|id| id.number() != 0).ok_or_else(|| {
        format!(
            "0x{cob_id:X} holds no identifier of 11 bits, or of 29 with bit 29 set; 0 is that of \
             network management"
        )
    })
}
