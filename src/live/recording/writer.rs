//! The recorder's thread. It writes frames into files, and adds the files to the ring.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use didim_drivers::frame::Frame;
use didim_drivers::socket::clock_pair;
use didim_drivers::source::mcap::{McapInfo, McapWriteError};
use didim_drivers::source::{McapWriter, StampClock};
use rtrb::Consumer;

use super::budget::{OverBudget, WriteKind};
use super::options::RecorderOptions;
use super::output::Output;
use super::ring::{DiskSpace, Ring, RingError, disk_space};
use super::status::{RecordingState, SharedRecording};
use super::tap::RecordedFrame;
use crate::archive::store::Timestamp;

/// Interval at which the queue is emptied.
const EMPTYING_INTERVAL: Duration = Duration::from_millis(20);
/// Maximum interval at which a chunk is passed to the file system. A killed process therefore loses
/// less than a second of frames.
const FLUSH_INTERVAL: Duration = Duration::from_millis(500);
/// Shortest and longest pause between two attempts after a failure.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(60);
/// Smallest and largest file size \[bytes\]. Between these limits, a file has an eighth of the
/// ring's size.
const SMALLEST_SEGMENT: u64 = 100_000;
const LARGEST_SEGMENT: u64 = 64_000_000;
/// Time to wait for the file system to free the space of a removed file.
const SPACE_RELEASE_TIMEOUT: Duration = Duration::from_secs(1);
/// Pause after the budget of a day is used up. The bytes of an hour are free again at a time.
const BUDGET_PAUSE: Duration = Duration::from_secs(600);
/// Maximum number of bytes that closing a chunk adds to a file \[bytes\].
const CHUNK_RESERVE: u64 = 4096;

/// Reason why no frames are written.
#[derive(Debug, thiserror::Error)]
enum WritingError {
    #[error(transparent)]
    Ring(#[from] RingError),
    #[error("{}: {source}; free disk space, or correct the permissions", path.display())]
    Write { path: PathBuf, source: McapWriteError },
    #[error("the ring of {limit} bytes has no room for one file: raise service.recordings.ring_mb")]
    TooSmall { limit: u64 },
    #[error(transparent)]
    Budget(#[from] OverBudget),
    #[error(
        "the disk of {} is nearly full, and the ring was deleted to leave room for results; free \
         disk space",
        folder.display()
    )]
    Short { folder: PathBuf },
}

impl WritingError {
    fn is_full(&self) -> bool {
        match self {
            Self::Ring(error) => error.is_full(),
            Self::Write { source, .. } => source.is_full(),
            Self::TooSmall { .. } | Self::Short { .. } | Self::Budget(_) => false,
        }
    }
}

/// State of the thread.
pub(super) struct RingWriter {
    options: RecorderOptions,
    info: McapInfo,
    clock: StampClock,
    shared: SharedRecording,
    /// The ring. `None` before it is opened, and after a failure.
    ring: Option<Ring>,
    current_segment: Option<CurrentSegment>,
    /// Time of the next attempt after a failure.
    retry: Option<Instant>,
    retry_pause: Duration,
    /// Time of the last check of the disk space.
    space_checked: Instant,
    /// Time at which files were last removed, if the file system has not freed their space yet.
    removed_segments: Option<Instant>,
    /// Start time of the current step.
    step_time: Instant,
    /// Function that measures the disk space of a folder.
    pub(super) disk_space: fn(&Path) -> Result<DiskSpace, RingError>,
}

/// The file being written.
struct CurrentSegment {
    writer: McapWriter<Box<dyn Output>>,
    path: PathBuf,
    /// Size at which the file is closed \[bytes\].
    max_bytes: u64,
    opened: Instant,
    flushed_at: Instant,
    first_log_time: u64,
}

impl RingWriter {
    pub(super) fn new(
        options: RecorderOptions,
        info: McapInfo,
        clock: StampClock,
        shared: SharedRecording,
        now: Instant,
    ) -> Self {
        Self {
            options,
            info,
            clock,
            shared,
            ring: None,
            current_segment: None,
            retry: None,
            retry_pause: FIRST_PAUSE,
            space_checked: now,
            step_time: now,
            removed_segments: None,
            disk_space,
        }
    }

    pub(super) fn run(&mut self, frames: &mut Consumer<RecordedFrame>) {
        self.start();
        while !self.run_step(frames, Instant::now()) {
            std::thread::sleep(EMPTYING_INTERVAL);
        }
    }

    /// Opens the ring before the first frame arrives, which repairs the files of an earlier run.
    fn start(&mut self) {
        let opened = self.open_ring().map(drop);
        self.handle_result(opened);
    }

