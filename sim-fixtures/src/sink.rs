//! Destinations of frames, and the only code that sends.

use std::io::{self, Write};

use didim_drivers::frame::{Frame, FrameError};
use didim_drivers::source::{BusClosed, CandumpWriter, InProcessSender, WriteError};

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
