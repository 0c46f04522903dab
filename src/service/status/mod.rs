//! The status of the service, and its commands: two Unix sockets.
//!
//! The stream library serves the processes of one user only. People and other users connect to
//! these sockets. The status socket only sends: a client connects, reads one JSON object, and is
//! disconnected. The command socket reads one line and answers with one line. Clients cannot block
//! the sockets, because their number, their time and the length of their lines are limited.

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
pub use fetch::fetch_snapshot;
pub use listen::{ListenError, Socket, SocketKind};
pub use render::{Colour, render};
pub use request::{
    BaselineCommandError, BaselineRequest, CaptureRequest, MAX_REQUEST, Request, RequestError,
    parse_request,
};
pub(crate) use serve::accept;
pub use serve::serve_status;
pub use snapshot::{Health, IDLE_TEXT, ProcessStatus, SCHEMA, Snapshot, StreamStatus};
