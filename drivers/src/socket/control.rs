//! Control messages (cmsg(3)) of a received frame, read as bytes in safe code.

/// Bytes reserved for the control messages of one frame: SCM_TIMESTAMPING (64) and SO_RXQ_OVFL (24)
/// on 64-bit machines, plus a reserve.
pub(super) const CONTROL_BYTES: usize = 128;

/// Size of C's `size_t` and `long`, the fields of cmsghdr and timespec.
const WORD_BYTES: usize = size_of::<usize>();

/// Size of `struct cmsghdr`: its length as `size_t`, the level and the type as `int`.
const HEADER_BYTES: usize = WORD_BYTES + 8;

/// Data of the kernel about a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ControlData {
    /// CLOCK_REALTIME at which the kernel received the frame \[ns\].
    pub(crate) software_ns: Option<u64>,
    /// Time of the controller's own clock at which it received the frame \[ns\].
    pub(crate) hardware_ns: Option<u64>,
    /// Number of frames dropped from the queue of this socket since its creation. The counter wraps
    /// at 32 bits. The kernel does not report it before the first drop.
    pub(crate) drops: Option<u32>,
}

impl ControlData {
    /// Reads the bytes written by the kernel; unknown and incomplete messages are skipped.
    pub(super) fn parse(mut rest: &[u8]) -> Self {
        let mut data = Self::default();
        while let Some((length, level, kind)) = header(rest) {
            let Some(message) = rest.get(HEADER_BYTES..length) else { break };
            if level == libc::SOL_SOCKET {
                data.read(kind, message);
            }
            rest = rest.get(length.next_multiple_of(WORD_BYTES)..).unwrap_or_default();
        }
        data
    }

    fn read(&mut self, kind: libc::c_int, message: &[u8]) {
        match kind {
            // The message has three times: the software time, an obsolete one and the hardware
            // time. A time is zero if it is not available.
            libc::SCM_TIMESTAMPING => {
                self.software_ns = timespec_ns(message, 0);
                self.hardware_ns = timespec_ns(message, 2);
            }
            libc::SCM_TIMESTAMPNS => self.software_ns = timespec_ns(message, 0),
            libc::SO_RXQ_OVFL => {
                self.drops = message.first_chunk().map(|bytes| u32::from_ne_bytes(*bytes));
            }
            _ => {}
        }
    }
}

fn header(bytes: &[u8]) -> Option<(usize, libc::c_int, libc::c_int)> {
    let length = usize::from_ne_bytes(*bytes.first_chunk()?);
    let level = libc::c_int::from_ne_bytes(*bytes.get(WORD_BYTES..)?.first_chunk()?);
    let kind = libc::c_int::from_ne_bytes(*bytes.get(WORD_BYTES + 4..)?.first_chunk()?);
    (length >= HEADER_BYTES).then_some((length, level, kind))
}

/// Returns the time in the timespec with this index \[ns\], or `None` if it is zero or missing.
fn timespec_ns(message: &[u8], index: usize) -> Option<u64> {
    let bytes = message.get(index * 2 * WORD_BYTES..)?;
    let seconds = isize::from_ne_bytes(*bytes.first_chunk()?);
    let nanoseconds = isize::from_ne_bytes(*bytes.get(WORD_BYTES..)?.first_chunk()?);
    let ns = u64::try_from(seconds)
        .ok()?
        .checked_mul(1_000_000_000)?
        .checked_add(u64::try_from(nanoseconds).ok()?)?;
    (ns != 0).then_some(ns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn message(kind: libc::c_int, data: &[u8]) -> Vec<u8> {
        let mut bytes = (HEADER_BYTES + data.len()).to_ne_bytes().to_vec();
        bytes.extend(libc::SOL_SOCKET.to_ne_bytes());
        bytes.extend(kind.to_ne_bytes());
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(WORD_BYTES), 0);
        bytes
    }

    fn words(words: &[isize]) -> Vec<u8> {
        words.iter().flat_map(|word| word.to_ne_bytes()).collect()
    }

    #[test]
    fn stamps_and_drops_are_found_in_any_order() {
        let stamps = message(libc::SCM_TIMESTAMPING, &words(&[1, 5, 0, 0, 2, 7]));
        let drops = message(libc::SO_RXQ_OVFL, &77u32.to_ne_bytes());
        let expected = ControlData {
            software_ns: Some(1_000_000_005),
            hardware_ns: Some(2_000_000_007),
            drops: Some(77),
        };
        for order in [[&stamps, &drops], [&drops, &stamps]] {
            let bytes: Vec<u8> = order.into_iter().flatten().copied().collect();
            assert_eq!(ControlData::parse(&bytes), expected);
        }
        let software = message(libc::SCM_TIMESTAMPNS, &words(&[1, 5]));
        assert_eq!(ControlData::parse(&software).software_ns, Some(1_000_000_005));
        let none = message(libc::SCM_TIMESTAMPING, &words(&[1, 5, 0, 0, 0, 0]));
        assert_eq!(ControlData::parse(&none).hardware_ns, None);
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic_or_hang(
            bytes in prop::collection::vec(any::<u8>(), 0..CONTROL_BYTES),
        ) {
            let _ = ControlData::parse(&bytes);
        }

        #[test]
        fn no_length_makes_it_panic_or_hang(length in any::<usize>(), cut in 0usize..64) {
            let mut bytes = message(libc::SO_RXQ_OVFL, &77u32.to_ne_bytes());
            bytes[..WORD_BYTES].copy_from_slice(&length.to_ne_bytes());
            bytes.truncate(cut);
            let _ = ControlData::parse(&bytes);
        }
    }
}
