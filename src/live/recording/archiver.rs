//! The thread that keeps recordings of results, faults and captures.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::archive::Archive;
use super::budget::WriteBudget;
use super::curves::JointCurves;
use super::options::{RecordingOptions, archive_folder, ring_folder};
use super::request::{
    CaptureAnswer, CaptureError, QUEUE_CAPACITY, Request, SharedArchive, check_capture_name, lock,
};
use super::ring::disk_space;
use super::window::RecordedWindow;

/// Maximum time that the end of the service waits for pending recordings.
const FINISH_TIMEOUT: Duration = Duration::from_secs(4);
/// Maximum time that a command waits for its answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Options of the archiver.
#[derive(Clone, Debug)]
pub struct ArchiverOptions {
    /// Folder of all recordings.
    pub folder: PathBuf,
    /// Time margins, rates and size limits.
    pub recordings: RecordingOptions,
    /// Conversion of frames into joint curves.
    pub curves: JointCurves,
}

/// Sender of requests to the archiver. It waits only for the answer about a capture.
#[derive(Clone, Debug)]
pub struct Archiver {
    requests: SyncSender<Request>,
    shared: SharedArchive,
    last_fault: Arc<Mutex<Option<Instant>>>,
    fault_every: Duration,
}

/// The archiver's thread.
#[derive(Debug)]
pub struct ArchiverThread {
    thread: JoinHandle<()>,
    is_ending: Arc<AtomicBool>,
}

/// Runs the body of the thread until it returns. After a panic, the requests that waited are
/// counted as failed, and the body runs again.
fn run_guarded(shared: &SharedArchive, mut body: impl FnMut()) {
    while catch_unwind(AssertUnwindSafe(&mut body)).is_err() {
        lock(&shared.0).waiting = 0;
        shared.count_failure("the recordings that waited", &"the archiver panicked: see the log");
    }
}

impl Archiver {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(
        options: &ArchiverOptions,
        budget: &WriteBudget,
    ) -> std::io::Result<(Self, ArchiverThread)> {
        let (requests, received) = sync_channel(QUEUE_CAPACITY);
        let (shared, ending) = (SharedArchive::default(), Arc::new(AtomicBool::new(false)));
        let mut archive = Archive {
            ring: ring_folder(&options.folder),
            folder: archive_folder(&options.folder),
            options: options.recordings.clone(),
            curves: options.curves.clone(),
            shared: shared.clone(),
            budget: budget.clone(),
            waiting_requests: Vec::new(),
            capture: None,
            step_time: Instant::now(),
            end_seen: None,
            disk_space,
        };
        let thread_ending = Arc::clone(&ending);
        let shared_by_thread = shared.clone();
        let thread = std::thread::Builder::new().name("archiver".into()).spawn(move || {
            run_guarded(&shared_by_thread, || archive.run(&received, &thread_ending));
        })?;
        let fault_every = Duration::from_secs_f64(options.recordings.fault_every_s);
        let last_fault = Arc::default();
        Ok((
            Self { requests, shared, last_fault, fault_every },
            ArchiverThread { thread, is_ending: ending },
        ))
    }

    /// Returns the shared counts.
    pub fn shared(&self) -> &SharedArchive {
        &self.shared
    }

    /// Keeps the frames of the window of the result with this number.
    pub fn keep_result(&self, number: u64, window: &RecordedWindow) {
        self.submit(Request::Result { number, window: window.clone() });
    }

    /// Keeps the frames around a fault, unless another fault occurred shortly before.
    pub fn keep_fault(&self, cause: &'static str, stamp_ns: u64, now: Instant) {
        let mut last = lock(&self.last_fault);
        if last.is_some_and(|last| now.saturating_duration_since(last) < self.fault_every) {
            lock(&self.shared.0).faults_passed_over += 1;
            return;
        }
        *last = Some(now);
        drop(last);
        self.submit(Request::Fault { cause, stamp_ns });
    }

    /// Starts a capture of the bus.
    ///
    /// # Errors
    /// [`CaptureError`].
    pub fn start_capture(&self, name: &str) -> Result<(), CaptureError> {
        check_capture_name(name)?;
        self.ask(|answer| Request::Start { name: name.to_owned(), answer })
    }

    /// Ends the capture. Its recording is available some seconds later.
    ///
    /// # Errors
    /// [`CaptureError`].
    pub fn stop_capture(&self) -> Result<(), CaptureError> {
        self.ask(|answer| Request::Stop { answer })
    }

    fn ask(&self, request: impl FnOnce(CaptureAnswer) -> Request) -> Result<(), CaptureError> {
        let (answer, answered) = sync_channel(1);
        self.requests.try_send(request(answer)).map_err(|_| CaptureError::Busy)?;
        answered.recv_timeout(ANSWER_TIMEOUT).map_err(|_| CaptureError::Busy)?
    }

    fn submit(&self, request: Request) {
        lock(&self.shared.0).waiting += 1;
        match self.requests.try_send(request) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => self
                .shared
                .count_failure("a further request", &"too many requests wait for the ring"),
            Err(TrySendError::Disconnected(_)) => {
                self.shared.count_failure("a further request", &"the archiver has ended");
            }
        }
    }
}

impl ArchiverThread {
    /// Keeps the requested recordings as far as their frames are in the ring. Waits for the frames,
    /// but only for a limited time.
    pub fn finish(self) {
        self.is_ending.store(true, Ordering::Relaxed);
        let since = Instant::now();
        while !self.thread.is_finished() {
            if since.elapsed() > FINISH_TIMEOUT {
                tracing::warn!("recordings still waiting after {FINISH_TIMEOUT:?} are abandoned");
                return;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archiver_that_panics_counts_what_waited_and_starts_again() {
        let shared = SharedArchive::default();
        lock(&shared.0).waiting = 3;
        let mut runs = 0;
        run_guarded(&shared, || {
            runs += 1;
            assert!(runs > 1, "on purpose");
        });
        let status = shared.snapshot();
        assert_eq!((runs, status.waiting, status.failed), (2, 0, 1));
        assert!(status.last_failure.unwrap().contains("panicked"));
    }
}
