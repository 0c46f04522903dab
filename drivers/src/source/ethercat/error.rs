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
    /// The layout is of another kind of bus.
    #[error(
        "{}: this is EtherCAT, and the layout is not; name an `eni` file, or a `startup`, and \
         `slaves` under [bus.layout] of the cell",
        place
    )]
    NoPlan {
        /// The capture, or the interface.
        place: String,
    },
    /// There is no interface of this name: correct it.
    #[error("there is no interface {interface}: `ip link` lists those there are")]
    NoInterface {
        /// The interface.
        interface: InterfaceName,
    },
    /// The process may not open packet sockets.
    #[error(
        "no permission to listen to packets on {interface} ({source}): it takes CAP_NET_RAW and \
         the address family AF_PACKET; with systemd, the drop-in \
         /usr/share/didim/systemd/ethercat.conf has both"
    )]
    Permission {
        /// The interface.
        interface: InterfaceName,
        /// Error of the system.
        source: io::Error,
    },
    /// The system refused a call that should always succeed.
    #[error("cannot {what} on interface {interface}: {source}")]
    System {
        /// The interface.
        interface: InterfaceName,
        /// The attempted operation.
        what: &'static str,
        /// Error of the system.
        source: io::Error,
    },
    /// The interface is down. It is used again when it comes back.
    #[error("interface {interface} is down: `ip link set {interface} up`, or look at the tap")]
    Down {
        /// The interface.
        interface: InterfaceName,
    },
    /// The interface vanished. It is opened again when it is back.
    #[error("interface {interface} has disappeared: is the adapter plugged in?")]
    Gone {
        /// The interface.
        interface: InterfaceName,
    },
    /// The capture is complete and contains no data of the layout.
    #[error("{}: no cyclic process data in this capture: {seen}", path.display())]
    NoProcessData {
        /// The capture.
        path: PathBuf,
        /// Its properties.
        seen: TrafficSummary,
    },
}

impl EthercatError {
    /// Returns true if the source continues by itself.
    pub fn is_recoverable(&self) -> bool {
        matches!(self, Self::Down { .. } | Self::Gone { .. })
    }
}
