//! Raw sockets of CAN and of Ethernet, and the state of a network device.

#![allow(unsafe_code, reason = "socket, bind, setsockopt, getsockopt, shutdown, ioctl")]

use core::mem::size_of;
use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};

use crate::frame::interface::InterfaceName;

#[allow(clippy::cast_possible_truncation, reason = "C declares AF_CAN (29) wider than its field")]
const CAN_FAMILY: libc::sa_family_t = libc::AF_CAN as libc::sa_family_t;

#[allow(
    clippy::cast_possible_truncation,
    reason = "C declares AF_PACKET (17) wider than its field"
)]
const PACKET_FAMILY: libc::sa_family_t = libc::AF_PACKET as libc::sa_family_t;

/// Socket options of `linux/if_packet.h`. The first one ignores frames that the host sends; the
/// other ones receive every frame regardless of its destination.
const PACKET_IGNORE_OUTGOING: libc::c_int = 23;
const PACKET_ADD_MEMBERSHIP: libc::c_int = 1;
const PACKET_MR_PROMISC: u16 = 1;

/// A raw socket. The type has no function for sending. If the kernel supports it, the write side is
/// shut down.
#[derive(Debug)]
pub(crate) struct Socket(OwnedFd);

impl Socket {
    /// Creates an unbound CAN socket. It receives nothing before [`Self::bind_can`].
    pub(crate) fn new_can() -> io::Result<Self> {
        Self::new(libc::PF_CAN, libc::CAN_RAW)
    }

    /// Creates an unbound Ethernet socket (packet(7)). It receives nothing before
    /// [`Self::bind_packets`]. The call requires CAP_NET_RAW.
    pub(crate) fn new_packet() -> io::Result<Self> {
        Self::new(libc::PF_PACKET, 0)
    }

    fn new(family: libc::c_int, protocol: libc::c_int) -> io::Result<Self> {
        let flags = libc::SOCK_RAW | libc::SOCK_CLOEXEC | libc::SOCK_NONBLOCK;
        // SAFETY: takes no pointers.
        let descriptor = check_result(unsafe { libc::socket(family, flags, protocol) })?;
        // SAFETY: the kernel has just created this descriptor, and nothing else uses it.
        Ok(Self(unsafe { OwnedFd::from_raw_fd(descriptor) }))
    }

    /// Binds the socket to the device with this index and starts to receive. The socket receives
    /// the frames of one protocol (an EtherType) that other hosts send, regardless of their
    /// destination.
    pub(crate) fn bind_packets(&self, device: libc::c_int, protocol: u16) -> io::Result<()> {
        self.set(libc::SOL_PACKET, PACKET_IGNORE_OUTGOING, 1)?;
        let [low, high] = PACKET_MR_PROMISC.to_ne_bytes();
        // These are the fields of `struct packet_mreq`: the device, the kind with the length of the
        // address, and no address.
        let everything = [device.cast_unsigned(), u32::from_ne_bytes([low, high, 0, 0]), 0, 0];
        self.set_all(libc::SOL_PACKET, PACKET_ADD_MEMBERSHIP, &everything)?;
        // SAFETY: sockaddr_ll is plain integers; all zeros is a valid value.
        let mut address: libc::sockaddr_ll = unsafe { core::mem::zeroed() };
        address.sll_family = PACKET_FAMILY;
        address.sll_protocol = protocol.to_be();
        address.sll_ifindex = device;
        let length = socklen::<libc::sockaddr_ll>();
        // SAFETY: the address lives through the call and its length is that of its type.
        check_result(unsafe {
            libc::bind(self.raw_descriptor(), (&raw const address).cast(), length)
        })
        .map(drop)
    }

    /// Binds the socket to the device with this index and starts to receive.
    pub(crate) fn bind_can(&self, device: libc::c_int) -> io::Result<()> {
        // SAFETY: sockaddr_can is plain integers; all zeros is a valid value.
        let mut address: libc::sockaddr_can = unsafe { core::mem::zeroed() };
        address.can_family = CAN_FAMILY;
        address.can_ifindex = device;
        let length = socklen::<libc::sockaddr_can>();
        // SAFETY: the address lives through the call and its length is that of its type.
        let result =
            unsafe { libc::bind(self.raw_descriptor(), (&raw const address).cast(), length) };
        check_result(result)?;
        // Most kernels cannot shut down a CAN socket. The type has no function for sending in any
        // case. SAFETY: takes no pointers.
        unsafe { libc::shutdown(self.raw_descriptor(), libc::SHUT_WR) };
        Ok(())
    }

