//! Hours and years of recording, without waiting for them.

use rtrb::Consumer;

use super::archive::{Recorded, window};
use super::*;
use crate::live::recording::request::Request;
use crate::live::recording::ring::DiskSpace;
use crate::live::recording::writer::RingWriter;

/// The recorder's thread state, stepped by the test.
struct TimeLapse {
    writer: RingWriter,
    tap: FrameTap,
    frames: Consumer<RecordedFrame>,
    shared: SharedRecording,
    start: Instant,
    /// Frames handed over.
    taken: u64,
}

impl TimeLapse {
    fn new(options: RecorderOptions, start: Instant) -> Self {
        let (tap, frames, unrecorded) = frame_queue();
        let shared = SharedRecording { unrecorded, ..SharedRecording::default() };
        let info = McapInfo {
            recorder_run: "1".into(),
            interfaces: interfaces().to_vec(),
            ..McapInfo::default()
        };
        let writer = RingWriter::new(options, info, StampClock::Own, shared.clone(), start);
        Self { writer, tap, frames, shared, start, taken: 0 }
    }

    /// Runs a step at a time after the start, with this number of new frames.
    fn turn(&mut self, at: Duration, frames: u64) -> RecordingStatus {
        for n in self.taken..self.taken + frames {
            self.tap.pass_on(&[frame(n)], 0);
        }
        self.taken += frames;
        assert!(!self.writer.run_step(&mut self.frames, self.start + at));
        self.shared.snapshot()
    }

    /// The bus ends.
    fn end(self, at: Duration) -> RecordingStatus {
        let Self { mut writer, tap, mut frames, shared, start, .. } = self;
        drop(tap);
        assert!(writer.run_step(&mut frames, start + at));
        shared.snapshot()
    }
}

/// Creates a folder in memory: the test is about time, not about the disk.
fn in_memory() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").unwrap()
}

/// A writer that records the largest size that the folder ever had.
struct Watched {
    file: File,
    folder: PathBuf,
    largest: Arc<AtomicU64>,
}

