//! Errors of a SocketCAN interface and their remedies.

use std::io;

use crate::source::{InterfaceName, MAX_INTERFACES};

/// Reason why an interface cannot be opened for receiving, or stopped delivering.
#[derive(Debug, thiserror::Error)]
pub enum SocketCanError {
    /// No interfaces or too many were requested.
    #[error("{count} interfaces asked for: name 1 to {MAX_INTERFACES}")]
    InterfaceCount {
        /// Number of interfaces.
        count: usize,
    },
    /// The same interface was requested twice.
    #[error("interface {interface} is named twice: name it once")]
    Twice {
        /// The interface.
        interface: InterfaceName,
    },
    /// There is no interface of this name: correct it, plug the adapter in, or create a virtual
    /// one.
    #[error(
        "there is no interface {interface}; CAN interfaces here: {existing}. To make a virtual \
         one: `ip link add {interface} type vcan && ip link set {interface} mtu 72 up`"
    )]
    NoInterface {
        /// The interface.
        interface: InterfaceName,
        /// Names of the existing CAN interfaces, or "none".
        existing: String,
    },
    /// The interface is something else, such as Ethernet.
    #[error("interface {interface} is not a CAN interface; CAN interfaces here: {existing}")]
    NotCan {
        /// The interface.
        interface: InterfaceName,
        /// Names of the existing CAN interfaces, or "none".
        existing: String,
    },
    /// The kernel has no CAN sockets.
    #[error(
        "this kernel has no CAN sockets ({source}): load them with `modprobe can-raw`, or use a \
         kernel with CONFIG_CAN_RAW; `didim demo` needs neither"
    )]
    NoKernelSupport {
        /// Error of the system.
        source: io::Error,
    },
    /// The process may not open CAN sockets.
    #[error(
        "no permission to open a CAN socket on {interface} ({source}): allow AF_CAN, with systemd \
         by `RestrictAddressFamilies=AF_CAN`, in a container by the host's network"
    )]
    Permission {
        /// The interface.
        interface: InterfaceName,
        /// Error of the system.
        source: io::Error,
    },
    /// The layout needs CAN FD and the interface carries classic frames only.
    #[error(
        "interface {interface} carries classic frames only (MTU {mtu}) and CAN FD was asked for: \
         `ip link set {interface} mtu 72` for a virtual one, `ip link set {interface} type can fd \
         on dbitrate …` for a controller that can"
    )]
    NotFdCapable {
        /// The interface.
        interface: InterfaceName,
        /// Largest frame \[bytes\].
        mtu: i32,
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
    /// Waiting for the sockets failed.
    #[error("cannot wait for frames: {source}")]
    Wait {
        /// Error of the system.
        source: io::Error,
    },
    /// The interface is down. It is used again when it comes back.
    #[error("interface {interface} is down: `ip link set {interface} up`, or look at its bus")]
    Down {
        /// The interface.
        interface: InterfaceName,
    },
    /// The interface vanished, for example because its adapter was unplugged. It is opened again
    /// when it is back.
    #[error("interface {interface} has disappeared: is the adapter plugged in?")]
    Gone {
        /// The interface.
        interface: InterfaceName,
    },
}

impl SocketCanError {
    /// Returns true if the source continues by itself: this holds for failures of an interface once
    /// opened.
    pub fn is_recoverable(&self) -> bool {
        matches!(self, Self::Down { .. } | Self::Gone { .. })
    }
}

/// Returns the CAN interfaces of this machine, for messages.
pub(super) fn existing_interfaces() -> String {
    /// ARPHRD_CAN of `linux/if_arp.h`.
    const ARPHRD_CAN: &str = "280";
    let devices = std::fs::read_dir("/sys/class/net").into_iter().flatten().flatten();
    let is_can = |device: &std::fs::DirEntry| {
        std::fs::read_to_string(device.path().join("type")).is_ok_and(|t| t.trim() == ARPHRD_CAN)
    };
    let mut names: Vec<String> =
        devices.filter(is_can).map(|d| d.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    if names.is_empty() { "none".into() } else { names.join(", ") }
}
