//! Where frames go. The only sending half there is.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use didim_drivers::frame::{Frame, FrameError};
use didim_drivers::source::{BusClosed, CandumpWriter, InProcessSender, WriteError};
use socketcan::{CanAnyFrame, CanFdSocket, Socket, SocketOptions};

/// How long a full transmit queue may stay full before it is an error.
const TRANSMIT_TIMEOUT: Duration = Duration::from_millis(200);

/// How long to wait for room in a transmit queue: about a frame's time on the bus.
const TRANSMIT_PAUSE: Duration = Duration::from_micros(100);

/// Takes frames.
pub trait Sink {
    /// Sends one frame.
    ///
    /// # Errors
    /// [`SinkError`]; the frame was not sent.
    fn send(&mut self, frame: &Frame) -> Result<(), SinkError>;
}

/// Why a frame could not be sent.
#[derive(Debug, thiserror::Error)]
pub enum SinkError {
    /// Nobody listens to the in-process bus any more: stop.
    #[error(transparent)]
    Closed(#[from] BusClosed),
    /// The log could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The frame does not exist in this format.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The interface cannot be opened. It must exist, be up, and take CAN FD frames where the
    /// layout sends them: `ip link set NAME mtu 72 up` for a virtual one.
    #[error("cannot open the interface `{interface}`: {source}")]
    Open {
        /// The interface.
        interface: String,
        /// What the system says.
        source: io::Error,
    },
    /// The interface took the frame not: it is down, or nothing acknowledges and its queue stays
    /// full.
    #[error("cannot send on the interface `{interface}`: {source}")]
    Send {
        /// The interface.
        interface: String,
        /// What the system says.
        source: io::Error,
    },
}

/// Sends into a bus inside this process.
#[derive(Clone, Debug)]
pub struct InProcessSink(InProcessSender);

impl InProcessSink {
    /// Sends through `sender`.
    pub fn new(sender: InProcessSender) -> Self {
        Self(sender)
    }
}

impl Sink for InProcessSink {
    fn send(&mut self, frame: &Frame) -> Result<(), SinkError> {
        Ok(self.0.send(*frame)?)
    }
}

/// Writes a candump log.
#[derive(Debug)]
pub struct CandumpSink<W: Write>(CandumpWriter<W>);

impl<W: Write> CandumpSink<W> {
    /// Writes through `writer`.
    pub fn new(writer: CandumpWriter<W>) -> Self {
        Self(writer)
    }

    /// Flushes and gives the output back.
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

/// Sends on a SocketCAN interface.
#[derive(Debug)]
pub struct SocketCanSink {
    socket: CanFdSocket,
    interface: String,
}

impl SocketCanSink {
    /// Opens an interface for sending alone.
    ///
    /// # Errors
    /// [`SinkError::Open`].
    pub fn open(interface: &str) -> Result<Self, SinkError> {
        let open = || {
            let socket = CanFdSocket::open(interface)?;
            // What others send would only fill this socket's buffer.
            socket.set_filter_drop_all()?;
            socket.set_nonblocking(true)?;
            Ok(socket)
        };
        let failed = |source| SinkError::Open { interface: interface.to_owned(), source };
        Ok(Self { socket: open().map_err(failed)?, interface: interface.to_owned() })
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

/// The socket's buffer (EAGAIN) or the interface's queue (ENOBUFS) is full.
fn is_full(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::WouldBlock || error.raw_os_error() == Some(libc::ENOBUFS)
}
