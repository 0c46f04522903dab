//! What the service tells about itself, and what it may be told: two Unix sockets.
//!
//! The library of the stream serves one user only; people and other users come in here. The status
//! socket is write-only: connect, read one JSON object, end. The command socket takes one line and
//! answers with one. Neither can be held up by a client: their number, time and length are bounded.

mod client;
mod collect;
mod control;
mod dispatch;
mod fetch;
mod listen;
pub mod render;
mod request;
mod serve;
mod snapshot;

pub use client::{ClientError, fetch_status, send_request};
pub use collect::Collector;
pub(crate) use control::one_line;
pub use control::serve_commands;
pub use dispatch::{DispatchError, Dispatcher, ReloadAnswer, ReloadSender};
pub use fetch::fetch;
pub use listen::{ListenError, Socket};
pub use render::{Colour, render};
pub use request::{
    BaselineCommandError, BaselineRequest, CaptureRequest, MAX_REQUEST, Request, RequestError,
    parse_request,
};
pub use serve::serve_status;
pub use snapshot::{Health, IDLE, ProcessStatus, SCHEMA, Snapshot, StreamStatus};
