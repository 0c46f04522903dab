//! Worst-case duration of a frame on the wire, ISO 11898-1.
//!
//! Stuff bits are counted for the worst possible payload: one after the first five equal bits and
//! one after every further four. The stuff bit itself begins the next run.

use didim_drivers::frame::FrameId;

/// Bits after the check sequence of a classic frame: its delimiter, the acknowledgement with its
/// delimiter, the end of the frame, and the interframe space.
const CLASSIC_TAIL: u32 = 1 + 2 + 7 + 3;

/// Bits after the check sequence of a CAN FD frame, without the delimiter of the check sequence.
const FD_TAIL: u32 = 2 + 7 + 3;

/// Number of bits of one frame, by bit rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct FrameBits {
    /// Bits at the bit rate of the arbitration.
    pub(super) nominal_bits: u32,
    /// Bits at the bit rate of the data phase; none in a classic frame.
    pub(super) data_bits: u32,
}

impl FrameBits {
    /// Returns the duration of the bits \[s\].
    pub(super) fn duration_s(self, bitrate_bps: f64, data_bitrate_bps: f64) -> f64 {
        f64::from(self.nominal_bits) / bitrate_bps + f64::from(self.data_bits) / data_bitrate_bps
    }
}

/// Counts the bits of a classic frame with this number of data bytes.
pub(super) fn classic_bits(id: FrameId, bytes: u8) -> FrameBits {
    // Start, identifier, RTR, IDE, r0, length, check sequence. An extended frame also has SRR, 18
    // more bits and r1.
    let fixed = match id {
        FrameId::Standard(_) => 1 + 11 + 1 + 1 + 1 + 4 + 15,
        FrameId::Extended(_) => 1 + 11 + 1 + 1 + 18 + 1 + 2 + 4 + 15,
    };
    let stuffed = fixed + 8 * u32::from(bytes);
    FrameBits { nominal_bits: stuffed + (stuffed - 1) / 4 + CLASSIC_TAIL, data_bits: 0 }
}

/// Counts the bits of a CAN FD frame with this number of data bytes and a separate bit rate of the
/// data phase.
///
/// The rate changes inside BRS and inside the delimiter of the check sequence. Both count as sent
/// at the lower rate.
pub(super) fn fd_bits(id: FrameId, bytes: u8) -> FrameBits {
    // Start, identifier, RRS, IDE, FDF, res, BRS. An extended frame also has SRR and 18 more bits.
    let arbitration: u32 = match id {
        FrameId::Standard(_) => 1 + 11 + 1 + 1 + 1 + 1 + 1,
        FrameId::Extended(_) => 1 + 11 + 1 + 1 + 18 + 1 + 1 + 1 + 1,
    };
    // ESI, length, data. A fixed stuff bit always follows.
    let data = 1 + 4 + 8 * u32::from(bytes);
    let stuff = (arbitration + data - 2) / 4;
    let early = (arbitration - 1) / 4;
    // Stuff count and check sequence, with a fixed stuff bit before them and after every four bits.
    let check: u32 = 4 + if bytes > 16 { 21 } else { 17 };
    let fixed_stuff = 1 + check / 4;
    FrameBits {
        nominal_bits: arbitration + early + 1 + FD_TAIL,
        data_bits: data + (stuff - early) + check + fixed_stuff,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STANDARD: FrameId = FrameId::Standard(0x181);
    const EXTENDED: FrameId = FrameId::Extended(0x181);

    /// Worst cases of the literature (Davis, Burns, Bril and Lukkien, *Controller Area Network
    /// schedulability analysis*, 2007): (55 + 10 n) and (80 + 10 n) bit times.
    #[test]
    fn classic_frames_are_as_long_as_the_literature_says() {
        for bytes in 0..=8u8 {
            assert_eq!(classic_bits(STANDARD, bytes).nominal_bits, 55 + 10 * u32::from(bytes));
            assert_eq!(classic_bits(EXTENDED, bytes).nominal_bits, 80 + 10 * u32::from(bytes));
        }
    }

    /// Counts by stuffing the worst sequence bit by bit: runs of equal bits that the stuff bit
    /// continues.
    #[test]
    fn stuffing_bit_by_bit_gives_the_same_count() {
        for length in [34u32, 98, 54, 118] {
            let (mut run, mut stuffed, mut sent) = (0, 0, 0);
            while sent < length {
                run += 1;
                sent += 1;
                if run == 5 {
                    stuffed += 1;
                    run = 1;
                }
            }
            assert_eq!(stuffed, (length - 1) / 4, "{length} bits");
        }
    }

    /// CRC 17 has six fixed stuff bits, CRC 21 seven; 64 bytes are 34 + 678 bits.
    #[test]
    fn fd_frames_have_their_check_sequence_and_fixed_stuff_bits() {
        assert_eq!(fd_bits(STANDARD, 64), FrameBits { nominal_bits: 34, data_bits: 678 });
        let (short, long) = (fd_bits(STANDARD, 16), fd_bits(STANDARD, 20));
        // Four bytes, their stuff bits, four bits of the check sequence and one fixed stuff bit.
        assert_eq!(long.data_bits - short.data_bits, 32 + 8 + 4 + 1);
        assert_eq!(fd_bits(EXTENDED, 8).nominal_bits, 36 + 8 + 1 + 12);
        let microseconds = 1e6 * fd_bits(STANDARD, 64).duration_s(1e6, 8e6);
        assert!((microseconds - 118.75).abs() < 1e-9, "{microseconds}");
    }
}
