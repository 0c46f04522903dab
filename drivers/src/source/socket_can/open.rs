//! Opening of one interface. Every option is set before the socket is bound, because frames can
//! arrive from then on.

use std::io;

use super::error::{SocketCanError, existing_interfaces};
use super::options::SocketCanOptions;
use crate::frame::FrameId;
use crate::socket::{DeviceState, Socket, device_state};
use crate::source::InterfaceName;
use crate::source::listening::{ask_for_stamps_and_drops, set_receive_buffer};

/// Opened socket of an interface, as returned by [`open`].
#[derive(Debug)]
pub(super) struct OpenedSocket {
    pub(super) socket: Socket,
    pub(super) device: DeviceState,
    pub(super) receive_buffer_bytes: u32,
}

impl OpenedSocket {
    /// Returns the size of the largest frame and of the receive buffer \[bytes\].
    pub(super) fn granted(&self) -> (i32, u32) {
        (self.device.mtu, self.receive_buffer_bytes)
    }
}

/// Creates a socket that receives from the interface.
pub(super) fn open(
    interface: InterfaceName,
    options: &SocketCanOptions,
) -> Result<OpenedSocket, SocketCanError> {
    let failed = |what| move |source: io::Error| system_error(interface, what, source);
    let socket = Socket::new_can().map_err(failed("open a CAN socket"))?;
    let device = device_state(&socket, interface).map_err(failed("find the device"))?;
    // A device that is not CAN can have any MTU; `bind` detects such a device.
    if options.accepts_fd && usize::try_from(device.mtu).is_ok_and(|mtu| mtu == libc::CAN_MTU) {
        return Err(SocketCanError::NotFdCapable { interface, mtu: device.mtu });
    }
    set_options(&socket, options).map_err(failed("set the socket's options"))?;
    let receive_buffer_bytes = set_receive_buffer(&socket, options.receive_buffer_bytes)
        .map_err(failed("set the receive buffer"))?;
    socket.bind_can(device.index).map_err(|source| match source.raw_os_error() {
        // The device exists, so the kernel reports this error because the device is not CAN.
        Some(libc::ENODEV) if device_state(&socket, interface).is_ok() => {
            SocketCanError::NotCan { interface, existing: existing_interfaces() }
        }
        _ => system_error(interface, "bind", source),
    })?;
    Ok(OpenedSocket { socket, device, receive_buffer_bytes })
}

fn set_options(socket: &Socket, options: &SocketCanOptions) -> io::Result<()> {
    socket.set(libc::SOL_CAN_RAW, libc::CAN_RAW_FD_FRAMES, u32::from(options.accepts_fd))?;
    socket.set(libc::SOL_CAN_RAW, libc::CAN_RAW_ERR_FILTER, libc::CAN_ERR_MASK)?;
    ask_for_stamps_and_drops(socket)?;
    let Some(ids) = &options.ids else { return Ok(()) };
    let most = usize::try_from(libc::CAN_RAW_FILTER_MAX).unwrap_or(0);
    if ids.len() > most {
        return Ok(());
    }
    let filters: Vec<libc::can_filter> = ids.iter().map(data_frames_of).collect();
    socket.set_filters(&filters)
}

/// Returns a filter that passes only data frames with this identifier and this format.
fn data_frames_of(id: &FrameId) -> libc::can_filter {
    let (can_id, mask) = match *id {
        FrameId::Standard(id) => (u32::from(id), libc::CAN_SFF_MASK),
        FrameId::Extended(id) => (id | libc::CAN_EFF_FLAG, libc::CAN_EFF_MASK),
    };
    libc::can_filter { can_id, can_mask: mask | libc::CAN_EFF_FLAG | libc::CAN_RTR_FLAG }
}

fn system_error(interface: InterfaceName, what: &'static str, source: io::Error) -> SocketCanError {
    match source.raw_os_error() {
        Some(libc::ENODEV) => {
            SocketCanError::NoInterface { interface, existing: existing_interfaces() }
        }
        Some(libc::EAFNOSUPPORT | libc::EPROTONOSUPPORT | libc::ESOCKTNOSUPPORT) => {
            SocketCanError::NoKernelSupport { source }
        }
        Some(libc::EPERM | libc::EACCES) => SocketCanError::Permission { interface, source },
        _ => SocketCanError::System { interface, what, source },
    }
}