impl Write for Watched {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.largest.fetch_max(size(&self.folder), Ordering::Relaxed);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Output for Watched {
    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn the_ring_is_never_larger_than_its_limit() {
    for limit in [1, 3_000, 12_000, 40_000, 150_000, 500_000, 2_000_001] {
        let folder = in_memory();
        let largest = Arc::new(AtomicU64::new(0));
        let mut options = options(folder.path(), limit);
        let (watched, at) = (Arc::clone(&largest), folder.path().to_owned());
        options.create = Arc::new(move |path| {
            let (folder, largest) = (at.clone(), Arc::clone(&watched));
            Ok(Box::new(Watched { file: File::create(path)?, folder, largest }))
        });
        let mut time_lapse = TimeLapse::new(options, Instant::now());
        // The limit counts here, not how full this machine's disk is.
        time_lapse.writer.disk_space =
            |_| Ok(DiskSpace { free_bytes: 1 << 40, spare_bytes: 1 << 40 });
        let (total, step) = (20_000, Duration::from_millis(200));
        for k in 0..20 {
            time_lapse.turn(k * step, 1_000);
        }
        let status = time_lapse.end(20 * step);
        let largest = largest.load(Ordering::Relaxed).max(size(folder.path()));
        if limit < 12_000 {
            // Not even a file without frames fits: this is reported, and nothing is written.
            assert_eq!(status.state, RecordingState::Failed);
            let why = status.why.unwrap();
            assert!(why.contains("ring_mb"), "{why}");
            assert_eq!(status.frames_recorded + status.frames_unrecorded, total);
            assert!(largest < 12_000 + limit, "{limit}: {largest}");
            continue;
        }
        assert!(largest <= limit, "{limit}: {largest}");
        assert_eq!((status.frames_recorded, status.write_errors), (total, 0), "{limit}");
        if limit < 150_000 {
            continue;
        }
        // The remaining frames are the latest, without a gap.
        let files = files(folder.path());
        let numbers: Vec<u64> = files.iter().flat_map(|file| read(file, false)).collect();
        let first = numbers[0];
        assert!(numbers.iter().copied().eq(first..total), "{limit}: from {first}");
        assert!(size(folder.path()) > limit / 3, "{limit}: {}", size(folder.path()));
    }
}

const DAY: Duration = Duration::from_secs(86_400);

#[test]
fn a_ring_is_no_larger_after_three_years() {
    let folder = in_memory();
    let (limit, mut largest) = (1_000_000, 0);
    let mut rotated = TimeLapse::new(options(folder.path(), limit), Instant::now());
    // A cabinet that is switched on for some seconds, four times a day.
    for quarter in 0..4 * 3 * 365 {
        let since = quarter * DAY / 4;
        for second in [0, 1, 61] {
            let status = rotated.turn(since + Duration::from_secs(second), 20);
            assert_eq!(status.state, RecordingState::Recording);
            assert!(status.ring_bytes <= limit && status.segments <= 1000, "{status:?}");
        }
        largest = largest.max(size(folder.path()));
    }
    assert!((limit / 2..=limit).contains(&largest), "{largest}");
    let taken = rotated.taken;
    let status = rotated.end(3 * 365 * DAY);
    assert_eq!((status.frames_recorded, status.frames_unrecorded), (taken, 0));
    // The last frames are on disk, file by file, without a gap.
    let numbers: Vec<u64> =
        files(folder.path()).iter().flat_map(|file| read(file, false)).collect();
    assert_eq!(numbers.last(), Some(&(taken - 1)));
    assert!(numbers.windows(2).all(|two| two[1] == two[0] + 1));
}

#[test]
fn a_disk_that_refuses_is_asked_less_and_less_and_at_least_every_minute() {
    let folder = in_memory();
    let refuses = Arc::new(AtomicBool::new(true));
    let asked = Arc::new(AtomicU64::new(0));
    let (switch, count) = (Arc::clone(&refuses), Arc::clone(&asked));
    let mut options = options(folder.path(), 10_000_000);
    options.create = Arc::new(move |path| {
        count.fetch_add(1, Ordering::Relaxed);
        match switch.load(Ordering::Relaxed) {
            true => Err(io::ErrorKind::PermissionDenied.into()),
            false => create_file(path),
        }
    });
    let mut rotated = TimeLapse::new(options, Instant::now());
    let mut attempts = Vec::new();
    // An hour, ten steps a second.
    for tenth in 0..36_000 {
        let before = asked.load(Ordering::Relaxed);
        let status = rotated.turn(tenth * Duration::from_millis(100), 1);
        assert_eq!(status.state, RecordingState::Failed);
        if asked.load(Ordering::Relaxed) > before {
            attempts.push(tenth / 10);
        }
    }
    let intervals: Vec<u32> = attempts.windows(2).map(|two| two[1] - two[0]).collect();
    assert_eq!(intervals[..7], [1, 2, 4, 8, 16, 32, 60]);
    assert!(intervals[7..].iter().all(|distant| *distant == 60), "{intervals:?}");
    refuses.store(false, Ordering::Relaxed);
    let (mut status, mut at) = (RecordingStatus::default(), 3_600 * Duration::from_secs(1));
    for _ in 0..600 {
        at += Duration::from_millis(100);
        status = rotated.turn(at, 1);
    }
    assert_eq!(status.state, RecordingState::Recording, "within a minute of the disk's return");
    // The pauses start with one second again at the next failure.
    refuses.store(true, Ordering::Relaxed);
    let before = asked.load(Ordering::Relaxed);
    while status.state == RecordingState::Recording {
        at += Duration::from_millis(100);
        status = rotated.turn(at, 1);
    }
    for _ in 0..35 {
        at += Duration::from_millis(100);
        rotated.turn(at, 1);
    }
    // One attempt when a file was full, one a second later, and one two seconds after that.
    assert_eq!(asked.load(Ordering::Relaxed) - before, 3);
}

/// A bus of 5000 frames a second, with the recorder and the archiver, stepped together.
struct Bus {
    rotated: TimeLapse,
    archive: crate::live::recording::archive::Archive,
    at: Duration,
}

impl Bus {
    fn run(&mut self, length: Duration, mut request: Option<Request>) {
        let until = self.at + length;
        while self.at < until {
            self.at += Duration::from_millis(20);
            self.rotated.turn(self.at, 100);
            // Every 100 ms, and at a request.
            if request.is_some() || self.at.as_millis().is_multiple_of(100) {
                self.archive.run_step(request.take(), false, self.rotated.start + self.at);
            }
        }
    }
}

/// Runs a capture of a length, which ends by itself after 10 s, and the bus for ten more seconds.
fn captured(length: Duration, stops: bool) -> (Recorded, Bus) {
    let recorded = Recorded::empty();
    let recording = RecordingOptions { ring_mb: 256, ..RecordingOptions::default() };
    let ring = RecorderOptions::new(&recording, recorded.folder.path(), "cell", "c0ffee");
    let rotated = TimeLapse::new(ring, Instant::now());
    let mut archive = recorded.archive();
    archive.options = RecordingOptions { capture_max_s: 10.0, ..recording };
    let mut bus = Bus { rotated, archive, at: Duration::ZERO };
    bus.run(Duration::from_secs(2), None);
    let (answer, answered) = std::sync::mpsc::sync_channel(1);
    bus.run(length, Some(Request::Start { name: "gripper".into(), answer }));
    assert_eq!(answered.recv().unwrap(), Ok(()));
    let (answer, answered) = std::sync::mpsc::sync_channel(1);
    bus.run(Duration::from_secs(10), Some(Request::Stop { answer }));
    let stopped = if stops { Ok(()) } else { Err(CaptureError::NotRunning) };
    assert_eq!(answered.recv().unwrap(), stopped);
    (recorded, bus)
}

#[test]
fn a_capture_keeps_what_comes_between_start_and_stop() {
    let (recorded, bus) = captured(Duration::from_millis(1500), true);
    let status = bus.archive.shared.snapshot();
    assert_eq!((status.fixed, status.failed, status.capture), (1, 0, None));
    assert_eq!(recorded.names(), ["capture-00000000-gripper.mcap"]);
    let frames = read(&recorded.archived()[0], false);
    // It begins at 2 s with the frames on disk at that time, at most half a second old. It has one
    // more second at its end.
    assert!((7_500..=10_100).contains(&frames[0]), "{}", frames[0]);
    let last = frames[frames.len() - 1];
    assert!((17_500..=22_600).contains(&last), "{last}");
    assert!(frames.windows(2).all(|two| two[1] == two[0] + 1));
}

#[test]
fn a_capture_that_nobody_stops_ends_by_itself() {
    let (recorded, bus) = captured(Duration::from_secs(15), false);
    let status = bus.archive.shared.snapshot();
    assert_eq!((status.fixed, status.failed, status.capture), (1, 0, None));
    // 10 s, the second until that is noticed, and the second at the end.
    let count = read(&recorded.archived()[0], false).len();
    assert!((50_000..=61_000).contains(&count), "{count}");
}

#[test]
fn what_the_ring_never_gets_is_given_up_in_time() {
    let recorded = Recorded::record(0..100);
    let mut archive = recorded.archive();
    let (start, second) = (Instant::now(), Duration::from_secs(1));
    // The window is at a time that is not recorded. The archiver waits for the time after the
    // window and for the disk.
    let request = Request::Result { number: 1, window: window(2_000_000_000) };
    archive.run_step(Some(request), false, start);
    archive.run_step(None, false, start + 4 * second);
    assert_eq!(archive.shared.snapshot().failed, 0);
    archive.run_step(None, false, start + 5 * second);
    assert_eq!(archive.shared.snapshot().failed, 1);
}
