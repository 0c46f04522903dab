//! Sink for a SocketCAN interface.

use std::io;
use std::time::{Duration, Instant};

use didim_drivers::frame::Frame;
use socketcan::{CanAnyFrame, CanFdSocket, Socket, SocketOptions};

use crate::sink::{Sink, SinkError};

/// Maximum time for which a transmit queue may stay full before sending fails.
const TRANSMIT_TIMEOUT: Duration = Duration::from_millis(200);

/// Time between two attempts to send into a full transmit queue: about the time of a frame on the
/// bus.
const TRANSMIT_PAUSE: Duration = Duration::from_micros(100);

/// Sink for a SocketCAN interface.
#[derive(Debug)]
pub struct SocketCanSink {
    socket: CanFdSocket,
    interface: String,
}

impl SocketCanSink {
    /// Opens an interface for sending only.
    ///
    /// # Errors
    /// [`SinkError::Open`].
    pub fn open(interface: &str) -> Result<Self, SinkError> {
        let open_socket = || {
            let socket = CanFdSocket::open(interface)?;
            // Receive nothing: received frames would only fill the buffer of this socket.
            socket.set_filter_drop_all()?;
            socket.set_nonblocking(true)?;
            Ok(socket)
        };
        let failed = |source| SinkError::Open { interface: interface.to_owned(), source };
        Ok(Self { socket: open_socket().map_err(failed)?, interface: interface.to_owned() })
    }
}

impl Sink for SocketCanSink {
    fn send(&mut self, frame: &Frame) -> Result<(), SinkError> {
        let frame = CanAnyFrame::try_from(frame)?;
        let deadline = Instant::now() + TRANSMIT_TIMEOUT;
        loop {
            match self.socket.write_frame(&frame) {
                Ok(()) => return Ok(()),
                Err(error) if is_full(&error) && Instant::now() < deadline => {
                    std::thread::sleep(TRANSMIT_PAUSE);
                }
                Err(source) => {
                    return Err(SinkError::Send { interface: self.interface.clone(), source });
                }
            }
        }
    }
}

/// Returns true if the socket's buffer (EAGAIN) or the interface's queue (ENOBUFS) is full.
fn is_full(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::WouldBlock || error.raw_os_error() == Some(libc::ENOBUFS)
}
