//! A CAN or CAN FD frame with its time stamp.

pub(crate) mod interface;
#[cfg(target_os = "linux")]
mod socketcan;

/// The longest payload of a CAN FD frame \[bytes\].
pub const MAX_PAYLOAD: usize = 64;

/// The longest payload of a classic frame \[bytes\].
pub const MAX_CLASSIC_PAYLOAD: usize = 8;

/// The largest 11-bit identifier.
pub const MAX_STANDARD_ID: u16 = 0x7FF;

/// The largest 29-bit identifier; also the mask of an error frame's class bits.
pub const MAX_EXTENDED_ID: u32 = 0x1FFF_FFFF;

/// An identifier with its format (ISO 11898-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FrameId {
    /// Identifier of 11 bits.
    Standard(u16),
    /// Identifier of 29 bits.
    Extended(u32),
}

impl FrameId {
    /// Creates an 11-bit identifier.
    ///
    /// # Errors
    /// [`FrameError::IdRange`] above 0x7FF.
    pub const fn standard(id: u16) -> Result<Self, FrameError> {
        Self::Standard(id).check_range()
    }

    /// Creates a 29-bit identifier.
    ///
    /// # Errors
    /// [`FrameError::IdRange`] above 0x1FFFFFFF.
    pub const fn extended(id: u32) -> Result<Self, FrameError> {
        Self::Extended(id).check_range()
    }

    /// Returns the number without its format.
    pub const fn number(self) -> u32 {
        match self {
            Self::Standard(id) => id as u32,
            Self::Extended(id) => id,
        }
    }

    /// Returns the identifier unchanged, or an error if its number does not fit its format.
    const fn check_range(self) -> Result<Self, FrameError> {
        match self {
            Self::Standard(id) if id > MAX_STANDARD_ID => {
                Err(FrameError::IdRange { id: id as u32, bits: 11 })
            }
            Self::Extended(id) if id > MAX_EXTENDED_ID => Err(FrameError::IdRange { id, bits: 29 }),
            fits => Ok(fits),
        }
    }
}

/// Writes the identifier as candump does, with three or eight hexadecimal digits.
impl core::fmt::Display for FrameId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Standard(id) => write!(f, "{id:03X}"),
            Self::Extended(id) => write!(f, "{id:08X}"),
        }
    }
}

/// Kind of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameKind {
    /// Classic CAN data, up to 8 bytes.
    Classic,
    /// CAN FD data, up to 64 bytes.
    Fd {
        /// True if the payload was sent at the second bit rate.
        bit_rate_switch: bool,
        /// True if the sender was error passive.
        error_state_indicator: bool,
    },
    /// A classic remote request, which carries no data.
    Remote,
    /// An error report of the controller, not a frame of the bus. Its identifier holds the error
    /// class bits of `linux/can/error.h`.
    Error,
}

/// Direction of a frame, as reported by the kernel or the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the bus.
    Received,
    /// Sent by this host.
    Transmitted,
}

/// One frame. Plain data of fixed size: nothing is allocated for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Arrival time on the clock of the source \[ns\]: CLOCK_REALTIME of a live bus, or the log's
    /// own clock in replay.
    pub stamp_ns: u64,
    /// Index of the receiving interface, in the order of the source's interfaces.
    pub interface: u8,
    /// Identifier of the frame.
    pub id: FrameId,
    /// Kind of the frame.
    pub kind: FrameKind,
    /// Direction of the frame.
    pub direction: Direction,
    /// Number of valid bytes of `payload`; for a remote request the number of requested bytes.
    pub length: u8,
    /// Payload bytes; those beyond `length` are zero.
    pub payload: [u8; MAX_PAYLOAD],
}

impl Frame {
    /// Creates a classic data frame, received on interface 0 at time 0.
    ///
    /// # Errors
    /// [`FrameError::IdRange`]; [`FrameError::ClassicLength`] above 8 bytes.
    pub fn classic(id: FrameId, data: &[u8]) -> Result<Self, FrameError> {
        Self::new(id, FrameKind::Classic, data)
    }

