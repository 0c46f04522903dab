//! How EtherCAT datagrams become the frames of a plan.
//!
//! The plan and the assembler know frames of CAN. A cyclic datagram is handed to them as such: a SYNC
//! when the first datagram of a cycle returns, then one frame of inputs for each axis, led by a byte of
//! [network state](super::Quantity::NetworkState), and one of outputs. So one assembler, one set of causes and
//! one format of recordings serve both.

use crate::frame::FrameId;

/// The SYNC, and the frames of inputs and of outputs of the axes, from 0; the predefined identifiers of
/// CANopen.
pub(super) const SYNC_ID: FrameId = FrameId::Standard(0x080);
/// The SYNC: nothing of a datagram is in it.
pub(crate) const SYNC: Gathered = Gathered { id: SYNC_ID, length: 0, parts: Vec::new() };
pub(super) const INPUTS_ID: u16 = 0x181;
pub(super) const OUTPUTS_ID: u16 = 0x201;

/// In the byte of network state: the AL status (ETG.1000, part 6), of all slaves one over the other: the
/// states and whether there is an error; 0 where nobody asked for it.
pub(crate) const AL_STATUS_BITS: u8 = 0x1F;
/// INIT, PREOP and BOOT.
pub(crate) const BELOW_SAFE_OPERATIONAL: u8 = 0x03;
pub(crate) const SAFE_OPERATIONAL: u8 = 0x04;
pub(crate) const OPERATIONAL: u8 = 0x08;
pub(crate) const AL_ERROR: u8 = 0x10;
/// And whether a working counter is not the expected one.
pub(crate) const WRONG_COUNTER: u8 = 0x80;

/// The cyclic datagrams that a plan takes, in the order in which a cycle sends them. The first marks the
/// instant of the sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProcessData {
    pub(crate) datagrams: Vec<ProcessDatagram>,
    /// Whether the distributed clock's time comes with the first of them.
    pub(crate) clock: bool,
}

/// One of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ProcessDatagram {
    pub(crate) command: u8,
    pub(crate) address: u32,
    /// \[bytes\]
    pub(crate) length: usize,
    /// The working counter when every slave takes part.
    pub(crate) expected: u16,
    /// Frames made of what returned, and of what the master sent: a slave may have put its inputs over
    /// outputs in between.
    pub(crate) inputs: Vec<Gathered>,
    pub(crate) outputs: Vec<Gathered>,
}

/// A frame put together from a datagram's data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Gathered {
    pub(crate) id: FrameId,
    /// \[bytes\], as CAN FD has lengths.
    pub(crate) length: u8,
    /// First byte in the datagram, first byte in the frame, and how many.
    pub(crate) parts: Vec<(usize, usize, usize)>,
}
