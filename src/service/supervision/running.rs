//! The running parts, which the supervision uses.

use core::time::Duration;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};

use super::changes::ChangeWatch;
use super::journal::Journal;
use super::line::StatusLine;
use super::manager::Manager;
use super::readiness::Progress;
use super::threads::{Report, start_acquisition, start_estimation};
use super::{Parts, ServiceEnd, ServiceError, ServiceOptions};
use crate::live::acquire::SharedAcquisition;
use crate::live::pause::PauseWatch;
use crate::live::stream::{DocumentReader, DocumentWriter};
use crate::live::worker::{Commands, SharedEstimation};
use crate::service::status::{Collector, Snapshot, one_line};

/// Maximum time for the parts to stop. Together with the end of the process, it is a second. A
/// longer identification is abandoned. Its result is stored completely or not at all.
const STOP_TIMEOUT: Duration = Duration::from_millis(800);
/// Interval at which the supervision looks for a pause of the process. A pause is reported too
/// short by at most this time.
pub(super) const PAUSE_POLL: Duration = Duration::from_millis(100);
/// Interval at which more start time is requested. The number of requests is limited, and so is the
/// start: five minutes. A folder of many results and the allocation of shared memory take long.
const EXTENSION_INTERVAL: Duration = Duration::from_secs(2);
const MAX_EXTENSIONS: u32 = 150;
/// Maximum length of the reason of a refused reload in the status \[characters\].
const MAX_REASON: usize = 1000;

