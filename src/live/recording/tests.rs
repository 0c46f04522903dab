use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use didim_drivers::frame::{Frame, FrameId};
use didim_drivers::source::mcap::{FileEnd, McapInfo, McapScan};
use didim_drivers::source::{InterfaceName, McapSource, McapWriter, Received, Source, StampClock};

use super::*;
use crate::expectation::Expectation;

fn frame(n: u64) -> Frame {
    let mut data = [0; 64];
    data[..8].copy_from_slice(&n.to_le_bytes());
    Frame::fd(FrameId::Standard(0x123), true, &data).unwrap().with_stamp(n * 200_000)
}

fn number(frame: &Frame) -> u64 {
    u64::from_le_bytes(frame.data()[..8].try_into().unwrap())
}

fn interfaces() -> [InterfaceName; 1] {
    [InterfaceName::new("vcan0").unwrap()]
}

fn options(folder: &Path, ring_bytes: u64) -> RecorderOptions {
    RecorderOptions {
        folder: folder.to_owned(),
        ring_bytes,
        segment: Duration::from_secs(60),
        cell: "cell".into(),
        configuration: "c0ffee".into(),
        create: Arc::new(create_file),
        budget: WriteBudget::default(),
    }
}

fn eventually(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(120), "not within 120 s: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Passes on frames no faster than they are written.
fn feed(tap: &mut FrameTap, shared: &SharedRecording, frames: core::ops::Range<u64>) {
    for n in frames {
        tap.pass_on(&[frame(n)], 0);
        if n % 1000 == 999 {
            eventually("the recorder follows", || {
                let status = shared.snapshot();
                n + 1 - status.frames_recorded - status.frames_unrecorded <= 10_000
            });
        }
    }
}

fn end(recorder: Recorder, tap: FrameTap) -> RecordingStatus {
    let shared = recorder.shared().clone();
    drop(tap);
    recorder.finish();
    shared.snapshot()
}

/// Reads all frames of a file. The file has to have an end unless `part`.
fn read(path: &Path, part: bool) -> Vec<u64> {
    let mut source = McapSource::open(path, &[]).unwrap();
    let mut numbers = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        numbers.push(number(&frame));
    }
    if !part {
        assert_eq!(source.file_end(), Some(FileEnd::Finished), "{}", path.display());
    }
    assert_eq!(source.counters().queue_drops, 0);
    numbers
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files
}

fn size(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).unwrap().flatten();
    entries.filter_map(|entry| entry.metadata().ok()).map(|data| data.len()).sum()
}

#[test]
fn what_is_recorded_is_there_in_order_over_all_files() {
    let folder = tempfile::tempdir().unwrap();
    let options = options(folder.path(), 16_000_000);
    let (recorder, mut tap) = Recorder::start(options, &interfaces(), StampClock::Own).unwrap();
    feed(&mut tap, &recorder.shared().clone(), 0..50_000);
    let status = end(recorder, tap);
    assert_eq!(status.state, RecordingState::Ended);
    assert_eq!(
        (status.frames_recorded, status.frames_unrecorded, status.write_errors),
        (50_000, 0, 0)
    );
    let files = files(folder.path());
    assert!(files.len() >= 3, "a file is an eighth of the ring: {files:?}");
    assert_eq!(status.segments, files.len());
    assert_eq!(status.ring_bytes, size(folder.path()));
    let numbers: Vec<u64> = files.iter().flat_map(|file| read(file, false)).collect();
    assert!(numbers.iter().copied().eq(0..50_000));
}

