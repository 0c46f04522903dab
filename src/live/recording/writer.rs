//! The recorder's thread: it writes frames into files, and files into the ring.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use didim_drivers::frame::Frame;
use didim_drivers::socket::clock_pair;
use didim_drivers::source::mcap::{McapInfo, McapWriteError};
use didim_drivers::source::{McapWriter, StampClock};
use rtrb::Consumer;

use super::options::RecorderOptions;
use super::output::Output;
use super::ring::{DiskSpace, Ring, RingError, disk_space};
use super::status::{RecordingState, SharedRecording};
use super::tap::RecordedFrame;

/// Interval at which the queue is emptied.
const EMPTYING_INTERVAL: Duration = Duration::from_millis(20);
/// Maximum interval at which a chunk is passed to the file system. A killed process therefore loses
/// less than a second.
const FLUSH_INTERVAL: Duration = Duration::from_millis(500);
/// Pauses between attempts after a failure.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(60);
/// Bounds of the file size \[bytes\]: within them, a file is closed at an eighth of the ring.
const SMALLEST_SEGMENT: u64 = 100_000;
const LARGEST_SEGMENT: u64 = 64_000_000;
/// Maximum time until the space of a removed file is free.
const SPACE_CHECK_INTERVAL: Duration = Duration::from_secs(1);
/// Maximum number of bytes that closing a chunk adds to a file \[bytes\].
const CHUNK_ROOM: u64 = 4096;

/// Reason why nothing is written.
#[derive(Debug, thiserror::Error)]
enum WritingError {
    #[error(transparent)]
    Ring(#[from] RingError),
    #[error("{}: {source}; free disk space, or correct the permissions", path.display())]
    Write { path: PathBuf, source: McapWriteError },
    #[error("the ring of {limit} bytes has no room for one file: raise service.recordings.ring_mb")]
    TooSmall { limit: u64 },
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
            Self::TooSmall { .. } | Self::Short { .. } => false,
        }
    }
}

/// State of the thread.
pub(super) struct RingWriter {
    options: RecorderOptions,
    info: McapInfo,
    clock: StampClock,
    shared: SharedRecording,
    /// `None` before it is opened, and after a failure.
    ring: Option<Ring>,
    current: Option<Current>,
    /// Time of the next attempt after a failure.
    retry: Option<Instant>,
    pause: Duration,
    /// Time of the last check of the disk space.
    polled: Instant,
    /// Time of the removal of a file whose space is not free yet.
    gave_way: Option<Instant>,
    /// Start time of this step.
    now: Instant,
    /// Function that measures the disk space of a folder.
    pub(super) disk_space: fn(&Path) -> Result<DiskSpace, RingError>,
}

