//! In place of the sink for a SocketCAN interface where there is no SocketCAN.

use std::io;

use didim_drivers::frame::Frame;

use crate::sink::{Sink, SinkError};

/// Sink for a SocketCAN interface. It cannot be opened.
#[derive(Debug)]
pub enum SocketCanSink {}

impl SocketCanSink {
    /// Returns an error: SocketCAN needs Linux.
    ///
    /// # Errors
    /// [`SinkError::Open`].
    pub fn open(interface: &str) -> Result<Self, SinkError> {
        let source = io::Error::new(io::ErrorKind::Unsupported, "SocketCAN needs Linux");
        Err(SinkError::Open { interface: interface.to_owned(), source })
    }
}

impl Sink for SocketCanSink {
    fn send(&mut self, _: &Frame) -> Result<(), SinkError> {
        match *self {}
    }
}