    /// Writes the waiting frames. Returns true if they were the last ones.
    pub(super) fn run_step(&mut self, frames: &mut Consumer<RecordedFrame>, now: Instant) -> bool {
        self.step_time = now;
        // The end is checked before the queue is emptied, so that the queue then contains all
        // frames before the end.
        let ended = frames.is_abandoned();
        while let Ok(recorded) = frames.pop() {
            self.write_frame(&recorded);
        }
        let tended = self.do_due_work(ended);
        self.handle_result(tended);
        self.publish(ended);
        ended
    }

    fn write_frame(&mut self, recorded: &RecordedFrame) {
        let written = if self.retry.is_some_and(|at| self.step_time < at) {
            Ok(false)
        } else {
            self.write(&recorded.frame, recorded.sequence).map(|()| true)
        };
        match written {
            Ok(true) => {
                let mut status = self.shared.update();
                status.frames_recorded += 1;
                if status.state != RecordingState::Recording {
                    status.state = RecordingState::Recording;
                }
                drop(status);
                self.retry = None;
            }
            Ok(false) => drop(self.shared.unrecorded.fetch_add(1, Ordering::Relaxed)),
            Err(error) => {
                self.shared.unrecorded.fetch_add(1, Ordering::Relaxed);
                self.handle_result(Err(error));
            }
        }
    }

    /// Handles the result of a step. After a failure, the ring is opened again later.
    fn handle_result(&mut self, done: Result<(), WritingError>) {
        let Err(error) = done else { return };
        // If the disk is full, the oldest file is removed, because new frames are more valuable.
        let waits = error.is_full() && self.waits_for_room();
        let disk_space = error.is_full() && !waits && self.remove_oldest().unwrap_or(false);
        // The chunks written so far are on disk. The next attempt repairs the file.
        self.current_segment = None;
        self.ring = None;
        if waits {
            self.retry = Some(self.step_time + SPACE_RELEASE_TIMEOUT);
        }
        if disk_space || waits {
            return;
        }
        let is_budget = matches!(error, WritingError::Budget(_));
        let pause = if is_budget { BUDGET_PAUSE } else { self.retry_pause };
        if self.shared.update().why != Some(error.to_string()) || !is_budget {
            tracing::warn!("recording stops for {} s: {error}", pause.as_secs());
        }
        self.retry = Some(self.step_time + pause);
        self.retry_pause = (2 * self.retry_pause).min(LONGEST_PAUSE);
        let mut status = self.shared.update();
        status.write_errors += 1;
        (status.state, status.why) = (RecordingState::Failed, Some(error.to_string()));
    }

    /// Removes files while the free disk space is below the reserve for results: first the oldest
    /// files, and finally the one being written. The file system may free the space of a removed
    /// file with a delay, so the next removal waits for that.
    fn give_way(&mut self) -> Result<(), WritingError> {
        if self.ring.is_none() {
            return Ok(());
        }
        while self.spare_space()? == 0 {
            if self.waits_for_room() {
                return Ok(());
            }
            if !self.remove_oldest()? {
                break;
            }
        }
        if self.spare_space()? == 0
            && let Some(current) = self.current_segment.take()
        {
            let path = current.path.clone();
            drop(current);
            if std::fs::remove_file(path).is_ok() {
                self.count_given_way();
            }
        }
        let (free, written) =
            (self.spare_space()?, self.current_segment.as_ref().map_or(0, |c| c.writer.bytes()));
        let Some(ring) = &self.ring else { return Ok(()) };
        let wanted = ring.byte_limit().saturating_sub(ring.bytes().saturating_add(written));
        self.shared.update().gives_way &= free < wanted;
        if free == 0 {
            return Err(WritingError::Short { folder: self.options.folder.clone() });
        }
        Ok(())
    }

    /// Returns the free disk space after the reserve for results \[bytes\].
    fn spare_space(&self) -> Result<u64, RingError> {
        Ok((self.disk_space)(&self.options.folder)?.spare_bytes)
    }

    fn time_since(&self, then: Instant) -> Duration {
        self.step_time.saturating_duration_since(then)
    }

    fn waits_for_room(&self) -> bool {
        self.removed_segments.is_some_and(|at| self.time_since(at) < SPACE_RELEASE_TIMEOUT)
    }

    /// Removes the oldest file. Returns false if there is no file.
    fn remove_oldest(&mut self) -> Result<bool, RingError> {
        let Some(ring) = &mut self.ring else { return Ok(false) };
        let before = (self.disk_space)(&self.options.folder)?.free_bytes;
        if !ring.remove_oldest()? {
            return Ok(false);
        }
        let is_free = (self.disk_space)(&self.options.folder)?.free_bytes > before;
        self.removed_segments = (!is_free).then_some(self.step_time);
        self.count_given_way();
        Ok(true)
    }

