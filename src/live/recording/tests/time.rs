//! Hours and years of recording, without waiting for them.

use rtrb::Consumer;

use super::archive::{Recorded, window};
use super::*;
use crate::live::recording::request::Request;
use crate::live::recording::writer::RingWriter;

/// The recorder as its thread has it, turned by hand.
struct Turned {
    writer: RingWriter,
    tap: FrameTap,
    frames: Consumer<RecordedFrame>,
    shared: SharedRecording,
    start: Instant,
    /// Frames handed over.
    taken: u64,
}

impl Turned {
    fn new(options: RecorderOptions, start: Instant) -> Self {
        let (tap, frames, unrecorded) = frame_queue();
        let shared = SharedRecording { unrecorded, ..SharedRecording::default() };
        let info =
            McapInfo { run: "1".into(), interfaces: interfaces().to_vec(), ..McapInfo::default() };
        let writer = RingWriter::new(options, info, StampClock::Own, shared.clone(), start);
        Self { writer, tap, frames, shared, start, taken: 0 }
    }

    /// A turn at a time after the start, with so many new frames.
    fn turn(&mut self, at: Duration, frames: u64) -> RecordingStatus {
        for n in self.taken..self.taken + frames {
            self.tap.take(&[frame(n)], 0);
        }
        self.taken += frames;
        assert!(!self.writer.turn(&mut self.frames, self.start + at));
        self.shared.snapshot()
    }

    /// The bus ends.
    fn end(self, at: Duration) -> RecordingStatus {
        let Self { mut writer, tap, mut frames, shared, start, .. } = self;
        drop(tap);
        assert!(writer.turn(&mut frames, start + at));
        shared.snapshot()
    }
}

/// In memory: what is tested is when, not the disk.
fn in_memory() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").unwrap()
}

const DAY: Duration = Duration::from_secs(86_400);

#[test]
fn a_ring_is_no_larger_after_three_years() {
    let folder = in_memory();
    let (limit, mut largest) = (1_000_000, 0);
    let mut turned = Turned::new(options(folder.path(), limit), Instant::now());
    // A cabinet that is switched on for some seconds, four times a day.
    for quarter in 0..4 * 3 * 365 {
        let since = quarter * DAY / 4;
        for second in [0, 1, 61] {
            let status = turned.turn(since + Duration::from_secs(second), 20);
            assert_eq!(status.state, RecordingState::Recording);
            assert!(status.ring_bytes <= limit && status.segments <= 1000, "{status:?}");
        }
        largest = largest.max(size(folder.path()));
    }
    assert!((limit / 2..=limit).contains(&largest), "{largest}");
    let taken = turned.taken;
    let status = turned.end(3 * 365 * DAY);
    assert_eq!((status.frames_recorded, status.frames_unrecorded), (taken, 0));
    // The last ones are there, file by file, without a gap.
    let found: Vec<u64> = files(folder.path()).iter().flat_map(|file| read(file, false)).collect();
    assert_eq!(found.last(), Some(&(taken - 1)));
    assert!(found.windows(2).all(|two| two[1] == two[0] + 1));
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
    let mut turned = Turned::new(options, Instant::now());
    let mut attempts = Vec::new();
    // An hour, ten turns a second.
    for tenth in 0..36_000 {
        let before = asked.load(Ordering::Relaxed);
        let status = turned.turn(tenth * Duration::from_millis(100), 1);
        assert_eq!(status.state, RecordingState::Failed);
        if asked.load(Ordering::Relaxed) > before {
            attempts.push(tenth / 10);
        }
    }
    let apart: Vec<u32> = attempts.windows(2).map(|two| two[1] - two[0]).collect();
    assert_eq!(apart[..7], [1, 2, 4, 8, 16, 32, 60]);
    assert!(apart[7..].iter().all(|apart| *apart == 60), "{apart:?}");
    refuses.store(false, Ordering::Relaxed);
    let (mut status, mut at) = (RecordingStatus::default(), 3_600 * Duration::from_secs(1));
    for _ in 0..600 {
        at += Duration::from_millis(100);
        status = turned.turn(at, 1);
    }
    assert_eq!(status.state, RecordingState::Recording, "within a minute of the disk's return");
    // And the next failure begins with a second again.
    refuses.store(true, Ordering::Relaxed);
    let before = asked.load(Ordering::Relaxed);
    while status.state == RecordingState::Recording {
        at += Duration::from_millis(100);
        status = turned.turn(at, 1);
    }
    for _ in 0..35 {
        at += Duration::from_millis(100);
        turned.turn(at, 1);
    }
    // When a file was full; then one second, and two more, later.
    assert_eq!(asked.load(Ordering::Relaxed) - before, 3);
}

/// A bus of 5000 frames a second, the recorder and the archiver, turned together.
struct Bus {
    turned: Turned,
    archive: crate::live::recording::archive::Archive,
    at: Duration,
}

impl Bus {
    fn run(&mut self, length: Duration, mut request: Option<Request>) {
        let until = self.at + length;
        while self.at < until {
            self.at += Duration::from_millis(20);
            self.turned.turn(self.at, 100);
            // Every 100 ms unless it is asked.
            if request.is_some() || self.at.as_millis().is_multiple_of(100) {
                self.archive.turn(request.take(), false, self.turned.start + self.at);
            }
        }
    }
}

/// A capture of a length, which ends by itself after 10 s; and the bus ten seconds later.
fn captured(length: Duration, stops: bool) -> (Recorded, Bus) {
    let recorded = Recorded::empty();
    let recording = RecordingOptions { ring_mb: 256, ..RecordingOptions::default() };
    let ring = RecorderOptions::new(&recording, recorded.folder.path(), "cell", "c0ffee");
    let turned = Turned::new(ring, Instant::now());
    let mut archive = recorded.archive();
    archive.options = RecordingOptions { capture_max_s: 10.0, ..recording };
    let mut bus = Bus { turned, archive, at: Duration::ZERO };
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
    assert_eq!((status.kept, status.failed, status.capture), (1, 0, None));
    assert_eq!(recorded.names(), ["capture-00000000-gripper.mcap"]);
    let found = read(&recorded.kept()[0], false);
    // It begins at 2 s with what is on disk then, at most half a second old, and has a second more behind it.
    assert!((7_500..=10_100).contains(&found[0]), "{}", found[0]);
    let last = found[found.len() - 1];
    assert!((17_500..=22_600).contains(&last), "{last}");
    assert!(found.windows(2).all(|two| two[1] == two[0] + 1));
}

#[test]
fn a_capture_that_nobody_stops_ends_by_itself() {
    let (recorded, bus) = captured(Duration::from_secs(15), false);
    let status = bus.archive.shared.snapshot();
    assert_eq!((status.kept, status.failed, status.capture), (1, 0, None));
    // 10 s, the second after which that is noticed, and the second behind it.
    let found = read(&recorded.kept()[0], false).len();
    assert!((50_000..=61_000).contains(&found), "{found}");
}

#[test]
fn what_the_ring_never_gets_is_given_up_in_time() {
    let recorded = Recorded::of(0..100);
    let mut archive = recorded.archive();
    let (start, second) = (Instant::now(), Duration::from_secs(1));
    // Of a time that is not recorded: it is waited for what follows the window, and for the disk.
    let request = Request::Result { number: 1, window: window(2_000_000_000) };
    archive.turn(Some(request), false, start);
    archive.turn(None, false, start + 4 * second);
    assert_eq!(archive.shared.snapshot().failed, 0);
    archive.turn(None, false, start + 5 * second);
    assert_eq!(archive.shared.snapshot().failed, 1);
}