    /// Sets an integer option of the socket.
    pub(crate) fn set(&self, level: libc::c_int, name: libc::c_int, value: u32) -> io::Result<()> {
        self.set_all(level, name, &[value])
    }

    /// Sets filters. The socket then accepts only frames that pass at least one of them.
    pub(crate) fn set_filters(&self, filters: &[libc::can_filter]) -> io::Result<()> {
        self.set_all(libc::SOL_CAN_RAW, libc::CAN_RAW_FILTER, filters)
    }

    fn set_all<T: Copy>(
        &self,
        level: libc::c_int,
        name: libc::c_int,
        values: &[T],
    ) -> io::Result<()> {
        let length = libc::socklen_t::try_from(size_of_val(values))
            .map_err(|_| io::Error::from(io::ErrorKind::InvalidInput))?;
        // SAFETY: the slice lives through the call and `length` is its size in bytes; the kernel
        // only reads it. T is u32 or can_filter, which have no padding.
        check_result(unsafe {
            libc::setsockopt(self.raw_descriptor(), level, name, values.as_ptr().cast(), length)
        })
        .map(drop)
    }

    /// Returns an integer option of the socket.
    pub(crate) fn get(&self, level: libc::c_int, name: libc::c_int) -> io::Result<libc::c_int> {
        let mut value: libc::c_int = 0;
        let mut length = socklen::<libc::c_int>();
        // SAFETY: value and length live through the call, and length is the size of value.
        check_result(unsafe {
            libc::getsockopt(
                self.raw_descriptor(),
                level,
                name,
                (&raw mut value).cast(),
                &raw mut length,
            )
        })?;
        Ok(value)
    }

    /// Sends a packet in tests of the receiving side.
    #[cfg(test)]
    pub(crate) fn send(&self, packet: &[u8]) -> io::Result<()> {
        // SAFETY: the slice lives through the call, and the kernel only reads it.
        let sent =
            unsafe { libc::send(self.raw_descriptor(), packet.as_ptr().cast(), packet.len(), 0) };
        if sent < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
    }

    pub(super) fn raw_descriptor(&self) -> libc::c_int {
        self.0.as_raw_fd()
    }
}

/// Current state of a network device in the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DeviceState {
    /// Index of the device. A device that is created again under the same name has another index.
    pub(crate) index: libc::c_int,
    /// True if the device is up.
    pub(crate) is_up: bool,
    /// Size of the largest frame \[bytes\]: 16 for classic CAN, 72 for CAN FD, more for CAN XL.
    pub(crate) mtu: libc::c_int,
}

/// Returns the state of the device with this name, read through a socket. The error is ENODEV if
/// the device does not exist. Nothing is allocated.
pub(crate) fn device_state(socket: &Socket, name: InterfaceName) -> io::Result<DeviceState> {
    // SAFETY: ifreq is integers and byte arrays; all zeros is a valid value.
    let mut request: libc::ifreq = unsafe { core::mem::zeroed() };
    // A name has at most 15 bytes, so the sixteenth byte stays zero.
    for (place, byte) in request.ifr_name.iter_mut().zip(name.as_str().bytes()) {
        *place = libc::c_char::from_ne_bytes([byte]);
    }
    let mut ask = |what: libc::c_ulong| {
        // SAFETY: these requests read the name, which ends in zero, and write into the union of
        // the ifreq, which lives through the call. (The request number is c_int with some libcs.)
        check_result(unsafe { libc::ioctl(socket.raw_descriptor(), what as _, &raw mut request) })?;
        Ok::<_, io::Error>(request.ifr_ifru)
    };
    // SAFETY: SIOCGIFINDEX succeeded and wrote the index; any bits are a valid integer.
    let index = unsafe { ask(libc::SIOCGIFINDEX as libc::c_ulong)?.ifru_ifindex };
    // SAFETY: SIOCGIFFLAGS succeeded and wrote the flags.
    let flags = unsafe { ask(libc::SIOCGIFFLAGS as libc::c_ulong)?.ifru_flags };
    // SAFETY: SIOCGIFMTU succeeded and wrote the MTU.
    let mtu = unsafe { ask(libc::SIOCGIFMTU as libc::c_ulong)?.ifru_mtu };
    Ok(DeviceState { index, is_up: libc::c_int::from(flags) & libc::IFF_UP != 0, mtu })
}

fn check_result(result: libc::c_int) -> io::Result<libc::c_int> {
    if result < 0 { Err(io::Error::last_os_error()) } else { Ok(result) }
}

#[allow(clippy::cast_possible_truncation, reason = "the sizes of two small C structures")]
const fn socklen<T>() -> libc::socklen_t {
    size_of::<T>() as libc::socklen_t
}
