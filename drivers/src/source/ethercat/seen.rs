//! Counts of a capture's contents. They explain why the required data are missing.

use core::fmt;

use crate::ethercat::{Datagram, EthercatFrame, FPRD, FPRW, FPWR, MAILBOX_START};

/// Numbers of the packets, frames and datagrams that were received.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrafficSummary {
    /// Number of packets of any kind.
    pub packets: u64,
    /// Number of packets of which the recorder kept only the first bytes.
    pub cut_packets: u64,
    /// Number of packets of another link type than Ethernet, and of packets without a stamp.
    pub other_packets: u64,
    /// Number of complete EtherCAT frames.
    pub frames: u64,
    /// Number of EtherCAT frames that returned from the slaves.
    pub returned_frames: u64,
    /// Number of returned datagrams with process data (LRD, LWR, LRW).
    pub process_datagrams: u64,
    /// Number of returned datagrams with process data that the layout uses.
    pub used_datagrams: u64,
    /// Number of returned datagrams to and from mailboxes.
    pub mailbox_datagrams: u64,
}

impl TrafficSummary {
    pub(super) fn count_frame(&mut self, frame: &EthercatFrame<'_>) {
        self.frames += 1;
        self.returned_frames += u64::from(frame.is_returning);
    }

    pub(super) fn count_returned(&mut self, datagram: &Datagram<'_>) {
        self.process_datagrams += u64::from(datagram.is_logical());
        let is_mailbox =
            matches!(datagram.command, FPRD | FPWR | FPRW) && datagram.register() >= MAILBOX_START;
        self.mailbox_datagrams += u64::from(is_mailbox);
    }
}

/// Writes which data are missing, and the remedy.
impl fmt::Display for TrafficSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            packets,
            cut_packets: cut,
            other_packets: other,
            frames,
            returned_frames: returning,
            process_datagrams: logical,
            mailbox_datagrams: mailbox,
            ..
        } = self;
        if *cut > 0 {
            write!(
                f,
                "the recorder kept only the first bytes of {cut} of {packets} packets; record \
                 whole packets (`tcpdump -s 0`)"
            )
        } else if *packets == 0 && *other > 0 {
            write!(
                f,
                "none of {other} packets is of Ethernet, or of Linux's interface `any`; record \
                 with `tcpdump -i PORT -w FILE` at the master's port"
            )
        } else if *frames == 0 {
            write!(
                f,
                "none of {packets} packets is a frame of EtherCAT (0x88A4); record at the master's \
                 port, with a tap between master and first slave"
            )
        } else if *returning == 0 {
            write!(
                f,
                "{frames} frames, and none has come back from the slaves; record both directions: \
                 both outputs of the tap, or one that brings them together"
            )
        } else if *logical == 0 {
            write!(
                f,
                "{returning} frames came back, with {mailbox} datagrams of mailboxes and none of \
                 process data (LRD, LWR, LRW); record while the drives are in OP"
            )
        } else {
            write!(
                f,
                "{logical} datagrams of process data came back, and none has command, address and \
                 length of those that the layout takes; take the ENI file, or the start-up, of \
                 this configuration"
            )
        }
    }
}
