//! The service put together: bus thread, worker and status under one roof, or in two processes.
//!
//! tokio runs what waits for people, signals and clocks; the bus and the worker have threads of
//! their own. What each may do when another fails is decided here: one that fails ends the service,
//! and a service manager starts it anew.

mod line;
mod manager;
mod readiness;
mod reload;
mod running;
mod sockets;
mod supervise;
mod threads;

use std::path::PathBuf;

use didim_drivers::assemble::Assembler;
use didim_drivers::source::Source;

use crate::live::acquire::{AcquireError, AcquireOptions, ReceiveBuffer};
use crate::live::recording::RecorderOptions;
use crate::live::stream::{StreamError, StreamOptions};
use crate::live::worker::{FindLoad, Identify, WorkerError, WorkerOptions};
use crate::service::status::{ListenError, Snapshot};

pub use reload::Reload;
pub use supervise::{run, run_with_reload};

/// A socket to listen at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SocketOptions {
    /// Its path; the folder must exist.
    pub path: PathBuf,
    /// Its permissions: whoever may write to it may connect.
    pub mode: u32,
    /// Its group; nothing leaves that of the service.
    pub group: Option<String>,
}

/// What the service is beside its parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ServiceOptions {
    /// Where to ask for the status; 0o660 lets the group ask.
    pub status: Option<SocketOptions>,
    /// Where to command windows; needs an estimation. 0o600 unless a group shall command.
    pub control: Option<SocketOptions>,
    /// Receive buffer that the kernel granted, for the status \[bytes\].
    pub receive_buffer: Option<ReceiveBuffer>,
}

/// What the bus thread is made of.
pub struct AcquisitionPart {
    /// Where frames come from.
    pub source: Box<dyn Source>,
    /// What makes samples of them.
    pub assembler: Assembler,
    /// The rest.
    pub options: AcquireOptions,
    /// Where its frames are recorded; nothing records none.
    pub recorder: Option<RecorderOptions>,
}

/// What the worker is made of.
pub struct EstimationPart {
    /// What identifies a window.
    pub identify: Identify,
    /// What finds the load along one; nothing looks for none.
    pub find_load: Option<FindLoad>,
    /// The rest.
    pub options: WorkerOptions,
}

/// Which parts this process runs. Two processes with the same stream make one service.
pub enum Parts {
    /// Both.
    Both(Box<AcquisitionPart>, EstimationPart),
    /// The bus only: samples for a worker in another process.
    Acquisition(Box<AcquisitionPart>),
    /// The worker only.
    Estimation(EstimationPart),
}

impl Parts {
    fn stream(&self) -> &StreamOptions {
        match self {
            Self::Both(part, _) | Self::Acquisition(part) => &part.options.stream,
            Self::Estimation(part) => &part.options.stream,
        }
    }

    fn split(self) -> (Option<Box<AcquisitionPart>>, Option<EstimationPart>) {
        match self {
            Self::Both(acquisition, estimation) => (Some(acquisition), Some(estimation)),
            Self::Acquisition(acquisition) => (Some(acquisition), None),
            Self::Estimation(estimation) => (None, Some(estimation)),
        }
    }
}

/// How the service ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServiceEnd {
    /// By SIGTERM or SIGINT, or by SIGHUP where there is nothing to read again.
    Signal,
    /// The log, or the simulated arm, is at its end, and every window is dealt with.
    SourceEnded,
}

/// The end, and the last status before it.
#[derive(Clone, Debug, PartialEq)]
pub struct ServiceReport {
    /// How it ended.
    pub end: ServiceEnd,
    /// The counts at the end.
    pub snapshot: Snapshot,
}

/// Why the service could not start, or ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The bus thread failed.
    #[error("acquisition: {0}")]
    Acquisition(#[from] AcquireError),
    /// The worker failed.
    #[error("estimation: {0}")]
    Estimation(#[from] WorkerError),
    /// The status cannot be published.
    #[error("status: {0}")]
    Stream(#[from] StreamError),
    /// A socket cannot be made.
    #[error(transparent)]
    Listen(#[from] ListenError),
    /// The system gives no runtime, thread or signal handler.
    #[error("cannot {action}: {cause}")]
    System {
        /// What was tried.
        action: &'static str,
        /// The system's error.
        cause: std::io::Error,
    },
    /// A thread panicked; its message is in the log. Report it.
    #[error("the {thread} thread panicked: see the log above")]
    Panicked {
        /// Which.
        thread: &'static str,
    },
    /// A control socket without an estimation to control.
    #[error("a control socket needs an estimation in the same process")]
    NothingToControl,
}