    fn count_given_way(&self) {
        tracing::warn!(
            "{}: the disk is nearly full: a file of the ring was deleted; free disk space",
            self.options.folder.display()
        );
        let mut status = self.shared.update();
        status.segments_given_way += 1;
        status.gives_way = true;
    }

    fn open_ring(&mut self) -> Result<&mut Ring, WritingError> {
        let ring = match self.ring.take() {
            Some(ring) => ring,
            None => {
                let ring = Ring::open(&self.options.folder, self.options.ring_bytes)?;
                self.shared.update().segments_repaired += ring.repaired_count();
                ring
            }
        };
        Ok(self.ring.insert(ring))
    }

    fn write(&mut self, frame: &Frame, sequence: u32) -> Result<(), WritingError> {
        if self.current_segment.as_ref().is_some_and(|current| {
            current.writer.frames() > 0 && current.writer.bytes() >= current.max_bytes
        }) {
            self.close(true)?;
        }
        if self.current_segment.is_none() {
            self.begin(frame.stamp_ns)?;
        }
        if !self.make_room(frame)? {
            // The ring consists only of the current file. It is closed, so that the next file may
            // replace it.
            self.close(false)?;
            self.begin(frame.stamp_ns)?;
            if !self.make_room(frame)? {
                return Err(WritingError::TooSmall { limit: self.options.ring_bytes });
            }
        }
        let Some(current) = &mut self.current_segment else { return Ok(()) };
        let written = current.writer.write(frame, sequence);
        written.map_err(|source| WritingError::Write { path: current.path.clone(), source })
    }

    /// Removes old files to make space for a frame, and for the chunk that the frame may complete.
    fn make_room(&mut self, frame: &Frame) -> Result<bool, WritingError> {
        let (Some(current), Some(ring)) = (&self.current_segment, &mut self.ring) else {
            return Ok(true);
        };
        let frame = McapWriter::<Box<dyn Output>>::frame_bytes(frame);
        Ok(ring.make_room(current.writer.bytes() + frame + CHUNK_RESERVE)?)
    }

    fn begin(&mut self, stamp_ns: u64) -> Result<(), WritingError> {
        let mut info = self.info.clone();
        // Each file has its own clock offset, because the wall clock may be set between two files.
        let now = clock_pair();
        info.offset_ns = match self.clock {
            StampClock::Realtime => now.realtime_ns.wrapping_sub(now.monotonic_ns).cast_signed(),
            StampClock::Bus => now.realtime_ns.wrapping_sub(stamp_ns).cast_signed(),
            StampClock::Own => info.offset_ns,
        };
        let create = std::sync::Arc::clone(&self.options.create);
        self.open_ring()?;
        self.give_way()?;
        let budget =
            self.options.budget.check(WriteKind::Ring, SMALLEST_SEGMENT, Timestamp::now())?;
        let path = self.open_ring()?.next_path();
        let failed = |source| WritingError::Write { path: path.clone(), source };
        let file = create(&path).map_err(|error| failed(McapWriteError::Output(error)))?;
        let writer = McapWriter::new(file, &info).map_err(failed)?;
        let now = self.step_time;
        // If the disk has too little space for the ring, the ring uses the available space.
        let spare = self.spare_space()?;
        let ring = self.open_ring()?;
        let disk_space = ring.byte_limit().min(ring.bytes().saturating_add(spare));
        let largest = (disk_space / 8).clamp(SMALLEST_SEGMENT, LARGEST_SEGMENT);
        self.current_segment = Some(CurrentSegment {
            writer,
            max_bytes: largest.min(budget),
            path,
            opened: now,
            flushed_at: now,
            first_log_time: info.log_time(stamp_ns),
        });
        Ok(())
    }

    /// Closes chunks and files that are due, and frees space for results.
    fn do_due_work(&mut self, ended: bool) -> Result<(), WritingError> {
        if self.time_since(self.space_checked) >= FLUSH_INTERVAL {
            self.space_checked = self.step_time;
            self.give_way()?;
        }
        let (segment, now) = (self.options.segment, self.step_time);
        let Some(current) = &mut self.current_segment else { return Ok(()) };
        let failed = |path: &Path, source| WritingError::Write { path: path.to_owned(), source };
        if ended || now.saturating_duration_since(current.opened) >= segment {
            return self.close(!ended);
        }
        let (bytes, time) = (current.writer.bytes(), Timestamp::now());
        if let Err(over) = self.options.budget.check(WriteKind::Ring, bytes, time) {
            self.close(true)?;
            return Err(over.into());
        }
        if now.saturating_duration_since(current.flushed_at) >= FLUSH_INTERVAL {
            current.flushed_at = now;
            current.writer.flush().map_err(|error| failed(&current.path, error))?;
            // Writing has succeeded again.
            self.retry_pause = FIRST_PAUSE;
        }
        Ok(())
    }

