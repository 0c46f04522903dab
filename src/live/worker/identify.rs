//! The thread that identifies windows, and then stores and publishes the results.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::configuration::{IdentifiedWindow, Identifier};
use super::load::load_of_window;
use super::setup::{WhenBusy, WorkerError, WorkerOptions};
use super::state::{EstimateSummary, SharedEstimation};
use super::unstored::{FinishedResult, UnstoredResults};
use super::window::{RejectedWindow, Rejection};
use crate::archive::Results;
use crate::archive::store::{Attachments, FoundLoad, ResultRecord, Timestamp};
use crate::files::take_written_bytes;
use crate::live::recording::{Archiver, RecordedWindow, WriteKind};
use crate::live::stream::{DocumentWriter, StreamNode, Topic};
use crate::window::Window;

/// Interval at which a thread that waits for the identification checks whether it has ended.
const POLL_INTERVAL: Duration = Duration::from_millis(2);

/// Interval at which the identification thread checks whether its window was abandoned.
const REQUEST_POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Maximum time that a stop waits for results to be stored.
const STORE_TIMEOUT: Duration = Duration::from_millis(500);

/// Maximum time that the end waits for a thread with nothing to store. On a busy machine, closing
/// the ports of the thread takes a while. The service as a whole may stop waiting earlier.
const IDLE_TIMEOUT: Duration = Duration::from_secs(5);

/// Maximum time until a late reader of the estimates gets the last estimate.
const WELCOME_INTERVAL: Duration = Duration::from_millis(500);

/// A window and its identifier.
struct QueuedWindow {
    window: Window,
    identifier: Identifier,
}

/// The sending side of the queue.
#[derive(Debug)]
pub(super) struct Identification {
    queue: SyncSender<QueuedWindow>,
    /// Number of windows that the queue holds.
    queue_capacity: usize,
    shared: SharedEstimation,
    thread: JoinHandle<Result<(), WorkerError>>,
}

impl Identification {
    /// Opens the store and starts the thread.
    pub(super) fn start(
        options: &WorkerOptions,
        shared: &SharedEstimation,
        archiver: Option<Archiver>,
    ) -> Result<Self, WorkerError> {
        let open = |folder| Results::open(folder, options.max_results, options.results.drift);
        let results = options.folder.as_deref().map(open).transpose()?;
        let places = options.queue.max(1);
        let (queue, windows) = sync_channel(places);
        let (options, job_shared) = (options.clone(), shared.clone());
        let thread = std::thread::Builder::new()
            .name("identify".into())
            .spawn(move || {
                // Ports must stay on the thread that creates them.
                let node = StreamNode::join(&options.stream)?;
                let estimates = node.document_writer(Topic::Estimates)?;
                let unstored = UnstoredResults::default();
                let shared = job_shared;
                let mut job = IdentificationThread {
                    options,
                    results,
                    estimates,
                    shared,
                    archiver,
                    unstored,
                    stuck: None,
                };
                job.run(&windows)
            })
            .map_err(WorkerError::Thread)?;
        Ok(Self { queue, queue_capacity: places, shared: shared.clone(), thread })
    }

