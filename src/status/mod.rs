//! What the service tells about itself, and what it may be told: two Unix sockets.
//!
//! The library of the stream serves one user only; people and other users come in here. The status
//! socket is write-only: connect, read one JSON object, end. The control socket takes one line and
//! answers with one. Neither can be held up by a client: their number, time and length are bounded.

mod capture;
mod client;
mod collect;
mod control;
mod listen;
mod render;
mod serve;
mod snapshot;

pub use capture::{CaptureRequest, CaptureRequestError};
pub use client::{ClientError, fetch_status, send_capture, send_command};
pub use collect::Collector;
pub use control::{CommandLineError, parse_command, serve_commands};
pub use listen::{ListenError, Socket};
pub use render::{Colour, render};
pub use serve::serve_status;
pub use snapshot::{Health, SCHEMA, Snapshot, StreamStatus};
