//! The thread that writes the ring.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use didim_drivers::frame::Frame;
use didim_drivers::socket::clock_pair;
use didim_drivers::source::mcap::{McapInfo, McapWriteError};
use didim_drivers::source::{InterfaceName, McapWriter, StampClock};
use rtrb::Consumer;

use super::options::{RecordingOptions, ring_folder};
use super::output::{CreateOutput, Output, create_file};
use super::ring::{Ring, RingError};
use super::status::{RecordingState, SharedRecording};
use super::tap::{FrameTap, Recorded, frame_queue};

/// How often the queue is emptied.
const TURN: Duration = Duration::from_millis(20);
/// A chunk is handed to the file system at least this often, so that less than a second is lost when
/// the process is killed.
const FLUSH_EVERY: Duration = Duration::from_millis(500);
/// Pauses between attempts after a failure.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(60);
/// How long the end of the bus waits for the last file.
const FINISH_TIMEOUT: Duration = Duration::from_secs(3);
/// A file is closed at this size \[bytes\], or at an eighth of the ring.
const LARGEST_SEGMENT: u64 = 64_000_000;

/// What the recorder needs.
#[derive(Clone)]
pub struct RecorderOptions {
    /// Folder of the ring.
    pub folder: PathBuf,
    /// The most that it takes \[bytes\].
    pub ring_bytes: u64,
    /// A file is closed after this long.
    pub segment: Duration,
    /// Name of the cell.
    pub cell: String,
    /// Hash of its configuration.
    pub configuration: String,
    /// How files are made.
    pub create: CreateOutput,
}

impl RecorderOptions {
    /// Those of a cell, whose recordings are in `folder`.
    pub fn new(options: &RecordingOptions, folder: &Path, cell: &str, configuration: &str) -> Self {
        Self {
            folder: ring_folder(folder),
            ring_bytes: options.ring_bytes(),
            segment: Duration::from_secs_f64(options.segment_s),
            cell: cell.to_owned(),
            configuration: configuration.to_owned(),
            create: std::sync::Arc::new(create_file),
        }
    }
}

impl core::fmt::Debug for RecorderOptions {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("RecorderOptions").field("folder", &self.folder).finish_non_exhaustive()
    }
}

/// A running recorder.
#[derive(Debug)]
pub struct Recorder {
    thread: JoinHandle<()>,
    shared: SharedRecording,
}

