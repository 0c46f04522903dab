//! The supervision: starts the parts, tells about them, stops them.

use core::convert::Infallible;
use core::future::pending;
use core::time::Duration;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use sd_notify::NotifyState;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::sync::watch;

use super::threads::{Report, start_acquisition, start_estimation};
use super::{Parts, ServiceEnd, ServiceError, ServiceOptions, ServiceReport, SocketOptions};
use crate::acquire::SharedAcquisition;
use crate::status::{Collector, Dispatcher, Snapshot, Socket, serve_commands, serve_status};
use crate::stream::{DocumentWriter, StreamNode, Topic};
use crate::worker::{Commands, SharedEstimation};

/// How often the status is taken.
const STATUS_PERIOD: Duration = Duration::from_secs(1);
/// How long the parts may take to stop. An identification that takes longer is abandoned; its
/// result is stored whole or not at all.
const STOP_TIMEOUT: Duration = Duration::from_secs(5);

/// Runs the parts until a signal comes, a log ends, or one of them fails.
///
/// Says `READY=1` to the service manager when the parts have their ports, a status line every
/// second, `WATCHDOG=1` only while the threads really turn, and `STOPPING=1`.
///
/// # Errors
/// [`ServiceError`].
pub fn run(options: &ServiceOptions, parts: Parts) -> Result<ServiceReport, ServiceError> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|cause| ServiceError::System { action: "start the runtime", cause })?;
    let report = runtime.block_on(supervise(options, parts));
    // A command that waits for its answer must not hold up the end.
    runtime.shutdown_background();
    report
}

async fn supervise(options: &ServiceOptions, parts: Parts) -> Result<ServiceReport, ServiceError> {
    if options.control.is_some() && matches!(parts, Parts::Acquisition(_)) {
        return Err(ServiceError::NothingToControl);
    }
    let mut signals = Signals::register()?;
    // First the sockets: they tell a second service of the same cell from the first.
    let status_socket = listen(options.status.as_ref())?;
    let control_socket = listen(options.control.as_ref())?;
    let node = StreamNode::join(parts.stream())?;
    let mut service = Service::new(options, &parts, node.document_writer(Topic::Status)?);
    if let Err(error) = service.start(parts).await {
        service.stop().await;
        return Err(error);
    }
    let (latest, documents) = watch::channel(service.tick().1);
    let dispatcher = Dispatcher { windows: service.commands.clone(), reload: None };
    let status = async {
        match &status_socket {
            Some(socket) => serve_status(socket, documents).await,
            None => pending().await,
        }
    };
    let control = async {
        match &control_socket {
            Some(socket) => serve_commands(socket, dispatcher).await,
            None => pending().await,
        }
    };
    tokio::pin!(status, control);
    notify(&[NotifyState::Ready]);
    let mut period = tokio::time::interval(STATUS_PERIOD);
    period.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let end = loop {
        tokio::select! {
            failed = &mut status => break Err(server_failed(failed)),
            failed = &mut control => break Err(server_failed(failed)),
            () = signals.any() => break Ok(ServiceEnd::Signal),
            report = service.reports.recv() => match service.handle(report) {
                Ok(None) => {}
                Ok(Some(end)) => break Ok(end),
                Err(error) => break Err(error),
            },
            _ = period.tick() => {
                let (snapshot, document) = service.tick();
                latest.send_replace(document);
                service.tell_manager(&snapshot);
            }
        }
    };
    notify(&[NotifyState::Stopping]);
    service.stop().await;
    let (snapshot, document) = service.tick();
    latest.send_replace(document);
    Ok(ServiceReport { end: end?, snapshot })
}

/// The running parts as seen from the supervision.
struct Service {
    collector: Collector,
    publisher: DocumentWriter,
    acquisition: Option<SharedAcquisition>,
    estimation: Option<SharedEstimation>,
    commands: Option<Commands>,
    report: UnboundedSender<Report>,
    reports: UnboundedReceiver<Report>,
    stop: Arc<AtomicBool>,
    /// Threads that have not ended.
    running: usize,
    /// Turns of the threads when the service manager's watchdog was last fed.
    turns: (u64, u64),
}

impl Service {
    fn new(options: &ServiceOptions, parts: &Parts, publisher: DocumentWriter) -> Self {
        let (has_acquisition, has_estimation) = match parts {
            Parts::Both(..) => (true, true),
            Parts::Acquisition(_) => (true, false),
            Parts::Estimation(_) => (false, true),
        };
        let acquisition = has_acquisition.then(SharedAcquisition::default);
        let estimation = has_estimation.then(SharedEstimation::default);
        let (report, reports) = unbounded_channel();
        Self {
            collector: Collector::new(
                parts.stream(),
                acquisition.clone(),
                estimation.clone(),
                options.receive_buffer,
                Instant::now(),
            ),
            publisher,
            acquisition,
            estimation,
            commands: None,
            report,
            reports,
            stop: Arc::new(AtomicBool::new(false)),
            running: 0,
            turns: (0, 0),
        }
    }

