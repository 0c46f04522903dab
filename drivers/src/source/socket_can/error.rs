//! Errors of a SocketCAN interface and their remedies.

use std::io;

use crate::source::{InterfaceName, MAX_INTERFACES};

/// Reason why an interface cannot be opened, or why it delivers no frames any more.
#[derive(Debug, thiserror::Error)]
pub enum SocketCanError {
    /// No interface was requested, or too many.
    #[error("{count} interfaces asked for: name 1 to {MAX_INTERFACES}")]
    InterfaceCount {
        /// Number of requested interfaces.
        count: usize,
    },
    /// The same interface was requested twice.
    #[error("interface {interface} is named twice: name it once")]
    Twice {
        /// Name of the interface.
        interface: InterfaceName,
    },
    /// There is no interface of this name. Correct the name, connect the adapter, or create a
    /// virtual interface.
    #[error(
        "there is no interface {interface}; CAN interfaces here: {existing}. To make a virtual \
         one: `ip link add {interface} type vcan && ip link set {interface} mtu 72 up`"
    )]
    NoInterface {
        /// Name of the interface.
        interface: InterfaceName,
        /// Names of the existing CAN interfaces, or "none".
        existing: String,
    },
    /// The interface exists but is not a CAN interface; for example, it is an Ethernet interface.
    #[error("interface {interface} is not a CAN interface; CAN interfaces here: {existing}")]
    NotCan {
        /// Name of the interface.
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
    /// The process has no permission to open CAN sockets.
    #[error(
        "no permission to open a CAN socket on {interface} ({source}): allow AF_CAN, with systemd \
         by `RestrictAddressFamilies=AF_CAN`, in a container by the host's network"
    )]
    Permission {
        /// Name of the interface.
        interface: InterfaceName,
        /// Error of the system.
        source: io::Error,
    },
    /// The layout needs CAN FD, but the interface carries only classic frames.
    #[error(
        "interface {interface} carries classic frames only (MTU {mtu}) and CAN FD was asked for: \
         `ip link set {interface} mtu 72` for a virtual one, `ip link set {interface} type can fd \
         on dbitrate …` for a controller that can"
    )]
    NotFdCapable {
        /// Name of the interface.
        interface: InterfaceName,
        /// Size of the interface's largest frame \[bytes\].
        mtu: i32,
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
    /// Waiting for the sockets failed.
    #[error("cannot wait for frames: {source}")]
    Wait {
        /// Error of the system.
        source: io::Error,
    },
    /// The interface is down. It is used again when it comes back.
    #[error("interface {interface} is down: `ip link set {interface} up`, or look at its bus")]
    Down {
        /// Name of the interface.
        interface: InterfaceName,
    },
    /// The interface vanished, for example because its adapter was unplugged. It is opened again
    /// when it is back.
    #[error("interface {interface} has disappeared: is the adapter plugged in?")]
    Gone {
        /// Name of the interface.
        interface: InterfaceName,
    },
}

impl SocketCanError {
    /// Returns true if a source that waits for its interfaces continues without a further action.
    pub fn is_recoverable(&self) -> bool {
        matches!(self, Self::Down { .. } | Self::Gone { .. } | Self::NoInterface { .. })
    }
}

/// Returns the names of the CAN interfaces of this machine, for error messages.
pub(super) fn existing_interfaces() -> String {
    /// Type of a CAN device: ARPHRD_CAN of `linux/if_arp.h`.
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