/// The file being written.
struct Current {
    writer: McapWriter<Box<dyn Output>>,
    path: PathBuf,
    /// Size at which it is closed \[bytes\].
    largest: u64,
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
            current: None,
            retry: None,
            pause: FIRST_PAUSE,
            polled: now,
            now,
            gave_way: None,
            disk_space,
        }
    }

    pub(super) fn run(&mut self, mut frames: Consumer<RecordedFrame>) {
        self.start();
        while !self.turn(&mut frames, Instant::now()) {
            std::thread::sleep(EMPTYING_INTERVAL);
        }
    }

    /// Closes the files of an earlier run before the first frame comes.
    fn start(&mut self) {
        let opened = self.open_ring().map(drop);
        self.note(opened);
    }

    /// Writes the waiting frames. Returns true if they were the last.
    pub(super) fn turn(&mut self, frames: &mut Consumer<RecordedFrame>, now: Instant) -> bool {
        self.now = now;
        // Checked before the queue is emptied: the frames before the end are then in it.
        let ended = frames.is_abandoned();
        while let Ok(recorded) = frames.pop() {
            self.take(&recorded);
        }
        let tended = self.tend(ended);
        self.note(tended);
        self.publish(ended);
        ended
    }

    fn take(&mut self, recorded: &RecordedFrame) {
        let written = if self.retry.is_some_and(|at| self.now < at) {
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
                self.note(Err(error));
            }
        }
    }

    /// Handles a failure: everything is reopened later.
    fn note(&mut self, done: Result<(), WritingError>) {
        let Err(error) = done else { return };
        // A full disk needs free space: the oldest file is worth less than new frames.
        let waits = error.is_full() && self.waits_for_room();
        let disk_space = error.is_full() && !waits && self.remove_oldest().unwrap_or(false);
        // The chunks written so far are on disk. The next attempt closes the file.
        self.current = None;
        self.ring = None;
        if waits {
            self.retry = Some(self.now + SPACE_CHECK_INTERVAL);
        }
        if disk_space || waits {
            return;
        }
        tracing::warn!("recording stops for {} s: {error}", self.pause.as_secs());
        self.retry = Some(self.now + self.pause);
        self.pause = (2 * self.pause).min(LONGEST_PAUSE);
        let mut status = self.shared.update();
        status.write_errors += 1;
        (status.state, status.why) = (RecordingState::Failed, Some(error.to_string()));
    }

    /// Removes the oldest files, and finally the one being written, while the free disk space is
    /// below the reserve for results. The space of a removed file may become free only later, and
    /// the next removal waits for that.
    fn give_way(&mut self) -> Result<(), WritingError> {
        if self.ring.is_none() {
            return Ok(());
        }
        while self.spare()? == 0 {
            if self.waits_for_room() {
                return Ok(());
            }
            if !self.remove_oldest()? {
                break;
            }
        }
        if self.spare()? == 0
            && let Some(current) = self.current.take()
        {
            let path = current.path.clone();
            drop(current);
            if std::fs::remove_file(path).is_ok() {
                self.count_given_way();
            }
        }
        let (free, written) =
            (self.spare()?, self.current.as_ref().map_or(0, |c| c.writer.bytes()));
        let Some(ring) = &self.ring else { return Ok(()) };
        let wanted = ring.limit().saturating_sub(ring.bytes().saturating_add(written));
        self.shared.update().gives_way &= free < wanted;
        if free == 0 {
            return Err(WritingError::Short { folder: self.options.folder.clone() });
        }
        Ok(())
    }

    /// Returns the free disk space beyond the reserve for results \[bytes\].
    fn spare(&self) -> Result<u64, RingError> {
        Ok((self.disk_space)(&self.options.folder)?.spare)
    }

    fn since(&self, then: Instant) -> Duration {
        self.now.saturating_duration_since(then)
    }

    fn waits_for_room(&self) -> bool {
        self.gave_way.is_some_and(|at| self.since(at) < SPACE_CHECK_INTERVAL)
    }

    /// Removes the oldest file. Returns false if there is none.
    fn remove_oldest(&mut self) -> Result<bool, RingError> {
        let Some(ring) = &mut self.ring else { return Ok(false) };
        let before = (self.disk_space)(&self.options.folder)?.free;
        if !ring.remove_oldest()? {
            return Ok(false);
        }
        let is_free = (self.disk_space)(&self.options.folder)?.free > before;
        self.gave_way = (!is_free).then_some(self.now);
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
                self.shared.update().segments_repaired += ring.repaired();
                ring
            }
        };
        Ok(self.ring.insert(ring))
    }

    fn write(&mut self, frame: &Frame, sequence: u32) -> Result<(), WritingError> {
        if self.current.as_ref().is_some_and(|current| {
            current.writer.frames() > 0 && current.writer.bytes() >= current.largest
        }) {
            self.close(true)?;
        }
        if self.current.is_none() {
            self.begin(frame.stamp_ns)?;
        }
        if !self.make_room(frame)? {
            // A small ring consists of this file only: the next one may replace it.
            self.close(false)?;
            self.begin(frame.stamp_ns)?;
            if !self.make_room(frame)? {
                return Err(WritingError::TooSmall { limit: self.options.ring_bytes });
            }
        }
        let Some(current) = &mut self.current else { return Ok(()) };
        let written = current.writer.write(frame, sequence);
        written.map_err(|source| WritingError::Write { path: current.path.clone(), source })
    }

    /// Removes old files to make space for a frame and the chunk that it may close.
    fn make_room(&mut self, frame: &Frame) -> Result<bool, WritingError> {
        let (Some(current), Some(ring)) = (&self.current, &mut self.ring) else { return Ok(true) };
        let frame = McapWriter::<Box<dyn Output>>::frame_bytes(frame);
        Ok(ring.make_room(current.writer.bytes() + frame + CHUNK_ROOM)?)
    }

    fn begin(&mut self, stamp_ns: u64) -> Result<(), WritingError> {
        let mut info = self.info.clone();
        // One offset for each file: the wall clock may be set between two of them.
        if self.clock == StampClock::Realtime {
            let now = clock_pair();
            info.offset_ns = now.realtime_ns.wrapping_sub(now.monotonic_ns).cast_signed();
        }
        let create = std::sync::Arc::clone(&self.options.create);
        self.open_ring()?;
        self.give_way()?;
        let path = self.open_ring()?.next_path();
        let failed = |source| WritingError::Write { path: path.clone(), source };
        let file = create(&path).map_err(|error| failed(McapWriteError::Output(error)))?;
        let writer = McapWriter::new(file, &info).map_err(failed)?;
        let now = self.now;
        // If the disk has too little space for the ring, the ring size is the available space.
        let spare = self.spare()?;
        let ring = self.open_ring()?;
        let disk_space = ring.limit().min(ring.bytes().saturating_add(spare));
        let largest = (disk_space / 8).clamp(SMALLEST_SEGMENT, LARGEST_SEGMENT);
        self.current = Some(Current {
            writer,
            largest,
            path,
            opened: now,
            flushed_at: now,
            first_log_time: info.log_time(stamp_ns),
        });
        Ok(())
    }

    /// Closes chunks and files when they are due, and frees space for results.
    fn tend(&mut self, ended: bool) -> Result<(), WritingError> {
        if self.since(self.polled) >= FLUSH_INTERVAL {
            self.polled = self.now;
            self.give_way()?;
        }
        let (segment, now) = (self.options.segment, self.now);
        let Some(current) = &mut self.current else { return Ok(()) };
        let failed = |path: &Path, source| WritingError::Write { path: path.to_owned(), source };
        if ended || now.saturating_duration_since(current.opened) >= segment {
            return self.close(!ended);
        }
        if now.saturating_duration_since(current.flushed_at) >= FLUSH_INTERVAL {
            current.flushed_at = now;
            current.writer.flush().map_err(|error| failed(&current.path, error))?;
            // It writes again.
            self.pause = FIRST_PAUSE;
        }
        Ok(())
    }

    /// Closes the file. At the end of the service nothing waits for the disk: the kernel has all
    /// the data.
    fn close(&mut self, sync: bool) -> Result<(), WritingError> {
        let (Some(current), Some(ring)) = (self.current.take(), &mut self.ring) else {
            return Ok(());
        };
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
            StampClock::Realtime => Some(clock_pair().realtime_ns),
            StampClock::Own => None,
        };
        // This may read a file, and must not run while the status is locked.
        let oldest = self.ring.as_mut().and_then(Ring::oldest_log_time);
        let mut status = self.shared.update();
        if let Some(ring) = &self.ring {
            let current = self.current.as_ref();
            status.ring_bytes = ring.bytes() + current.map_or(0, |current| current.writer.bytes());
            status.segments = ring.complete().len() + usize::from(current.is_some());
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
        writer.disk_space = |_| Ok(DiskSpace { free: 0, spare: 0 });
        writer.open_ring().unwrap();
        writer.give_way().unwrap();
        assert!(writer.gave_way.is_some() && files() == 3);
        let lately = writer.gave_way;
        writer.give_way().unwrap();
        assert_eq!(files(), 3);
        // Nor if writing is refused.
        let full = |folder: &Path| {
            let (path, cause) = (folder.to_owned(), std::io::ErrorKind::StorageFull.into());
            Err(WritingError::Ring(RingError::Io { action: "write", path, cause }))
        };
        writer.note(full(&ring));
        assert!(writer.retry.is_some() && files() == 3);
        for free in (0..3).rev() {
            writer.gave_way = None;
            writer.open_ring().unwrap();
            writer.note(full(&ring));
            assert!(writer.gave_way.is_some() && files() == free);
            writer.open_ring().unwrap();
            writer.gave_way = lately;
            writer.note(full(&ring));
            assert_eq!(files(), free);
        }
        let status = shared.snapshot();
        assert_eq!((status.segments_given_way, status.write_errors), (4, 0));
        // Without a file there is nothing to wait for.
        writer.gave_way = None;
        writer.open_ring().unwrap();
        assert!(matches!(writer.give_way(), Err(WritingError::Short { .. })));
    }
}
