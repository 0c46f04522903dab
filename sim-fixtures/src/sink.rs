//! Destinations of frames, and the only code that sends.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use didim_drivers::frame::{Frame, FrameError};
use didim_drivers::source::{BusClosed, CandumpWriter, InProcessSender, WriteError};
use socketcan::{CanAnyFrame, CanFdSocket, Socket, SocketOptions};

/// Maximum time for which a transmit queue may stay full before sending fails.
const TRANSMIT_TIMEOUT: Duration = Duration::from_millis(200);

/// Time between two attempts to send into a full transmit queue: about the time of a frame on the
/// bus.
const TRANSMIT_PAUSE: Duration = Duration::from_micros(100);

/// Destination of frames.
pub trait Sink {
    /// Sends one frame.
    ///
    /// # Errors
    /// [`SinkError`]; the frame was not sent.
    fn send(&mut self, frame: &Frame) -> Result<(), SinkError>;
}

/// Reason why a frame could not be sent.
#[derive(Debug, thiserror::Error)]
pub enum SinkError {
    /// The in-process bus has no receiver any more: stop.
    #[error(transparent)]
    Closed(#[from] BusClosed),
    /// The log could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The frame cannot exist in the format of the sink.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The interface cannot be opened. It must exist and be up. If the layout sends CAN FD frames,
    /// the interface must accept them: `ip link set NAME mtu 72 up` for a virtual one.
    #[error("cannot open the interface `{interface}`: {source}")]
    Open {
        /// Name of the interface.
        interface: String,
        /// Error of the system.
        source: io::Error,
    },
    /// The interface did not accept the frame: it is down, or its queue stays full because no node
    /// acknowledges.
    #[error("cannot send on the interface `{interface}`: {source}")]
    Send {
        /// Name of the interface.
        interface: String,
        /// Error of the system.
        source: io::Error,
    },
}

/// Sink for a bus inside this process.
#[derive(Clone, Debug)]
pub struct InProcessSink(InProcessSender);

impl InProcessSink {
    /// Creates a sink that sends through `sender`.
    pub fn new(sender: InProcessSender) -> Self {
        Self(sender)
    }
}

impl Sink for InProcessSink {
    fn send(&mut self, frame: &Frame) -> Result<(), SinkError> {
        Ok(self.0.send(*frame)?)
    }
}

/// Sink for a candump log.
#[derive(Debug)]
pub struct CandumpSink<W: Write>(CandumpWriter<W>);

impl<W: Write> CandumpSink<W> {
    /// Creates a sink that writes through `writer`.
    pub fn new(writer: CandumpWriter<W>) -> Self {
        Self(writer)
    }

    /// Flushes and returns the output.
    ///
    /// # Errors
    /// [`SinkError::Write`]: the log is not complete.
    pub fn finish(self) -> Result<W, SinkError> {
        Ok(self.0.finish()?)
    }
}

impl<W: Write> Sink for CandumpSink<W> {
    fn send(&mut self, frame: &Frame) -> Result<(), SinkError> {
        Ok(self.0.write(frame)?)
    }
}

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
