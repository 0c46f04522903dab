//! EtherCAT on the wire: the packets of a capture, and the datagrams in a packet.
//!
//! Captures may come from any source, so every length in them is checked before use.

mod capture;
mod datagram;

pub use capture::{Capture, CaptureError, Packet};
pub(crate) use datagram::{
    AL_STATUS, ARMW, BRD, Datagram, ETHERCAT_TYPE, EthercatFrame, FMMU_REGISTERS, FPRD, FPRW, FPWR,
    FRMW, LRD, LRW, LWR, MAILBOX_START, SYSTEM_TIME,
};