    /// Creates a CAN FD data frame, received on interface 0 at time 0.
    ///
    /// # Errors
    /// [`FrameError::IdRange`]; [`FrameError::FdLength`] for a length without an FD data length
    /// code.
    pub fn fd(id: FrameId, bit_rate_switch: bool, data: &[u8]) -> Result<Self, FrameError> {
        Self::new(id, FrameKind::Fd { bit_rate_switch, error_state_indicator: false }, data)
    }

    /// Creates a remote request for `length` bytes, received on interface 0 at time 0.
    ///
    /// # Errors
    /// [`FrameError::IdRange`]; [`FrameError::ClassicLength`] above 8 bytes.
    pub fn remote(id: FrameId, length: u8) -> Result<Self, FrameError> {
        if usize::from(length) > MAX_CLASSIC_PAYLOAD {
            return Err(FrameError::ClassicLength { id, length: usize::from(length) });
        }
        Ok(Self { length, ..Self::new(id, FrameKind::Remote, &[])? })
    }

    /// Creates an error report with the class bits of `linux/can/error.h`, on interface 0 at time
    /// 0.
    ///
    /// # Errors
    /// [`FrameError::IdRange`] if `class` has more than 29 bits; [`FrameError::ClassicLength`]
    /// above 8 bytes.
    pub fn error(class: u32, data: &[u8]) -> Result<Self, FrameError> {
        Self::new(FrameId::Extended(class), FrameKind::Error, data)
    }

    /// Creates a frame of any kind. A remote request that this function creates requests no bytes.
    ///
    /// # Errors
    /// [`FrameError`] as for the constructor of this kind.
    pub fn new(id: FrameId, kind: FrameKind, data: &[u8]) -> Result<Self, FrameError> {
        let id = id.check_range()?;
        let fits = match kind {
            FrameKind::Classic | FrameKind::Error => data.len() <= MAX_CLASSIC_PAYLOAD,
            FrameKind::Remote => data.is_empty(),
            FrameKind::Fd { .. } => is_fd_length(data.len()),
        };
        let mut payload = [0; MAX_PAYLOAD];
        match (payload.get_mut(..data.len()), u8::try_from(data.len())) {
            (Some(bytes), Ok(length)) if fits => {
                bytes.copy_from_slice(data);
                let direction = Direction::Received;
                Ok(Self { stamp_ns: 0, interface: 0, id, kind, direction, length, payload })
            }
            _ if matches!(kind, FrameKind::Fd { .. }) => {
                Err(FrameError::FdLength { id, length: data.len() })
            }
            _ => Err(FrameError::ClassicLength { id, length: data.len() }),
        }
    }

    /// Returns the same frame at the given time \[ns\].
    #[must_use]
    pub const fn with_stamp(self, stamp_ns: u64) -> Self {
        Self { stamp_ns, ..self }
    }

    /// Returns the same frame on the given interface.
    #[must_use]
    pub const fn on_interface(self, interface: u8) -> Self {
        Self { interface, ..self }
    }

    /// Returns the same frame with the given direction.
    #[must_use]
    pub const fn with_direction(self, direction: Direction) -> Self {
        Self { direction, ..self }
    }

    /// Returns the valid bytes; none for a remote request.
    pub fn data(&self) -> &[u8] {
        match self.kind {
            FrameKind::Remote => &[],
            _ => &self.payload[..usize::from(self.length).min(MAX_PAYLOAD)],
        }
    }

    /// Returns true if the frame reports an error of the controller instead of data of the bus.
    pub const fn is_error(&self) -> bool {
        matches!(self.kind, FrameKind::Error)
    }
}

/// Returns true if a CAN FD data length code exists for this number of bytes (ISO 11898-1, table of
/// DLC).
pub const fn is_fd_length(length: usize) -> bool {
    matches!(length, 0..=8 | 12 | 16 | 20 | 24 | 32 | 48 | 64)
}

