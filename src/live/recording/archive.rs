//! The archiver's thread. It waits until the ring contains the requested frames, and extracts them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use super::archive_folder::{ArchiveFolder, Kind};
use super::budget::{OverBudget, WriteBudget, WriteKind};
use super::curves::JointCurves;
use super::extract::{ExtractError, RunChoice, TimeRange, extract, find, newest_stamp};
use super::options::RecordingOptions;
use super::request::{CaptureError, QUEUE_CAPACITY, Request, SharedArchive, lock};
use super::ring::{DiskSpace, RingError};
use crate::archive::store::Timestamp;

/// Interval at which the ring is polled while a request waits.
const POLL_INTERVAL: Duration = Duration::from_millis(100);
/// Interval at which the size of a capture is checked.
const DISK_POLL_INTERVAL: Duration = Duration::from_secs(1);
/// Maximum time until received frames are in the ring on disk.
const RING_DELAY: Duration = Duration::from_secs(4);
/// Duration of the frames that a killed recorder may have lost \[ns\].
const LOSS_MARGIN_NS: u64 = 1_000_000_000;
/// Maximum time at the end of the service for the recorder to close its file.
const LAST_DELAY: Duration = Duration::from_millis(300);
/// Pause between two polls at the end of the service.
const FINAL_PAUSE: Duration = Duration::from_millis(10);

/// A request that waits until the ring contains its frames.
pub(super) struct WaitingRequest {
    kind: Kind,
    /// Number of the result, if the request is for the recording of a result.
    number: Option<u64>,
    label: String,
    time_range: TimeRange,
    metadata: BTreeMap<String, String>,
    deadline: Instant,
}

/// A running capture.
pub(super) struct RunningCapture {
    name: String,
    from_ns: u64,
    since: Instant,
    /// Time of the last check of the capture's size.
    size_checked: Instant,
}

/// State of the thread.
pub(super) struct Archive {
    pub(super) ring: PathBuf,
    pub(super) folder: PathBuf,
    pub(super) options: RecordingOptions,
    pub(super) curves: JointCurves,
    pub(super) shared: SharedArchive,
    pub(super) budget: WriteBudget,
    pub(super) waiting_requests: Vec<WaitingRequest>,
    pub(super) capture: Option<RunningCapture>,
    /// Start time of the current step.
    pub(super) step_time: Instant,
    /// Time at which the thread first noticed the end of the service.
    pub(super) end_seen: Option<Instant>,
    /// Function that measures the disk space of a folder.
    pub(super) disk_space: fn(&Path) -> Result<DiskSpace, RingError>,
}

/// Reason why a recording could not be kept.
#[derive(Debug, thiserror::Error)]
enum ArchiveError {
    #[error(transparent)]
    Extract(#[from] ExtractError),
    #[error(transparent)]
    Folder(#[from] RingError),
    #[error(transparent)]
    Budget(#[from] OverBudget),
    #[error("it would take {bytes} bytes, more than service.recordings.keep_mb allows")]
    TooLarge { bytes: u64 },
    #[error(
        "it would take {bytes} bytes, and what the disk has left is for results; make room on it"
    )]
    NoRoom { bytes: u64 },
}

impl Archive {
    pub(super) fn run(&mut self, requests: &Receiver<Request>, ending: &AtomicBool) {
        self.count();
        loop {
            let (request, ended) = match requests.recv_timeout(POLL_INTERVAL) {
                Ok(request) => (Some(request), false),
                Err(RecvTimeoutError::Timeout) => (None, ending.load(Ordering::Relaxed)),
                Err(RecvTimeoutError::Disconnected) => (None, true),
            };
            if ended {
                // If there is no sender, the wait above returns immediately.
                std::thread::sleep(FINAL_PAUSE);
            }
            if self.run_step(request, ended, Instant::now()) {
                return;
            }
        }
    }

    /// Takes a request, and keeps the recordings whose frames are available. Returns true if the
    /// end was requested and no request waits.
    pub(super) fn run_step(&mut self, request: Option<Request>, ended: bool, now: Instant) -> bool {
        self.step_time = now;
        if let Some(request) = request {
            self.take_request(request);
        }
        if ended {
            self.stop_capture();
        }
        self.watch_capture();
        self.end_seen = self.end_seen.or(ended.then_some(now));
        let over = ended && self.end_seen.is_some_and(|at| self.time_since(at) >= LAST_DELAY);
        let mut waiting = std::mem::take(&mut self.waiting_requests);
        waiting.retain(|one| !self.settle(one, over));
        self.waiting_requests.extend(waiting);
        ended && self.waiting_requests.is_empty()
    }