/// A disk that is full whenever the test sets its flag.
struct Full {
    file: File,
    full: Arc<AtomicBool>,
}

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.full.load(Ordering::Relaxed) {
            // Like a real disk: the part that still fits is written.
            self.file.write_all(&bytes[..bytes.len() / 2])?;
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Output for Full {
    fn sync(&mut self) -> io::Result<()> {
        self.file.sync_all()
    }
}

#[test]
fn a_full_disk_is_reported_and_recording_goes_on_when_there_is_room() {
    let folder = tempfile::tempdir().unwrap();
    let full = Arc::new(AtomicBool::new(false));
    let mut options = options(folder.path(), 10_000_000);
    let switch = Arc::clone(&full);
    options.create = Arc::new(move |path| {
        let (file, full) = (File::create(path)?, Arc::clone(&switch));
        Ok(Box::new(Full { file, full }))
    });
    let (recorder, mut tap) = Recorder::start(options, &interfaces(), StampClock::Own).unwrap();
    let shared = recorder.shared().clone();
    tap.pass_on(&(0..1000).map(frame).collect::<Vec<_>>(), 0);
    // On disk, and not only taken from the queue.
    eventually("the first frames are on disk", || {
        let part = folder.path().join("segment-00000000.mcap.part");
        McapScan::read(&part).is_ok_and(|scan| scan.stamps_ns() == Some((0, 999 * 200_000)))
    });
    full.store(true, Ordering::Relaxed);
    tap.pass_on(&(1000..1500).map(frame).collect::<Vec<_>>(), 0);
    eventually("the failure is reported", || shared.snapshot().state == RecordingState::Failed);
    let why = shared.snapshot().why.unwrap();
    let expected = Expectation::of("disk-full-of-others");
    expected.assert_said(&why, &[]);
    assert!(shared.snapshot().write_errors >= 1);
    full.store(false, Ordering::Relaxed);
    let mut n = 1500;
    eventually("it writes again", || {
        tap.pass_on(&[frame(n)], 0);
        n += 1;
        shared.snapshot().state == RecordingState::Recording
    });
    let status = end(recorder, tap);
    expected.assert_eq("segments_repaired", &status.segments_repaired);
    assert!(status.frames_unrecorded > 0);
    let files = files(folder.path());
    assert_eq!(files.len(), 2, "{files:?}");
    assert!(read(&files[0], false).into_iter().eq(0..1000));
    let later = read(&files[1], false);
    assert_eq!(later.last(), Some(&(n - 1)));
    // Frames refused during the pause are missing, and the sequence shows it.
    let mut source = McapSource::open(&files[1], &[]).unwrap();
    source.continue_from(Some(999));
    source.next_frame().unwrap();
    assert_eq!(source.counters().queue_drops, later[0] - 1000);
}

#[test]
fn frames_dropped_before_the_tap_are_missing_in_the_sequence() {
    let (mut tap, mut frames, _) = frame_queue();
    tap.pass_on(&[frame(0)], 0);
    tap.pass_on(&[frame(1)], 7);
    tap.pass_on(&[frame(2)], 7);
    let sequences: Vec<u32> =
        std::iter::from_fn(|| frames.pop().ok()).map(|recorded| recorded.sequence).collect();
    assert_eq!(sequences, [0, 8, 9]);
}

#[test]
fn options_out_of_range_are_named() {
    assert_eq!(RecordingOptions::default().check(), Ok(()));
    let wrong = [
        ("ring_mb", RecordingOptions { ring_mb: 1, ..Default::default() }),
        ("keep_mb", RecordingOptions { keep_mb: u64::MAX, ..Default::default() }),
        ("segment_s", RecordingOptions { segment_s: f64::NAN, ..Default::default() }),
        ("keep", RecordingOptions { keep: 0, ..Default::default() }),
    ];
    for (key, options) in wrong {
        let (named, _) = options.check().unwrap_err();
        assert_eq!(named, format!("service.recordings.{key}"));
    }
}

/// Reads all frames of a source, and the number of frames that it reports as missing.
fn drain(source: &mut dyn Source) -> (Vec<u64>, u64) {
    let (mut found, mut batch) = (Vec::new(), Vec::with_capacity(100));
    while source.receive(&mut batch, Duration::ZERO).unwrap() == Received::Frames {
        found.extend(batch.drain(..).map(|frame| number(&frame)));
    }
    (found, source.counters().queue_drops)
}

#[test]
fn a_ring_is_read_as_one_recording_and_says_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    for run in [0..50_000, 70_000..70_100] {
        let options = options(folder.path(), 16_000_000);
        let (recorder, mut tap) = Recorder::start(options, &interfaces(), StampClock::Own).unwrap();
        feed_all(&mut tap, &recorder.shared().clone(), run);
        end(recorder, tap);
    }
    let numbers: Vec<u64> = (0..50_000).chain(70_000..70_100).collect();
    let mut ring = open_log(folder.path(), None, &[]).unwrap();
    assert_eq!(ring.interfaces(), interfaces());
    assert_eq!(drain(&mut *ring), (numbers.clone(), 0), "between two runs nothing is missing");
    // The first run has three files or more. One in the middle is removed.
    let files = files(folder.path());
    assert!(files.len() >= 4, "{files:?}");
    let away = read(&files[1], false);
    fs::remove_file(&files[1]).unwrap();
    let (found, missing) = drain(&mut *open_log(folder.path(), None, &[]).unwrap());
    assert_eq!(missing, away.len() as u64);
    assert!(found.into_iter().eq(numbers.into_iter().filter(|n| !away.contains(n))));
    // For a folder without a recording, the error says what to name.
    let empty = tempfile::tempdir().unwrap();
    let error = open_log(empty.path(), None, &[]).map(drop).unwrap_err().to_string();
    assert!(error.contains("recordings/ring"), "{error}");
}

fn feed_all(tap: &mut FrameTap, shared: &SharedRecording, frames: core::ops::Range<u64>) {
    for n in frames.clone() {
        tap.pass_on(&[frame(n)], 0);
        let taken = n + 1 - frames.start;
        if taken.is_multiple_of(5_000) {
            eventually("they are written", || shared.snapshot().frames_recorded == taken);
        }
    }
}

mod archive;
mod crashes;
mod full;
mod ring;
mod time;
