//! The sources that need no kernel: the in-process bus, the candump log and the recording.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::conformance::{Rig, conforms, interfaces, number, numbered, take};
use didim_drivers::frame::Frame;
use didim_drivers::source::mcap::McapInfo;
use didim_drivers::source::{
    CandumpWriter, InterfaceName, McapSource, McapWriter, Received, SocketCanOptions,
    SocketCanSource, Source, StampDigits, TextLog, WhenFull, in_process_bus,
};

struct InProcess {
    capacity: usize,
}

impl Rig for InProcess {
    const LIVE: bool = true;
    const ENDS: bool = true;
    const KEEPS_STAMPS: bool = true;

    fn bring(&self, interfaces: &[InterfaceName], frames: &[Frame]) -> Box<dyn Source> {
        let (sender, source) = in_process_bus(interfaces, self.capacity, WhenFull::Wait);
        let frames = frames.to_vec();
        thread::spawn(move || {
            // The reader waits once before the first frame, as a bus thread does.
            thread::sleep(Duration::from_millis(10));
            for frame in frames {
                if sender.send(frame).is_err() {
                    return; // A test that has seen enough.
                }
            }
        });
        Box::new(source)
    }
}

#[test]
fn the_in_process_bus_conforms() {
    for capacity in [1, 16, 20_000] {
        conforms(&InProcess { capacity });
    }
}

struct Log {
    directory: tempfile::TempDir,
    files: AtomicU32,
}

impl Rig for Log {
    const LIVE: bool = false;
    const ENDS: bool = true;
    const KEEPS_STAMPS: bool = true;

    fn bring(&self, interfaces: &[InterfaceName], frames: &[Frame]) -> Box<dyn Source> {
        let n = self.files.fetch_add(1, Ordering::Relaxed);
        let path: PathBuf = self.directory.path().join(format!("{n}.log"));
        let file = std::fs::File::create(&path).unwrap();
        let out = std::io::BufWriter::new(file);
        let mut writer = CandumpWriter::new(out, interfaces, StampDigits::Nanoseconds);
        for frame in frames {
            writer.write(frame).unwrap();
        }
        writer.finish().unwrap();
        Box::new(TextLog::open(&path, interfaces).unwrap())
    }
}

#[test]
fn the_candump_log_conforms() {
    conforms(&Log { directory: tempfile::tempdir().unwrap(), files: AtomicU32::new(0) });
}

struct Recording {
    directory: tempfile::TempDir,
    files: AtomicU32,
}

impl Rig for Recording {
    const LIVE: bool = false;
    const ENDS: bool = true;
    const KEEPS_STAMPS: bool = true;

    fn bring(&self, interfaces: &[InterfaceName], frames: &[Frame]) -> Box<dyn Source> {
        let n = self.files.fetch_add(1, Ordering::Relaxed);
        let path = self.directory.path().join(format!("{n}.mcap"));
        let info = McapInfo {
            offset_ns: 1_700_000_000_000_000_000,
            interfaces: interfaces.to_vec(),
            ..McapInfo::default()
        };
        let mut writer = McapWriter::new(std::fs::File::create(&path).unwrap(), &info).unwrap();
        for (frame, sequence) in frames.iter().zip(0..) {
            writer.write(frame, sequence).unwrap();
        }
        writer.finish().unwrap();
        Box::new(McapSource::open(&path, &[]).unwrap())
    }
}

#[test]
fn the_recording_conforms() {
    conforms(&Recording { directory: tempfile::tempdir().unwrap(), files: AtomicU32::new(0) });
}

#[test]
fn an_in_process_bus_is_silent_while_a_sender_lives_and_ends_after_the_last() {
    let (sender, mut source) = in_process_bus(&interfaces(&["vcan0"]), 4, WhenFull::Wait);
    let second = sender.clone();
    let mut batch = Vec::with_capacity(4);
    drop(sender);
    for timeout in [Duration::ZERO, Duration::from_millis(30)] {
        let start = Instant::now();
        assert_eq!(source.receive(&mut batch, timeout).unwrap(), Received::Silence);
        assert!(start.elapsed() >= timeout);
    }
    second.send(numbered(1)[0]).unwrap();
    drop(second);
    assert_eq!(source.receive(&mut batch, Duration::ZERO).unwrap(), Received::Frames);
    assert_eq!(source.receive(&mut batch, Duration::MAX).unwrap(), Received::End);
}

#[test]
fn a_bus_that_may_overflow_drops_the_newest_and_counts_every_one() {
    let (sender, mut source) = in_process_bus(&interfaces(&["vcan0"]), 8, WhenFull::Drop);
    let frames = numbered(30);
    for frame in &frames[..20] {
        sender.send(*frame).unwrap();
    }
    assert_eq!(source.counters().queue_drops, 12);
    let first: Vec<u32> = take(&mut source, 8).iter().map(number).collect();
    assert_eq!(first, (0..8).collect::<Vec<_>>());
    for frame in &frames[20..] {
        sender.send(*frame).unwrap();
    }
    let rest: Vec<u32> = take(&mut source, 8).iter().map(number).collect();
    assert_eq!(rest, (20..28).collect::<Vec<_>>());
    assert_eq!((source.counters().frames, source.counters().queue_drops), (16, 14));
}

#[test]
fn a_waiting_bus_loses_nothing_to_a_slow_reader() {
    let (sender, mut source) = in_process_bus(&interfaces(&["vcan0"]), 2, WhenFull::Wait);
    let sending = thread::spawn(move || {
        for frame in numbered(50) {
            sender.send(frame).unwrap();
        }
    });
    let mut received = Vec::new();
    while received.len() < 50 {
        thread::sleep(Duration::from_millis(1));
        received.append(&mut take(&mut source, 1));
    }
    sending.join().unwrap();
    assert_eq!(received.iter().map(number).collect::<Vec<_>>(), (0..50).collect::<Vec<_>>());
    assert_eq!(source.counters().queue_drops, 0);
}

#[test]
fn a_sender_learns_that_nobody_listens() {
    for when_full in [WhenFull::Wait, WhenFull::Drop] {
        let (sender, source) = in_process_bus(&interfaces(&["vcan0"]), 1, when_full);
        drop(source);
        assert!(sender.send(numbered(1)[0]).is_err());
    }
}

#[test]
fn a_kernel_without_can_is_reported() {
    let opened = SocketCanSource::open(&interfaces(&["can77"]), &SocketCanOptions::default());
    let text = opened.unwrap_err().to_string();
    assert!(text.contains("modprobe can-raw") || text.contains("no interface can77"), "{text}");
}
