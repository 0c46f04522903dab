//! EtherCAT errors and their remedies.

use std::io;
use std::path::PathBuf;

use super::TrafficSummary;
use crate::ethercat::CaptureError;
use crate::source::InterfaceName;

/// Reason why process data cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum EthercatError {
    /// The capture cannot be read.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The layout is not for EtherCAT.
    #[error(
        "{}: this is EtherCAT, and the layout is not; name an `eni` file, or a `startup`, and \
         `slaves` under [bus.layout] of the cell",
        place
    )]
    NoPlan {
        /// Path of the capture, or name of the interface.
        place: String,
    },
    /// There is no interface of this name. Correct the name.
    #[error("there is no interface {interface}: `ip link` lists those there are")]
    NoInterface {
        /// Name of the interface.
        interface: InterfaceName,
    },
    /// The process has no permission to open packet sockets.
    #[error(
        "no permission to listen to packets on {interface} ({source}): it takes CAP_NET_RAW and \
         the address family AF_PACKET; with systemd, the drop-in \
         /usr/share/didim/systemd/ethercat.conf has both"
    )]
    Permission {
        /// Name of the interface.
        interface: InterfaceName,
        /// Error of the system.
        source: io::Error,
    },
    /// The system refused a call that should always succeed.
    #[error("cannot {what} on interface {interface}: {source}")]
    System {
        /// Name of the interface.
        interface: InterfaceName,
        /// Operation that failed.
        what: &'static str,
        /// Error of the system.
        source: io::Error,
    },
    /// The interface is down. It is used again when it comes back.
    #[error("interface {interface} is down: `ip link set {interface} up`, or look at the tap")]
    Down {
        /// Name of the interface.
        interface: InterfaceName,
    },
    /// The interface vanished. It is opened again when it is back.
    #[error("interface {interface} has disappeared: is the adapter plugged in?")]
    Gone {
        /// Name of the interface.
        interface: InterfaceName,
    },
    /// The capture was read to its end and contains no process data of the layout.
    #[error("{}: no cyclic process data in this capture: {seen}", path.display())]
    NoProcessData {
        /// Path of the capture.
        path: PathBuf,
        /// Contents of the capture.
        seen: TrafficSummary,
    },
}

impl EthercatError {
    /// Returns true if a tap that waits for its interface continues without a further action.
    pub fn is_recoverable(&self) -> bool {
        matches!(self, Self::Down { .. } | Self::Gone { .. } | Self::NoInterface { .. })
    }
}
