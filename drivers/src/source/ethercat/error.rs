//! What can go wrong with EtherCAT, and what to do about it.

use std::io;
use std::path::PathBuf;

use super::Seen;
use crate::ethercat::CaptureError;
use crate::source::InterfaceName;

/// Why process data cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum EthercatError {
    /// The capture cannot be read.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The layout is of another kind of bus.
    #[error(
        "{}: this is EtherCAT, and the layout is not; name an `eni` file, or a `startup`, and `slaves` under \
         [bus.layout] of the cell",
        place
    )]
    NoPlan {
        /// The capture, or the interface.
        place: String,
    },
    /// No interface of this name: correct it.
    #[error("there is no interface {interface}: `ip link` lists those there are")]
    NoInterface {
        /// Which.
        interface: InterfaceName,
    },
    /// The process may not open packet sockets.
    #[error(
        "no permission to listen to packets on {interface} ({source}): it takes CAP_NET_RAW and the address \
         family AF_PACKET; with systemd, the drop-in /usr/share/didim/systemd/ethercat.conf has both"
    )]
    Permission {
        /// Which.
        interface: InterfaceName,
        /// What the system said.
        source: io::Error,
    },
    /// The system refused something that it never should.
    #[error("cannot {what} on interface {interface}: {source}")]
    System {
        /// Which.
        interface: InterfaceName,
        /// What was tried.
        what: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// The interface is down. It is taken up again when it comes back.
    #[error("interface {interface} is down: `ip link set {interface} up`, or look at the tap")]
    Down {
        /// Which.
        interface: InterfaceName,
    },
    /// The interface vanished. It is opened again when it is back.
    #[error("interface {interface} has disappeared: is the adapter plugged in?")]
    Gone {
        /// Which.
        interface: InterfaceName,
    },
    /// The capture is whole and has nothing of the layout.
    #[error("{}: no cyclic process data in this capture: {seen}", path.display())]
    NoProcessData {
        /// The capture.
        path: PathBuf,
        /// What it has.
        seen: Seen,
    },
}

impl EthercatError {
    /// Whether the source goes on by itself.
    pub fn is_recoverable(&self) -> bool {
        matches!(self, Self::Down { .. } | Self::Gone { .. })
    }
}