impl Recorder {
    /// Starts the thread. The tap goes to the bus thread; where that drops it, the recorder ends.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(
        options: RecorderOptions,
        interfaces: &[InterfaceName],
        clock: StampClock,
    ) -> std::io::Result<(Self, FrameTap)> {
        let (tap, frames, unrecorded) = frame_queue(None);
        let shared = SharedRecording { unrecorded, ..SharedRecording::default() };
        shared.update().ring_limit_bytes = options.ring_bytes;
        let now = clock_pair();
        let info = McapInfo {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            cell: options.cell.clone(),
            configuration: options.configuration.clone(),
            run: format!("{:x}-{}", now.realtime_ns, std::process::id()),
            interfaces: interfaces.to_vec(),
            ..McapInfo::default()
        };
        let mut writing = Writing {
            options,
            info,
            clock,
            shared: shared.clone(),
            ring: None,
            current: None,
            retry: None,
            pause: FIRST_PAUSE,
        };
        let thread = std::thread::Builder::new()
            .name("recorder".into())
            .spawn(move || writing.run(frames))?;
        Ok((Self { thread, shared }, tap))
    }

    /// The counts.
    pub fn shared(&self) -> &SharedRecording {
        &self.shared
    }

    /// After the tap is gone: waits for the last file to be closed, for a while.
    pub fn finish(self) {
        let since = Instant::now();
        while !self.thread.is_finished() {
            if since.elapsed() > FINISH_TIMEOUT {
                tracing::warn!("the recording is not closed within {FINISH_TIMEOUT:?}");
                return;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

/// Why nothing is written.
#[derive(Debug, thiserror::Error)]
enum WritingError {
    #[error(transparent)]
    Ring(#[from] RingError),
    #[error("{}: {source}; make room on the disk, or correct the rights", path.display())]
    Write { path: PathBuf, source: McapWriteError },
    #[error("the ring of {limit} bytes has no room for one file: raise service.recordings.ring_mb")]
    TooSmall { limit: u64 },
}

struct Writing {
    options: RecorderOptions,
    info: McapInfo,
    clock: StampClock,
    shared: SharedRecording,
    /// Nothing before it is opened, and after a failure.
    ring: Option<Ring>,
    current: Option<Current>,
    /// When to try again after a failure.
    retry: Option<Instant>,
    pause: Duration,
}

/// The file being written.
struct Current {
    writer: McapWriter<Box<dyn Output>>,
    path: PathBuf,
    opened: Instant,
    flushed: Instant,
    first_log_time: u64,
}

impl Writing {
    fn run(&mut self, mut frames: Consumer<Recorded>) {
        // Files of an earlier run are closed before the first frame comes.
        let opened = self.open_ring().map(drop);
        self.note(opened);
        loop {
            // Looked at before the queue is emptied: what came before the end is in it.
            let ended = frames.is_abandoned();
            while let Ok(recorded) = frames.pop() {
                self.take(&recorded);
            }
            let tended = self.tend(ended);
            self.note(tended);
            self.publish(ended);
            if ended {
                return;
            }
            std::thread::sleep(TURN);
        }
    }

    fn take(&mut self, recorded: &Recorded) {
        let written = if self.retry.is_some_and(|at| Instant::now() < at) {
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

    /// After a failure everything is opened anew, later.
    fn note(&mut self, done: Result<(), WritingError>) {
        let Err(error) = done else { return };
        // Its chunks are on disk as far as they got there; the next attempt closes it.
        self.current = None;
        self.ring = None;
        tracing::warn!("recording stops for {} s: {error}", self.pause.as_secs());
        self.retry = Some(Instant::now() + self.pause);
        self.pause = (2 * self.pause).min(LONGEST_PAUSE);
        let mut status = self.shared.update();
        status.write_errors += 1;
        (status.state, status.why) = (RecordingState::Failed, Some(error.to_string()));
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
        if self.current.is_none() {
            self.begin(frame.stamp_ns)?;
        }
        if !self.make_room(frame)? {
            // A small ring is nothing but this file: the next one may have its place.
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

    /// Removes old files for a frame and the chunk that it may close.
    fn make_room(&mut self, frame: &Frame) -> Result<bool, WritingError> {
        let (Some(current), Some(ring)) = (&self.current, &mut self.ring) else { return Ok(true) };
        let frame = McapWriter::<Box<dyn Output>>::frame_bytes(frame);
        Ok(ring.make_room(current.writer.bytes() + frame + CHUNK_ROOM)?)
    }

    fn begin(&mut self, stamp_ns: u64) -> Result<(), WritingError> {
        let mut info = self.info.clone();
        // One offset for each file: the people's clock may be set between two of them.
        if self.clock == StampClock::Realtime {
            let now = clock_pair();
            info.offset_ns = now.realtime_ns.wrapping_sub(now.monotonic_ns).cast_signed();
        }
        let create = std::sync::Arc::clone(&self.options.create);
        let path = self.open_ring()?.next_path();
        let failed = |source| WritingError::Write { path: path.clone(), source };
        let file = create(&path).map_err(|error| failed(McapWriteError::Output(error)))?;
        let writer = McapWriter::new(file, &info).map_err(failed)?;
        let now = Instant::now();
        self.current = Some(Current {
            writer,
            path,
            opened: now,
            flushed: now,
            first_log_time: info.log_time(stamp_ns),
        });
        Ok(())
    }

    /// Closes chunks and files when they are due.
    fn tend(&mut self, ended: bool) -> Result<(), WritingError> {
        let largest = LARGEST_SEGMENT.min(self.options.ring_bytes / 8);
        let segment = self.options.segment;
        let Some(current) = &mut self.current else { return Ok(()) };
        let failed = |path: &Path, source| WritingError::Write { path: path.to_owned(), source };
        if ended || current.opened.elapsed() >= segment || current.writer.bytes() >= largest {
            return self.close(!ended);
        }
        if current.flushed.elapsed() >= FLUSH_EVERY {
            current.flushed = Instant::now();
            current.writer.flush().map_err(|error| failed(&current.path, error))?;
            // It writes again.
            self.pause = FIRST_PAUSE;
        }
        Ok(())
    }

    /// Ends the file. At the end of the service nobody waits for the disk: the kernel has it all.
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
        let mut status = self.shared.update();
        if let Some(ring) = &mut self.ring {
            let current = self.current.as_ref();
            status.ring_bytes = ring.bytes() + current.map_or(0, |current| current.writer.bytes());
            status.segments = ring.whole().len() + usize::from(current.is_some());
            let oldest = ring.oldest_log_time().or(current.map(|current| current.first_log_time));
            status.oldest_s = newest
                .zip(oldest)
                .map(|(newest, oldest)| 1e-9 * newest.saturating_sub(oldest) as f64);
        }
        if ended && status.state != RecordingState::Failed {
            status.state = RecordingState::Ended;
        }
    }
}

/// What closing a chunk may add to a file \[bytes\].
const CHUNK_ROOM: u64 = 4096;
