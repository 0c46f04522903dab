//! Conversion of EtherCAT datagrams to the frames of a plan.
//!
//! The plan and the assembler read CAN frames, so each cyclic datagram is converted to such frames.
//! The first datagram of a cycle that returns from the slaves gives a SYNC. One frame of inputs and
//! one frame of outputs follow for each axis. The frame of inputs begins with a byte of [network
//! state](super::Quantity::NetworkState). So the same assembler, the same causes and the same
//! format of recordings serve CAN and EtherCAT.

use crate::frame::FrameId;

/// Identifiers of the SYNC, and of the input and output frames of the first axis; they are the
/// predefined identifiers of CANopen.
pub(super) const SYNC_ID: FrameId = FrameId::Standard(0x080);
/// The SYNC frame, which contains no data of a datagram.
pub(crate) const SYNC_FRAME: AssembledFrame =
    AssembledFrame { id: SYNC_ID, length: 0, byte_ranges: Vec::new() };
pub(super) const INPUTS_ID: u16 = 0x181;
pub(super) const OUTPUTS_ID: u16 = 0x201;

/// Bits of the AL status (ETG.1000, part 6) in the byte of network state, combined by OR over all
/// slaves. They hold the states and the error flag. They are 0 if the master did not read the
/// status.
pub(crate) const AL_STATUS_BITS: u8 = 0x1F;
/// AL states below SAFEOP: INIT, PREOP and BOOT.
pub(crate) const BELOW_SAFE_OPERATIONAL: u8 = 0x03;
pub(crate) const SAFE_OPERATIONAL: u8 = 0x04;
pub(crate) const OPERATIONAL: u8 = 0x08;
pub(crate) const AL_ERROR: u8 = 0x10;
/// Bit that is set if a working counter differs from the expected one.
pub(crate) const WRONG_COUNTER: u8 = 0x80;

/// Cyclic datagrams that a plan uses, in the order in which a cycle sends them. The first datagram
/// marks the instant of the sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProcessData {
    pub(crate) datagrams: Vec<ProcessDatagram>,
    /// True if the frame of the first datagram carries the time of the distributed clock.
    pub(crate) clock: bool,
}

/// One cyclic datagram of a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ProcessDatagram {
    pub(crate) command: u8,
    pub(crate) address: u32,
    /// Length of the data \[bytes\].
    pub(crate) length: usize,
    /// Value of the working counter if every slave takes part.
    pub(crate) expected_counter: u16,
    /// Frames made from the returned data, and frames made from the data that the master sent.
    /// Outputs are read from the sent data because a slave may overwrite them with its inputs.
    pub(crate) inputs: Vec<AssembledFrame>,
    pub(crate) outputs: Vec<AssembledFrame>,
}

/// A frame assembled from the data of a datagram.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct AssembledFrame {
    pub(crate) id: FrameId,
    /// Length \[bytes\], one of the lengths of CAN FD.
    pub(crate) length: u8,
    /// Copied ranges: first byte in the datagram, first byte in the frame, and number of bytes.
    pub(crate) byte_ranges: Vec<(usize, usize, usize)>,
}