    fn time_since(&self, then: Instant) -> Duration {
        self.step_time.saturating_duration_since(then)
    }

    pub(super) fn take_request(&mut self, request: Request) {
        match request {
            Request::Result { number, window } => {
                let stretch = self.range_around(
                    (window.first_stamp_ns, self.options.before_s),
                    (window.last_stamp_ns, self.options.after_s),
                );
                self.add_waiting(Kind::Result, Some(number), "", stretch, window.to_map());
            }
            Request::Fault { cause, stamp_ns } => {
                let before = (stamp_ns, self.options.fault_before_s);
                // The ring may not reach back far enough, and a killed recorder loses its last
                // second. The available frames are sufficient.
                let last_ns = stamp_ns.saturating_sub(LOSS_MARGIN_NS);
                let stretch = self.range_around(before, (stamp_ns, self.options.after_s));
                let stretch = TimeRange { last_ns, ..stretch };
                let more = [
                    ("fault".to_owned(), cause.to_owned()),
                    ("fault_stamp_ns".to_owned(), stamp_ns.to_string()),
                ];
                self.add_waiting(Kind::Fault, None, cause, stretch, more.into());
            }
            Request::Start { name, answer } => {
                let started = self.start_capture(name);
                let runs = started.is_ok();
                // The requester may already have received the answer "busy", and would not know of
                // the capture.
                if answer.try_send(started).is_err() && runs {
                    self.capture = None;
                    lock(&self.shared.0).capture = None;
                }
            }
            Request::Stop { answer } => {
                let stopped = self.stop_capture().ok_or(CaptureError::NotRunning);
                let _ = answer.try_send(stopped);
            }
        }
    }

    fn range_around(&self, before: (u64, f64), after: (u64, f64)) -> TimeRange {
        let ns =
            |seconds: f64| u64::try_from(Duration::from_secs_f64(seconds).as_nanos()).unwrap_or(0);
        let ((first_ns, before_s), (last_ns, after_s)) = (before, after);
        TimeRange {
            from_ns: first_ns.saturating_sub(ns(before_s)),
            first_ns,
            last_ns,
            to_ns: last_ns.saturating_add(ns(after_s)),
        }
    }

    fn add_waiting(
        &mut self,
        kind: Kind,
        number: Option<u64>,
        label: &str,
        stretch: TimeRange,
        more: BTreeMap<String, String>,
    ) {
        if self.waiting_requests.len() >= QUEUE_CAPACITY {
            return self
                .shared
                .count_failure("a further request", &"too many requests wait for the ring");
        }
        let after = Duration::from_nanos(stretch.to_ns - stretch.last_ns);
        let deadline = self.step_time + after + RING_DELAY;
        let label = label.to_owned();
        self.waiting_requests.push(WaitingRequest {
            kind,
            number,
            label,
            time_range: stretch,
            metadata: more,
            deadline,
        });
    }

    fn start_capture(&mut self, name: String) -> Result<(), CaptureError> {
        if let Some(running) = &self.capture {
            return Err(CaptureError::Running(running.name.clone()));
        }
        let nothing = |why: String| CaptureError::NothingRecorded(why);
        let from_ns = newest_stamp(&self.ring).map_err(|error| nothing(error.to_string()))?;
        let from_ns = from_ns.ok_or_else(|| nothing("the ring is empty".to_owned()))?;
        lock(&self.shared.0).capture = Some(name.clone());
        self.capture = Some(RunningCapture {
            name,
            from_ns,
            since: self.step_time,
            size_checked: self.step_time,
        });
        Ok(())
    }

    /// Ends the capture and requests its recording, which includes the frames that reach the disk
    /// next.
    fn stop_capture(&mut self) -> Option<()> {
        let RunningCapture { name, from_ns, since, size_checked: _ } = self.capture.take()?;
        lock(&self.shared.0).capture = None;
        let length = u64::try_from(self.time_since(since).as_nanos()).unwrap_or(u64::MAX);
        // Frames of the bus may reach the disk up to a second later. The capture began with the
        // newest frames on disk at its start.
        let to_ns = from_ns.saturating_add(length).saturating_add(1_000_000_000);
        let stretch = TimeRange { from_ns, first_ns: from_ns, last_ns: from_ns, to_ns };
        let more = [("capture".to_owned(), name.clone())].into();
        lock(&self.shared.0).waiting += 1;
        self.add_waiting(Kind::Capture, None, &name, stretch, more);
        if let Some(waiting) = self.waiting_requests.last_mut() {
            waiting.deadline = self.step_time + RING_DELAY;
        }
        Some(())
    }