pub(super) struct Running {
    collector: Collector,
    publisher: DocumentWriter,
    /// Reader of the acquisition's status, if this process runs only the estimation.
    other_status: Option<DocumentReader>,
    line: StatusLine,
    /// Latest status line.
    latest_line: String,
    changes: ChangeWatch,
    pauses: PauseWatch,
    journal: Journal,
    /// Folder of the stream library's files.
    stream_root: PathBuf,
    acquisition: Option<SharedAcquisition>,
    estimation: Option<SharedEstimation>,
    progress: Progress,
    commands: Option<Commands>,
    report: UnboundedSender<Report>,
    reports: UnboundedReceiver<Report>,
    stop: Arc<AtomicBool>,
    /// Number of threads that have not ended.
    running_threads: usize,
    /// Start time of the threads.
    started_at: Instant,
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
            other_status: statuses,
            line: StatusLine::default(),
            latest_line: String::new(),
            changes: ChangeWatch::default(),
            pauses: PauseWatch::new(PAUSE_POLL),
            journal: Journal::new(options.events.clone()),
            stream_root: parts.stream().root.clone(),
            progress: Progress::new(parts, acquisition.clone(), estimation.clone()),
            acquisition,
            estimation,
            commands: None,
            report,
            reports,
            stop: Arc::new(AtomicBool::new(false)),
            running_threads: 0,
            started_at: Instant::now(),
        }
    }

    /// Starts the worker and then the bus thread, so that a reader exists before the first sample.
    /// Returns when both have created their ports.
    pub(super) async fn start(
        &mut self,
        parts: Parts,
        manager: &Manager,
    ) -> Result<(), ServiceError> {
        let (acquisition, estimation) = parts.split();
        manager.notify_status("starting");
        if let (Some(part), Some(shared)) = (estimation, &self.estimation) {
            start_estimation(part, shared, &self.stop, &self.report)?;
            self.wait_for_start(manager).await?;
        }
        if let (Some(part), Some(shared)) = (acquisition, &self.acquisition) {
            start_acquisition(part, shared, &self.stop, &self.report)?;
            self.wait_for_start(manager).await?;
        }
        self.started_at = Instant::now();
        Ok(())
    }

    /// Waits for the first report of the thread that was started last.
    async fn wait_for_start(&mut self, manager: &Manager) -> Result<(), ServiceError> {
        self.running_threads += 1;
        let mut extensions = 0;
        loop {
            tokio::select! {
                report = self.reports.recv() => return self.handle_report(report).map(drop),
                () = tokio::time::sleep(EXTENSION_INTERVAL) => {
                    extensions += 1;
                    if extensions > MAX_EXTENSIONS {
                        return Err(ServiceError::StartTimeout);
                    }
                    manager.extend_start();
                }
            }
        }
    }

    /// Returns the command sender of the worker. `None` without a worker.
    pub(super) fn commands(&self) -> Option<Commands> {
        self.commands.clone()
    }

    /// Returns the next report of a thread.
    pub(super) async fn report(&mut self) -> Option<Report> {
        self.reports.recv().await
    }

    /// Handles a report. Returns the reason for the end of the service if the last part has ended
    /// normally.
    pub(super) fn handle_report(
        &mut self,
        report: Option<Report>,
    ) -> Result<Option<ServiceEnd>, ServiceError> {
        match report {
            // This struct keeps a sender, so the channel is never closed.
            None | Some(Report::AcquisitionReady) => return Ok(None),
            Some(Report::EstimationReady(commands)) => {
                self.commands = Some(commands);
                return Ok(None);
            }
            Some(Report::AcquisitionEnded(ended)) => {
                self.running_threads -= 1;
                self.progress.acquisition_ended();
                ended?;
            }
            Some(Report::EstimationEnded(ended)) => {
                self.running_threads -= 1;
                self.progress.estimation_ended();
                ended?;
            }
        }
        Ok((self.running_threads == 0).then_some(ServiceEnd::SourceEnded))
    }

    /// Takes a snapshot and publishes it.
    pub(super) fn publish_snapshot(&mut self) -> (Snapshot, Arc<[u8]>) {
        let now = Instant::now();
        while let Some(Ok(Some(status))) = self.other_status.as_mut().map(DocumentReader::receive) {
            self.collector.handle_document(&status, now);
        }
        let snapshot = self.collector.snapshot(now);
        // Every key of a snapshot can be represented in JSON.
        let mut document = serde_json::to_vec(&snapshot).unwrap_or_default();
        document.push(b'\n');
        if let Err(cause) = self.publisher.publish(&document) {
            tracing::debug!("the status is not published: {cause}");
        }
        self.latest_line = self.line.next_line(&snapshot, now);
        (snapshot, document.into())
    }

    /// Records the changes of a snapshot as events. `is_started` is true if the start of the
    /// service is complete.
    pub(super) fn record_changes(&mut self, snapshot: &Snapshot, is_started: bool) {
        let events = self.changes.handle_snapshot(snapshot, is_started, Instant::now());
        events.into_iter().for_each(|event| self.journal.record(event));
        self.collector.process.events.clone_from(self.changes.counts());
    }

    /// Records a pause of the process as an event. Has to be called at intervals of [`PAUSE_POLL`].
    pub(super) fn look_for_pause(&mut self) {
        if let Some(pause) = self.pauses.check()
            && let Some(event) = self.changes.handle_pause(&pause, Instant::now())
        {
            self.journal.record(event);
        }
    }

    /// Starts the search for pauses, after the start of the service.
    pub(super) fn restart_pauses(&mut self) {
        self.pauses.restart();
    }

    /// Returns the status line of the latest snapshot.
    pub(super) fn line(&self) -> String {
        self.latest_line.clone()
    }

    /// Adds missing sockets to the status, and checks whether the files of the stream exist.
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

    /// Returns true if samples arrive, no drive is enabled, the bus is known to be silent, or the
    /// maximum waiting time is over.
    pub(super) fn is_ready(&self, now: Instant) -> bool {
        self.progress.is_ready(now.saturating_duration_since(self.started_at))
    }

    /// Returns true if all threads have made progress since the last call that returned true.
    pub(super) fn has_progressed(&mut self) -> bool {
        self.progress.has_progressed()
    }

    /// Keeps the outcome of a reload for the status until the next reload.
    pub(super) fn store_reload_outcome(&mut self, outcome: &Result<(), String>) {
        match outcome {
            Ok(()) => tracing::info!("the configuration was read again"),
            Err(why) => tracing::error!("the reload was refused: {why}"),
        }
        self.collector.process.reload_refused =
            outcome.as_ref().err().map(|why| one_line(why, MAX_REASON));
    }

    /// Requests the threads to stop, and waits for them for a limited time.
    pub(super) async fn stop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let stopped = async {
            while self.running_threads > 0 {
                match self.reports.recv().await {
                    Some(report) => {
                        if let Err(error) = self.handle_report(Some(report)) {
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