    /// Starts the worker and then the bus, so that the first sample finds a reader; returns when
    /// both have their ports.
    async fn start(&mut self, parts: Parts) -> Result<(), ServiceError> {
        let (acquisition, estimation) = parts.split();
        if let (Some(part), Some(shared)) = (estimation, &self.estimation) {
            start_estimation(part, shared, &self.stop, &self.report)?;
            self.started().await?;
        }
        if let (Some(part), Some(shared)) = (acquisition, &self.acquisition) {
            start_acquisition(part, shared, &self.stop, &self.report)?;
            self.started().await?;
        }
        Ok(())
    }

    /// Waits for the first report of the thread that was started last.
    async fn started(&mut self) -> Result<(), ServiceError> {
        self.running += 1;
        let report = self.reports.recv().await;
        self.handle(report).map(drop)
    }

    /// The end, when the last part has ended well.
    fn handle(&mut self, report: Option<Report>) -> Result<Option<ServiceEnd>, ServiceError> {
        match report {
            // We hold a sender ourselves: there is always one more to come.
            None | Some(Report::AcquisitionReady) => return Ok(None),
            Some(Report::EstimationReady(commands)) => {
                self.commands = Some(commands);
                return Ok(None);
            }
            Some(Report::AcquisitionEnded(ended)) => {
                self.running -= 1;
                ended?;
            }
            Some(Report::EstimationEnded(ended)) => {
                self.running -= 1;
                ended?;
            }
        }
        Ok((self.running == 0).then_some(ServiceEnd::SourceEnded))
    }

    /// Takes a snapshot and publishes it.
    fn tick(&mut self) -> (Snapshot, Arc<[u8]>) {
        let snapshot = self.collector.snapshot(Instant::now());
        // A snapshot has no key that JSON cannot hold.
        let mut document = serde_json::to_vec(&snapshot).unwrap_or_default();
        document.push(b'\n');
        if let Err(cause) = self.publisher.publish(&document) {
            tracing::debug!("the status is not published: {cause}");
        }
        (snapshot, document.into())
    }

    fn tell_manager(&mut self, snapshot: &Snapshot) {
        let line = if snapshot.health.ok {
            "running".to_owned()
        } else {
            snapshot.health.reasons.join("; ")
        };
        notify(&[NotifyState::Status(&line)]);
        let turns = (
            self.acquisition.as_ref().map_or(0, |shared| shared.counts().turns),
            self.estimation.as_ref().map_or(0, SharedEstimation::turns),
        );
        let acquired = self.acquisition.is_none() || turns.0 != self.turns.0;
        let estimated = self.estimation.is_none() || turns.1 != self.turns.1;
        if acquired && estimated {
            self.turns = turns;
            notify(&[NotifyState::Watchdog]);
        }
    }

    /// Tells the threads to stop and waits for them, for a while.
    async fn stop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let stopped = async {
            while self.running > 0 {
                match self.reports.recv().await {
                    Some(report) => {
                        if let Err(error) = self.handle(Some(report)) {
                            tracing::warn!("while stopping: {error}");
                        }
                    }
                    None => break,
                }
            }
        };
        if tokio::time::timeout(STOP_TIMEOUT, stopped).await.is_err() {
            tracing::warn!("a thread did not stop within {STOP_TIMEOUT:?} and is abandoned");
        }
    }
}

struct Signals {
    terminate: Signal,
    interrupt: Signal,
}

impl Signals {
    fn register() -> Result<Self, ServiceError> {
        let register = |kind| {
            signal(kind)
                .map_err(|cause| ServiceError::System { action: "register for signals", cause })
        };
        Ok(Self {
            terminate: register(SignalKind::terminate())?,
            interrupt: register(SignalKind::interrupt())?,
        })
    }

    async fn any(&mut self) {
        tokio::select! {
            _ = self.terminate.recv() => {}
            _ = self.interrupt.recv() => {}
        }
    }
}

fn listen(options: Option<&SocketOptions>) -> Result<Option<Socket>, ServiceError> {
    let listen = |at: &SocketOptions| Socket::listen(&at.path, at.mode, at.group.as_deref());
    Ok(options.map(listen).transpose()?)
}

fn server_failed(failed: io::Result<Infallible>) -> ServiceError {
    let Err(cause) = failed;
    ServiceError::System { action: "serve a socket", cause }
}

/// Tells the service manager, if there is one.
fn notify(states: &[NotifyState<'_>]) {
    if let Err(cause) = sd_notify::notify(states) {
        tracing::debug!("the service manager cannot be told: {cause}");
    }
}
