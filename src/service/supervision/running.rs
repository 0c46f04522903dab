//! The running parts as seen from the supervision.

use core::time::Duration;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};

use super::line::StatusLine;
use super::manager::Manager;
use super::readiness::Progress;
use super::threads::{Report, start_acquisition, start_estimation};
use super::{Parts, ServiceEnd, ServiceError, ServiceOptions};
use crate::live::acquire::SharedAcquisition;
use crate::live::stream::{DocumentReader, DocumentWriter};
use crate::live::worker::{Commands, SharedEstimation};
use crate::service::status::{Collector, Snapshot, one_line};

/// How long the parts may take to stop: with what the end of the process takes, a second. An
/// identification that takes longer is abandoned; its result is stored whole or not at all.
const STOP_TIMEOUT: Duration = Duration::from_millis(800);
/// How often a start asks the service manager for more time, and how often at most: a folder of many
/// results and shared memory that has to be made room for take their time, but not for ever.
const EXTEND_EVERY: Duration = Duration::from_secs(2);
const EXTENSIONS: u32 = 150;
/// The longest reason of a refused reload in the status \[characters\].
const MAX_REASON: usize = 1000;

pub(super) struct Running {
    collector: Collector,
    publisher: DocumentWriter,
    /// Tells what the other half says, where this is the estimation alone.
    statuses: Option<DocumentReader>,
    line: StatusLine,
    /// The latest line.
    latest: String,
    /// Where the library of the stream has its files.
    stream_root: PathBuf,
    acquisition: Option<SharedAcquisition>,
    estimation: Option<SharedEstimation>,
    progress: Progress,
    commands: Option<Commands>,
    report: UnboundedSender<Report>,
    reports: UnboundedReceiver<Report>,
    stop: Arc<AtomicBool>,
    /// Threads that have not ended.
    threads: usize,
    /// When the threads began.
    began: Instant,
}

impl Running {
    pub(super) fn new(
        options: &ServiceOptions,
        parts: &Parts,
        publisher: DocumentWriter,
        statuses: Option<DocumentReader>,
    ) -> Self {
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
            statuses,
            line: StatusLine::default(),
            latest: String::new(),
            stream_root: parts.stream().root.clone(),
            progress: Progress::new(parts, acquisition.clone(), estimation.clone()),
            acquisition,
            estimation,
            commands: None,
            report,
            reports,
            stop: Arc::new(AtomicBool::new(false)),
            threads: 0,
            began: Instant::now(),
        }
    }

    /// Starts the worker and then the bus, so that the first sample finds a reader; returns when
    /// both have their ports.
    pub(super) async fn start(
        &mut self,
        parts: Parts,
        manager: &Manager,
    ) -> Result<(), ServiceError> {
        let (acquisition, estimation) = parts.split();
        manager.status("starting");
        if let (Some(part), Some(shared)) = (estimation, &self.estimation) {
            start_estimation(part, shared, &self.stop, &self.report)?;
            self.started(manager).await?;
        }
        if let (Some(part), Some(shared)) = (acquisition, &self.acquisition) {
            start_acquisition(part, shared, &self.stop, &self.report)?;
            self.started(manager).await?;
        }
        self.began = Instant::now();
        Ok(())
    }

    /// Waits for the first report of the thread that was started last.
    async fn started(&mut self, manager: &Manager) -> Result<(), ServiceError> {
        self.threads += 1;
        let mut extensions = 0;
        loop {
            tokio::select! {
                report = self.reports.recv() => return self.handle(report).map(drop),
                () = tokio::time::sleep(EXTEND_EVERY), if extensions < EXTENSIONS => {
                    extensions += 1;
                    manager.extend_start();
                }
            }
        }
    }

    /// Hands commands to the worker; nothing without one.
    pub(super) fn commands(&self) -> Option<Commands> {
        self.commands.clone()
    }

    /// The next report of a thread.
    pub(super) async fn report(&mut self) -> Option<Report> {
        self.reports.recv().await
    }

    /// The end, when the last part has ended well.
    pub(super) fn handle(
        &mut self,
        report: Option<Report>,
    ) -> Result<Option<ServiceEnd>, ServiceError> {
        match report {
            // We hold a sender ourselves: there is always one more to come.
            None | Some(Report::AcquisitionReady) => return Ok(None),
            Some(Report::EstimationReady(commands)) => {
                self.commands = Some(commands);
                return Ok(None);
            }
            Some(Report::AcquisitionEnded(ended)) => {
                self.threads -= 1;
                self.progress.acquisition_ended();
                ended?;
            }
            Some(Report::EstimationEnded(ended)) => {
                self.threads -= 1;
                self.progress.estimation_ended();
                ended?;
            }
        }
        Ok((self.threads == 0).then_some(ServiceEnd::SourceEnded))
    }

    /// Takes a snapshot and publishes it.
    pub(super) fn tick(&mut self) -> (Snapshot, Arc<[u8]>) {
        let now = Instant::now();
        while let Some(Ok(Some(status))) = self.statuses.as_mut().map(DocumentReader::receive) {
            self.collector.hear(&status, now);
        }
        let snapshot = self.collector.snapshot(now);
        // A snapshot has no key that JSON cannot hold.
        let mut document = serde_json::to_vec(&snapshot).unwrap_or_default();
        document.push(b'\n');
        if let Err(cause) = self.publisher.publish(&document) {
            tracing::debug!("the status is not published: {cause}");
        }
        self.latest = self.line.of(&snapshot, now);
        (snapshot, document.into())
    }

    /// The latest snapshot in a line.
    pub(super) fn line(&self) -> String {
        self.latest.clone()
    }

    /// Tells of sockets that are missing, and notices when the files of the stream are.
    pub(super) fn look_at_files(&mut self, sockets_missing: Vec<String>) {
        let process = &mut self.collector.process;
        process.sockets_missing = sockets_missing;
        let gone = (!self.stream_root.exists()).then(|| self.stream_root.display().to_string());
        if process.stream_folder_gone != gone {
            if let Some(folder) = &gone {
                tracing::error!("{folder} was removed while the service runs");
            }
            process.stream_folder_gone = gone;
        }
    }

    /// Whether samples flow or the bus is known to be silent.
    pub(super) fn is_ready(&self, now: Instant) -> bool {
        self.progress.is_ready(now.saturating_duration_since(self.began))
    }

    /// Whether all threads have made progress since this was last true.
    pub(super) fn has_progressed(&mut self) -> bool {
        self.progress.has_progressed()
    }

    /// Remembers what came of a reload until the next one.
    pub(super) fn reloaded(&mut self, outcome: &Result<(), String>) {
        match outcome {
            Ok(()) => tracing::info!("the configuration was read again"),
            Err(why) => tracing::error!("the reload was refused: {why}"),
        }
        self.collector.process.reload_refused =
            outcome.as_ref().err().map(|why| one_line(why, MAX_REASON));
    }

    /// Tells the threads to stop and waits for them, for a while.
    pub(super) async fn stop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let stopped = async {
            while self.threads > 0 {
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