    /// Stops a capture before the ring removes its beginning, and before it gets too long.
    fn watch_capture(&mut self) {
        let now = self.step_time;
        let Some(capture) = &mut self.capture else { return };
        if now.saturating_duration_since(capture.size_checked) < DISK_POLL_INTERVAL {
            return;
        }
        capture.size_checked = now;
        let length = now.saturating_duration_since(capture.since);
        let too_long = length.as_secs_f64() > self.options.capture_max_s;
        let from_ns = capture.from_ns;
        let so_far = TimeRange { from_ns, first_ns: from_ns, last_ns: from_ns, to_ns: u64::MAX };
        let most = self.options.ring_bytes().min(self.options.keep_bytes()) / 2;
        let too_large = match find(&self.ring, so_far, RunChoice::Latest) {
            Ok(Some(found)) => found.bytes(&self.curves) > most,
            _ => false,
        };
        if too_long || too_large {
            let why = if too_long { "capture_max_s" } else { "half of the ring" };
            tracing::warn!("the capture `{}` is stopped at {why}", capture.name);
            self.stop_capture();
        }
    }

    /// Extracts the requested frames, or counts a failure. Returns false if the request still has
    /// to wait.
    fn settle(&self, one: &WaitingRequest, ended: bool) -> bool {
        let over = ended || self.step_time >= one.deadline;
        let run_found = match find(
            &self.ring,
            one.time_range,
            if over { RunChoice::Any } else { RunChoice::Latest },
        ) {
            Ok(Some(found)) if over || found.newest_ns > one.time_range.to_ns => Ok(found),
            Ok(None) if over => Err(ExtractError::NotThere.into()),
            Err(error) if over => Err(error.into()),
            _ => return false,
        };
        let archived = run_found.and_then(|found| {
            let folder =
                ArchiveFolder::open(&self.folder, self.options.keep, self.options.keep_bytes())?;
            let bytes = found.bytes(&self.curves);
            if (self.disk_space)(&self.folder)?.spare_bytes < bytes {
                return Err(ArchiveError::NoRoom { bytes });
            }
            let kind = match one.kind {
                Kind::Result => WriteKind::ResultRecordings,
                Kind::Fault | Kind::Capture => WriteKind::OtherRecordings,
            };
            self.budget.check(kind, bytes, Timestamp::now())?;
            if !folder.make_room(bytes)? {
                return Err(ArchiveError::TooLarge { bytes });
            }
            let number = one.number.map_or_else(|| folder.next(one.kind), Ok)?;
            let path = folder.path(one.kind, number, &one.label);
            let frames = extract(&found, &path, &one.metadata, &self.curves)?;
            let written = std::fs::metadata(&path).map_or(bytes, |data| data.len());
            self.budget.count(kind, written, Timestamp::now());
            folder.prune(one.kind)?;
            Ok((path, frames))
        });
        match archived {
            Ok((path, frames)) => {
                tracing::info!(frames, "recording {} is kept", path.display());
                let mut status = lock(&self.shared.0);
                status.waiting = status.waiting.saturating_sub(1);
                status.fixed += 1;
            }
            Err(error) => self.shared.count_failure(&request_text(one), &error),
        }
        self.count();
        true
    }

    fn count(&self) {
        if let Ok((files, bytes)) = count(&self.folder, &self.options) {
            let mut status = lock(&self.shared.0);
            (status.files, status.bytes) = (files, bytes);
        }
    }
}

fn count(folder: &Path, options: &RecordingOptions) -> Result<(usize, u64), RingError> {
    ArchiveFolder::open(folder, options.keep, options.keep_bytes())?.total_size()
}

fn request_text(one: &WaitingRequest) -> String {
    match (one.kind, one.number) {
        (Kind::Result, number) => format!("result {}", number.unwrap_or(0)),
        (Kind::Fault, _) => format!("the fault `{}`", one.label),
        (Kind::Capture, _) => format!("the capture `{}`", one.label),
    }
}