/// Reason why a frame cannot exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// The identifier does not fit its format: use an extended one, or correct the number.
    #[error("identifier 0x{id:X} does not fit {bits} bits")]
    IdRange {
        /// The number of the identifier.
        id: u32,
        /// Number of bits of the format: 11 or 29.
        bits: u8,
    },
    /// A classic frame holds at most 8 bytes: send fewer, or use CAN FD.
    #[error(
        "frame {id}: a classic frame cannot hold {length} bytes, at most 8 (a remote one none)"
    )]
    ClassicLength {
        /// Identifier of the frame.
        id: FrameId,
        /// Number of data bytes.
        length: usize,
    },
    /// No FD data length code exists for this length. Pad the data to the next possible length.
    #[error(
        "frame {id}: no CAN FD frame has {length} bytes, only 0 to 8, 12, 16, 20, 24, 32, 48 or 64"
    )]
    FdLength {
        /// Identifier of the frame.
        id: FrameId,
        /// Number of data bytes.
        length: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn identifiers_are_held_to_their_format() {
        assert_eq!(FrameId::standard(0x7FF), Ok(FrameId::Standard(0x7FF)));
        assert_eq!(FrameId::standard(0x800), Err(FrameError::IdRange { id: 0x800, bits: 11 }));
        assert_eq!(FrameId::extended(0x1FFF_FFFF), Ok(FrameId::Extended(0x1FFF_FFFF)));
        assert!(FrameId::extended(0x2000_0000).is_err());
        // A variant written by hand is checked when the frame is created.
        assert!(Frame::classic(FrameId::Standard(0x800), &[]).is_err());
    }

    #[test]
    fn lengths_are_those_of_the_standard() {
        let id = FrameId::Standard(1);
        let lengths = |make: &dyn Fn(&[u8]) -> bool| -> Vec<usize> {
            (0..=70).filter(|&n| make(&vec![1; n])).collect()
        };
        let classic: Vec<usize> = (0..=8).collect();
        let fd: Vec<usize> = (0..=8).chain([12, 16, 20, 24, 32, 48, 64]).collect();
        assert_eq!(lengths(&|data| Frame::classic(id, data).is_ok()), classic);
        assert_eq!(lengths(&|data| Frame::error(4, data).is_ok()), classic);
        assert_eq!(lengths(&|data| Frame::fd(id, true, data).is_ok()), fd);
        assert_eq!(lengths(&|data| Frame::new(id, FrameKind::Remote, data).is_ok()), [0]);
        assert!(Frame::remote(id, 8).is_ok() && Frame::remote(id, 9).is_err());
    }

    #[test]
    fn a_remote_request_has_a_length_but_no_data() {
        let frame = Frame::remote(FrameId::Standard(0x123), 4).unwrap();
        assert_eq!((frame.length, frame.data()), (4, &[][..]));
    }

    proptest! {
        #[test]
        fn a_frame_made_holds_what_was_given(
            id in 0u32..0x2000_0000,
            data in prop::collection::vec(any::<u8>(), 0..80),
        ) {
            match Frame::fd(FrameId::Extended(id), false, &data) {
                Ok(frame) => {
                    prop_assert_eq!(frame.data(), &data[..]);
                    prop_assert!(frame.payload[data.len()..].iter().all(|&byte| byte == 0));
                }
                Err(error) => {
                    let (id, length) = (FrameId::Extended(id), data.len());
                    prop_assert_eq!(error, FrameError::FdLength { id, length });
                }
            }
        }

        #[test]
        fn no_length_makes_data_panic(length in any::<u8>()) {
            let frame = Frame { length, ..Frame::classic(FrameId::Standard(1), &[]).unwrap() };
            prop_assert!(frame.data().len() <= MAX_PAYLOAD);
        }
    }
}