    /// Queues a window. Returns false if `stop` was set while the window waited for a place in the
    /// queue. The window is then still pending, and [`Self::give_up`] rejects it.
    pub(super) fn submit(
        &self,
        window: Window,
        identifier: Identifier,
        when_busy: WhenBusy,
        stop: &AtomicBool,
    ) -> Result<bool, WorkerError> {
        self.shared.add_pending(&window);
        let mut queued = QueuedWindow { window, identifier };
        loop {
            queued = match self.queue.try_send(queued) {
                Ok(()) => return Ok(true),
                Err(TrySendError::Disconnected(_)) => return Err(WorkerError::IdentificationEnded),
                Err(TrySendError::Full(queued)) => queued,
            };
            if when_busy == WhenBusy::Reject {
                self.shared.settle(queued.window.number);
                self.shared.reject(RejectedWindow::new(&queued.window, Rejection::Busy));
                self.shared.return_note(queued.window.note);
                return Ok(true);
            }
            if stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            self.shared.count_iteration();
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Returns true if the queue has a place for another window. The window being identified does
    /// not count.
    pub(super) fn has_room(&self) -> bool {
        self.shared.pending_count() <= self.queue_capacity
    }

    /// Returns true if the thread has ended. Without a request, it ends only after a failure.
    pub(super) fn has_ended(&self) -> bool {
        self.thread.is_finished()
    }

    /// Waits until every queued window is identified. If `stop` is set, abandons the remaining
    /// windows and returns false.
    pub(super) fn finish(mut self, stop: &AtomicBool) -> Result<bool, WorkerError> {
        // The sender is dropped, so that the thread ends after the last window.
        self.queue = sync_channel(1).0;
        while !self.thread.is_finished() {
            if stop.load(Ordering::Relaxed) {
                self.give_up();
                return Ok(false);
            }
            self.shared.count_iteration();
            std::thread::sleep(POLL_INTERVAL);
        }
        self.thread.join().map_err(|_| WorkerError::IdentificationEnded)??;
        Ok(true)
    }

    /// Rejects every window that is queued or being identified. Waits for results that are being
    /// written or wait for the disk. Results that are stored in time count as identified, and the
    /// others as lost. Also waits for the thread, so that its ports are closed before the process
    /// ends.
    pub(super) fn give_up(self) {
        self.shared.give_up();
        drop(self.queue);
        let since = Instant::now();
        let limit = if self.shared.is_settled() { IDLE_TIMEOUT } else { STORE_TIMEOUT };
        while !self.thread.is_finished() && since.elapsed() <= limit {
            std::thread::sleep(POLL_INTERVAL);
        }
        let count = self.shared.abandon_all();
        if count > 0 {
            tracing::warn!("results not stored within {STORE_TIMEOUT:?}, and lost: {count}");
        }
    }
}

struct IdentificationThread {
    options: WorkerOptions,
    results: Option<Results>,
    estimates: DocumentWriter,
    shared: SharedEstimation,
    archiver: Option<Archiver>,
    unstored: UnstoredResults,
    /// Error of an identification that does not end. It holds up those of the next windows.
    stuck: Option<WorkerError>,
}

/// End of a wait without an outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WaitEnd {
    /// The outcome is not wanted any more.
    Abandoned,
    /// The time is over.
    TooLong,
    /// The sender is gone.
    Disconnected,
}

/// Waits for an outcome for at most `limit`, as long as it is wanted.
fn wait_for_outcome<T>(
    outcome: &Receiver<T>,
    limit: Duration,
    is_wanted: impl Fn() -> bool,
) -> Result<T, WaitEnd> {
    let since = Instant::now();
    loop {
        match outcome.recv_timeout(REQUEST_POLL_INTERVAL) {
            Ok(outcome) => return Ok(outcome),
            Err(RecvTimeoutError::Disconnected) => return Err(WaitEnd::Disconnected),
            Err(RecvTimeoutError::Timeout) if !is_wanted() => return Err(WaitEnd::Abandoned),
            Err(RecvTimeoutError::Timeout) if since.elapsed() >= limit => {
                return Err(WaitEnd::TooLong);
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

impl IdentificationThread {
    fn run(&mut self, windows: &Receiver<QueuedWindow>) -> Result<(), WorkerError> {
        self.poll_baseline();
        let end = loop {
            self.shared.count_identification();
            let QueuedWindow { window, identifier } = match windows.recv_timeout(WELCOME_INTERVAL) {
                Ok(queued) => queued,
                Err(RecvTimeoutError::Disconnected) => break Ok(()),
                Err(RecvTimeoutError::Timeout) => {
                    self.poll_baseline();
                    if let Some(results) = &mut self.results {
                        results.settle();
                        self.shared.update().set_pending_lines(results);
                    }
                    if self.unstored.is_due(Instant::now()) {
                        self.store_waiting();
                    }
                    self.count_written();
                    if let Err(cause) = self.estimates.send_to_new_readers() {
                        tracing::debug!("{cause}");
                    }
                    continue;
                }
            };
            // At a stop, the waiting windows are already rejected.
            if !self.shared.is_wanted(window.number) {
                continue;
            }
            let window = Arc::new(window);
            match self.identify_one(&window, &identifier) {
                Ok(()) => {
                    self.shared.put_aside(window.number);
                    continue;
                }
                // The window was abandoned during its identification, and is already counted.
                Err(Rejection::Stopped) => continue,
                Err(rejection) => {
                    self.shared.reject(RejectedWindow::new(&window, rejection));
                    self.shared.return_note(window.note.clone());
                }
            }
            self.shared.settle(window.number);
            if let Some(error) = self.stuck.take() {
                break Err(error);
            }
        };
        self.finish();
        end
    }

    /// Checks whether the baseline was set or cleared since the last check.
    fn poll_baseline(&mut self) {
        if let Some(results) = &mut self.results
            && results.poll_baseline()
        {
            self.shared.update().set_results(results);
        }
    }

    /// Identifies a window on a separate thread. At a stop, that thread is not waited for. The
    /// current thread must continue, because it has ports to close.
    fn identify(
        &mut self,
        window: &Arc<Window>,
        identifier: &Identifier,
    ) -> Result<IdentifiedWindow, Rejection> {
        let refused = |why: String| Rejection::Refused { why };
        let (done, outcome) = sync_channel(1);
        let (computed, computes) = (Arc::clone(window), identifier.clone());
        let thread = std::thread::Builder::new()
            .name("compute".into())
            .spawn(move || {
                // If the window was abandoned, nobody receives the outcome.
                let _ = done.send(computes.identify(&computed));
            })
            .map_err(|cause| refused(WorkerError::Thread(cause).to_string()))?;
        let is_wanted = || self.shared.is_wanted_now(window.number);
        let limit = self.options.time_limit;
        match wait_for_outcome(&outcome, limit, is_wanted) {
            Ok(identified) => identified.map_err(|why| refused(why.to_string())),
            Err(WaitEnd::Abandoned) => Err(Rejection::Stopped),
            Err(WaitEnd::TooLong) => {
                let limit_s = limit.as_secs_f64();
                let stuck = WorkerError::TimeLimit { window: window.number, limit_s };
                let why = stuck.to_string();
                self.stuck = Some(stuck);
                Err(refused(why))
            }
            // The computation panicked. This thread panics as well, and the worker ends with an
            // error.
            Err(WaitEnd::Disconnected) => match thread.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => Err(Rejection::Stopped),
            },
        }
    }

    fn identify_one(
        &mut self,
        window: &Arc<Window>,
        identifier: &Identifier,
    ) -> Result<(), Rejection> {
        let IdentifiedWindow { estimate } = self.identify(window, identifier)?;
        if !self.shared.claim_window(window.number) {
            return Err(Rejection::Stopped);
        }
        tracing::info!(
            window = window.number,
            samples = window.counted_samples.len(),
            relative_error = estimate.relative_error,
            applicable = estimate.verdict.applicable,
            "window identified"
        );
        let options = identifier.results().clone();
        let (note, regrouping) = (window.note.clone(), options.regrouping.clone());
        let load = self.payload(window, identifier);
        let cell = &self.options.stream.cell;
        let dropped = self.unstored.add(FinishedResult {
            summary: EstimateSummary::new(window, &estimate, load.clone()),
            record: ResultRecord::new(cell, identifier.sha256(), window, estimate),
            rejected_window: RejectedWindow::new(window, Rejection::Stopped),
            recorded: RecordedWindow::new(window, identifier.sha256()),
            attachments: Attachments { note, regrouping, against: None, load },
            options,
        });
        if let Some(oldest) = dropped {
            oldest.give_up(&self.shared, "too many results waited for the disk");
        }
        self.store_waiting();
        Ok(())
    }

    /// Returns the payload of the arm during a window. `None` without a baseline, or if the load is
    /// not identifiable.
    fn payload(&mut self, window: &Window, identifier: &Identifier) -> Option<FoundLoad> {
        let results = self.results.as_mut()?;
        if results.poll_baseline() {
            self.shared.update().set_results(results);
        }
        let load = load_of_window(identifier, results.baseline()?, window)?;
        // The status also shows this reason.
        load.inspect_err(|why| tracing::debug!("no load is identified: {why}")).ok()
    }

    /// Stores and publishes the waiting results until the disk refuses one.
    fn store_waiting(&mut self) {
        let mut why = None;
        while let Some(finished) = self.unstored.next_attempt(Instant::now()) {
            // A stop did not wait for this result, and has counted it as lost.
            if !self.shared.is_wanted(finished.rejected_window.number) {
                self.unstored.take_first();
                continue;
            }
            let stored = match &mut self.results {
                Some(results) => results.store_result(
                    &finished.record,
                    &finished.attachments,
                    &finished.options,
                    Timestamp::now(),
                ),
                None => {
                    self.publish();
                    continue;
                }
            };
            match stored {
                Ok(stored) => {
                    if let Some(archiver) = &self.archiver {
                        archiver.keep_result(stored.number, &finished.recorded);
                    }
                    self.publish();
                }
                Err(error) => {
                    why = Some(error.to_string());
                    break;
                }
            }
        }
        self.count_written();
        let mut status = self.shared.update();
        status.results_waiting = self.unstored.len() as u64;
        if why.is_some() && why != status.results_wait_for {
            tracing::warn!(
                "a result could not be stored and is tried again: {}",
                why.as_deref().unwrap_or_default()
            );
        }
        status.results_wait_for = why;
    }

    /// Counts what this thread has written since the last call.
    fn count_written(&mut self) {
        let (bytes, now) = (take_written_bytes(), Timestamp::now());
        if bytes > 0 {
            self.options.budget.count(WriteKind::Results, bytes, now);
        }
        self.shared.update().written = self.options.budget.status(now);
    }

    /// Publishes the oldest waiting result, and removes it from the queue. It has been stored, or
    /// it is only published, or it cannot be serialised.
    fn publish(&mut self) {
        let Some(finished) = self.unstored.take_first() else { return };
        let json = match serde_json::to_vec(&finished.record.for_subscribers()) {
            Ok(json) => json,
            Err(why) => return finished.give_up(&self.shared, &why.to_string()),
        };
        // The result is stored. Subscribers may miss it.
        if let Err(cause) = self.estimates.publish(&json) {
            let window = finished.summary.window;
            tracing::warn!("the estimate of window {window} is not published: {cause}");
        }
        let mut status = self.shared.update();
        status.windows_identified += 1;
        status.last_estimate = Some(finished.summary);
        if let Some(results) = &self.results {
            status.set_results(results);
        }
        drop(status);
        self.shared.settle(finished.rejected_window.number);
    }

    /// Tries once more to store the waiting results at the end. Results that the disk refuses are
    /// counted as lost.
    fn finish(&mut self) {
        self.store_waiting();
        let why = self.shared.update().results_wait_for.take().unwrap_or_default();
        while let Some(finished) = self.unstored.take_first() {
            finished.give_up(&self.shared, &why);
        }
        self.shared.update().results_waiting = 0;
        self.options.budget.save();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::WindowEnd;

    #[test]
    fn an_identification_has_a_time_limit() {
        let (done, outcome) = sync_channel(1);
        let limit = Duration::from_millis(50);
        let since = Instant::now();
        assert_eq!(wait_for_outcome(&outcome, limit, || true), Err(WaitEnd::TooLong));
        assert!(since.elapsed() >= limit);
        assert_eq!(wait_for_outcome(&outcome, limit, || false), Err(WaitEnd::Abandoned));
        done.send(7).unwrap();
        assert_eq!(wait_for_outcome(&outcome, limit, || false), Ok(7));
        drop(done);
        assert_eq!(wait_for_outcome(&outcome, limit, || true), Err(WaitEnd::Disconnected));
    }

    #[test]
    fn a_stop_waits_for_results_that_are_not_stored_and_counts_those_that_stay_so() {
        let shared = SharedEstimation::default();
        for number in 0..3 {
            let samples = vec![didim_dynamics::JointSample::zero(0, 0)];
            let (sample_rate_hz, counted, end) = (500.0, 0..1, WindowEnd::Rest);
            let (start, note) = (None, None);
            let window = Window {
                number,
                sample_rate_hz,
                samples,
                counted_samples: counted,
                end,
                recording_start: start,
                note,
            };
            shared.add_pending(&window);
            if number < 2 {
                assert!(shared.claim_window(number));
                shared.put_aside(number);
            }
        }
        shared.update().results_waiting = 2;
        shared.update().results_wait_for = Some("no room".into());
        assert_eq!(shared.pending_count(), 1, "what waits for the disk holds up no window");
        // Simulates a disk that hangs.
        let (hangs, until) = sync_channel::<()>(0);
        let thread = std::thread::spawn(move || {
            let _ = until.recv();
            Ok(())
        });
        let queue = sync_channel(1).0;
        let since = Instant::now();
        Identification { queue, queue_capacity: 1, shared: shared.clone(), thread }.give_up();
        assert!(since.elapsed() >= STORE_TIMEOUT);
        drop(hangs);
        let status = shared.snapshot();
        let counted = [("not-stored".to_owned(), 2), ("stopped".to_owned(), 1)];
        assert_eq!(status.windows_rejected, counted.into());
        assert_eq!((status.results_waiting, status.results_wait_for), (0, None));
        assert!(shared.is_settled());
    }
}
