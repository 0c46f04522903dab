//! Conversion of EtherCAT datagrams to the frames of a plan.
//!
//! The plan and the assembler read CAN frames, so a cyclic datagram is converted to such frames.
//! The first datagram of a cycle that returns gives a SYNC. Then follow one frame of inputs for
//! each axis, led by a byte of [network state](super::Quantity::NetworkState), and one of outputs.
//! So one assembler, one set of causes and one format of recordings serve both.

use crate::frame::FrameId;

/// Identifiers of the SYNC, and of the frames of inputs and of outputs of the axes, from 0; the
/// predefined ones of CANopen.
pub(super) const SYNC_ID: FrameId = FrameId::Standard(0x080);
/// The SYNC frame: it contains no data of a datagram.
pub(crate) const SYNC_FRAME: AssembledFrame =
    AssembledFrame { id: SYNC_ID, length: 0, byte_ranges: Vec::new() };
pub(super) const INPUTS_ID: u16 = 0x181;
pub(super) const OUTPUTS_ID: u16 = 0x201;

/// Bits of the AL status (ETG.1000, part 6) in the byte of network state, combined by OR over all
/// slaves. They hold the states and the error flag; 0 if the master did not read them.
pub(crate) const AL_STATUS_BITS: u8 = 0x1F;
/// INIT, PREOP and BOOT.
pub(crate) const BELOW_SAFE_OPERATIONAL: u8 = 0x03;
pub(crate) const SAFE_OPERATIONAL: u8 = 0x04;
pub(crate) const OPERATIONAL: u8 = 0x08;
pub(crate) const AL_ERROR: u8 = 0x10;
/// Bit that is set if a working counter differs from the expected one.
pub(crate) const WRONG_COUNTER: u8 = 0x80;

/// Cyclic datagrams that a plan uses, in the order in which a cycle sends them. The first marks the
/// instant of the sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProcessData {
    pub(crate) datagrams: Vec<ProcessDatagram>,
    /// True if the first datagram's frame carries the time of the distributed clock.
    pub(crate) clock: bool,
}

/// One of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ProcessDatagram {
    pub(crate) command: u8,
    pub(crate) address: u32,
    /// \[bytes\]
    pub(crate) length: usize,
    /// Working counter if every slave takes part.
    pub(crate) expected_counter: u16,
    /// Frames made from the returned data, and frames made from the data that the master sent. A
    /// slave may have overwritten outputs with its inputs in between.
    pub(crate) inputs: Vec<AssembledFrame>,
    pub(crate) outputs: Vec<AssembledFrame>,
}

/// A frame assembled from the data of a datagram.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct AssembledFrame {
    pub(crate) id: FrameId,
    /// Length \[bytes\], one of the lengths of CAN FD.
    pub(crate) length: u8,
    /// First byte in the datagram, first byte in the frame, and number of bytes.
    pub(crate) byte_ranges: Vec<(usize, usize, usize)>,
}