    /// Closes the file. `sync` is false at the end of the service: the kernel has all data, and the
    /// end does not wait for the disk.
    fn close(&mut self, sync: bool) -> Result<(), WritingError> {
        let (Some(current), Some(ring)) = (self.current_segment.take(), &mut self.ring) else {
            return Ok(());
        };
        self.options.budget.count(WriteKind::Ring, current.writer.bytes(), Timestamp::now());
        let path = current.path;
        let failed = |source| WritingError::Write { path: path.clone(), source };
        let mut file = current.writer.finish().map_err(failed)?;
        let closed = if sync { file.sync() } else { file.flush() };
        closed.map_err(|error| failed(McapWriteError::Output(error)))?;
        drop(file);
        ring.add(Some(current.first_log_time))?;
        ring.make_room(0)?;
        Ok(())
    }

    fn publish(&mut self, ended: bool) {
        let newest = match self.clock {
            StampClock::Realtime | StampClock::Bus => Some(clock_pair().realtime_ns),
            StampClock::Own => None,
        };
        // This call may read a file, so the status must not be locked during the call.
        let oldest = self.ring.as_mut().and_then(Ring::oldest_log_time);
        let written = self.options.budget.status(Timestamp::now());
        if ended {
            self.options.budget.save();
        }
        let mut status = self.shared.update();
        status.written = written;
        if let Some(ring) = &self.ring {
            let current = self.current_segment.as_ref();
            status.ring_bytes = ring.bytes() + current.map_or(0, |current| current.writer.bytes());
            status.segments = ring.complete_files().len() + usize::from(current.is_some());
            let oldest = oldest.or(current.map(|current| current.first_log_time));
            status.oldest_s = newest
                .zip(oldest)
                .map(|(newest, oldest)| 1e-9 * newest.saturating_sub(oldest) as f64);
        }
        if ended && status.state != RecordingState::Failed {
            status.state = RecordingState::Ended;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::options::RecordingOptions;
    use super::*;

    #[test]
    fn the_ring_does_not_go_at_once_where_room_is_free_only_later() {
        let folder = tempfile::tempdir().unwrap();
        let options =
            RecorderOptions::new(&RecordingOptions::default(), folder.path(), "cell", "c0ffee");
        let ring = options.folder.clone();
        std::fs::create_dir(&ring).unwrap();
        for n in 0..4 {
            std::fs::write(ring.join(format!("segment-0000000{n}.mcap")), "x").unwrap();
        }
        let files = || std::fs::read_dir(&ring).unwrap().count();
        let (info, shared) = (McapInfo::default(), SharedRecording::default());
        let mut writer =
            RingWriter::new(options, info, StampClock::Own, shared.clone(), Instant::now());
        writer.disk_space = |_| Ok(DiskSpace { free_bytes: 0, spare_bytes: 0 });
        writer.open_ring().unwrap();
        writer.give_way().unwrap();
        assert!(writer.removed_segments.is_some() && files() == 3);
        let lately = writer.removed_segments;
        writer.give_way().unwrap();
        assert_eq!(files(), 3);
        // Nor if writing is refused.
        let full = |folder: &Path| {
            let (path, cause) = (folder.to_owned(), std::io::ErrorKind::StorageFull.into());
            Err(WritingError::Ring(RingError::Io { action: "write", path, cause }))
        };
        writer.handle_result(full(&ring));
        assert!(writer.retry.is_some() && files() == 3);
        for free in (0..3).rev() {
            writer.removed_segments = None;
            writer.open_ring().unwrap();
            writer.handle_result(full(&ring));
            assert!(writer.removed_segments.is_some() && files() == free);
            writer.open_ring().unwrap();
            writer.removed_segments = lately;
            writer.handle_result(full(&ring));
            assert_eq!(files(), free);
        }
        let status = shared.snapshot();
        assert_eq!((status.segments_given_way, status.write_errors), (4, 0));
        // Without a file there is nothing to wait for.
        writer.removed_segments = None;
        writer.open_ring().unwrap();
        assert!(matches!(writer.give_way(), Err(WritingError::Short { .. })));
    }
}
