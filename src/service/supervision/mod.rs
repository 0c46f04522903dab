//! The complete service: bus thread, worker and status, in one process or in two.
//!
//! tokio runs the tasks that wait for people, signals and clocks. The bus and the worker have their
//! own threads. This module defines the reaction to a failure: if a part fails, the service ends,
//! and the service manager restarts it.

mod changes;
mod external_torque;
mod journal;
mod line;
mod manager;
mod readiness;
mod reload;
mod running;
mod sockets;
mod spawn;
mod supervise;
mod threads;

use std::path::PathBuf;

use didim_drivers::assemble::Assembler;
use didim_drivers::source::Source;

use crate::live::acquire::{AcquireError, AcquireOptions, ReceiveBuffer};
use crate::live::external_torque::{ClientSender, Clients, ModelSource, clients};
use crate::live::recording::RecorderOptions;
use crate::live::stream::{StreamError, StreamOptions};
use crate::live::worker::{FindLoad, Identify, WorkerError, WorkerOptions};
use crate::service::status::{ListenError, Snapshot, Socket, SocketKind};

pub use reload::Reload;
pub use supervise::{run, run_with_reload};

/// Options of a socket.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SocketOptions {
    /// Path of the socket. The folder must exist.
    pub path: PathBuf,
    /// Kind of the socket.
    pub kind: SocketKind,
    /// Permissions of the socket. A client needs write access.
    pub mode: u32,
    /// Group of the socket. If `None`, it is the group of the service.
    pub group: Option<String>,
}

impl SocketOptions {
    /// Creates the options of a stream socket with the service's group.
    pub fn new(path: PathBuf, mode: u32) -> Self {
        Self { path, kind: SocketKind::Stream, mode, group: None }
    }

    /// Listens at the socket.
    ///
    /// # Errors
    /// [`ListenError`].
    fn listen(&self) -> Result<Socket, ListenError> {
        Socket::listen_for(self.kind, &self.path, self.mode, self.group.as_deref())
    }
}

/// Options of the service in addition to those of its parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ServiceOptions {
    /// Status socket. Permissions of 0o660 let the group query it.
    pub status: Option<SocketOptions>,
    /// Command socket. It needs an estimation. Its permissions are 0o600 unless a group may send
    /// commands.
    pub control: Option<SocketOptions>,
    /// Packet socket of external torques. It needs an acquisition that estimates them.
    pub external_torque: Option<SocketOptions>,
    /// Receive buffer granted by the kernel, for the status \[bytes\].
    pub receive_buffer: Option<ReceiveBuffer>,
    /// File of the events. If `None`, events are only logged.
    pub events: Option<PathBuf>,
}

/// Components of the bus thread.
pub struct AcquisitionPart {
    /// Source of the frames.
    pub source: Box<dyn Source>,
    /// Assembler that turns frames into samples.
    pub assembler: Assembler,
    /// Options of the bus thread.
    pub options: AcquireOptions,
    /// Options of the recorder. If `None`, no frames are recorded.
    pub recorder: Option<RecorderOptions>,
    /// Estimation of external torque. `None` if there is none.
    pub external_torque: Option<ExternalTorquePart>,
}

/// Components of the observer thread.
pub struct ExternalTorquePart {
    /// Source of the models.
    pub models: ModelSource,
    /// Clients of the socket. `None` without a socket.
    pub clients: Option<Clients>,
}

/// Components of the worker.
pub struct EstimationPart {
    /// Function that identifies a window.
    pub identify: Identify,
    /// Function that identifies the load in a window. `None` if loads are not identified.
    pub find_load: Option<FindLoad>,
    /// Options of the worker.
    pub options: WorkerOptions,
}

/// Parts that this process runs. Two processes with the same stream form one service.
pub enum Parts {
    /// Acquisition and estimation.
    Both(Box<AcquisitionPart>, EstimationPart),
    /// Acquisition only. A worker in another process gets the samples.
    Acquisition(Box<AcquisitionPart>),
    /// Estimation only.
    Estimation(EstimationPart),
}

impl Parts {
    fn stream(&self) -> &StreamOptions {
        match self {
            Self::Both(part, _) | Self::Acquisition(part) => &part.options.stream,
            Self::Estimation(part) => &part.options.stream,
        }
    }

    /// Connects the observer thread with the clients of a socket. `None` without an observer.
    fn connect_clients(&mut self) -> Option<ClientSender> {
        let part = match self {
            Self::Both(part, _) | Self::Acquisition(part) => part,
            Self::Estimation(_) => return None,
        };
        let (sender, connected) = clients();
        part.external_torque.as_mut()?.clients = Some(connected);
        Some(sender)
    }

    fn split(self) -> (Option<Box<AcquisitionPart>>, Option<EstimationPart>) {
        match self {
            Self::Both(acquisition, estimation) => (Some(acquisition), Some(estimation)),
            Self::Acquisition(acquisition) => (Some(acquisition), None),
            Self::Estimation(estimation) => (None, Some(estimation)),
        }
    }
}

/// Reason for the end of the service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServiceEnd {
    /// SIGTERM or SIGINT was received, or SIGHUP without a configuration to reload.
    Signal,
    /// The log or the simulated arm has ended, and every window is processed.
    SourceEnded,
}

/// Outcome of a service that has ended.
#[derive(Clone, Debug, PartialEq)]
pub struct ServiceReport {
    /// Reason for the end.
    pub end: ServiceEnd,
    /// Status at the end.
    pub snapshot: Snapshot,
}

/// Reason why the service could not start, or ended early.
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
    /// A socket cannot be created.
    #[error(transparent)]
    Listen(#[from] ListenError),
    /// The system cannot provide a runtime, thread or signal handler.
    #[error("cannot {action}: {cause}")]
    System {
        /// The attempted operation.
        action: &'static str,
        /// The system's error.
        cause: std::io::Error,
    },
    /// A thread did not start in time. Check the disk and the files in /dev/shm.
    #[error(
        "a thread did not start within five minutes; check that the state folder can be read \
         and that /dev/shm has space"
    )]
    StartTimeout,
    /// A thread panicked. Its message is in the log. Report it.
    #[error("the {thread} thread panicked: see the log above")]
    Panicked {
        /// Name of the thread.
        thread: &'static str,
    },
    /// A command socket is configured, but there is no estimation that executes commands.
    #[error("a control socket needs an estimation in the same process")]
    NothingToControl,
}
