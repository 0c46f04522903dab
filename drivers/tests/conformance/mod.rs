//! What every source of frames must do, whatever the frames come from. Each test file that owns a
//! maker of sources implements [`Rig`] and calls [`conforms`].

use std::time::{Duration, Instant};

use didim_drivers::frame::{Frame, FrameId, FrameKind};
use didim_drivers::source::{InterfaceName, Received, Source, SourceCounters, SourceError};

/// A way to make sources that bring frames known in advance.
pub(crate) trait Rig {
    /// Whether the source waits for frames and can therefore be silent.
    const LIVE: bool;
    /// Whether the source ends when its frames are used up.
    const ENDS: bool;
    /// Whether stamps are those of the frames, instead of the kernel's.
    const KEEPS_STAMPS: bool;

    /// A source on these interfaces to which these frames come, in this order, while it is read.
    fn bring(&self, interfaces: &[InterfaceName], frames: &[Frame]) -> Box<dyn Source>;
}

/// Runs the whole suite.
pub(crate) fn conforms<R: Rig>(rig: &R) {
    every_kind_of_frame_arrives_in_order_with_its_interface(rig);
    a_batch_never_grows(rig);
    a_batch_without_room_is_refused(rig);
    silence_is_reported_in_time(rig);
    nothing_is_allocated_after_start(rig);
}

pub(crate) fn interfaces(names: &[&str]) -> Vec<InterfaceName> {
    names.iter().map(|name| InterfaceName::new(name).unwrap()).collect()
}

/// Frames numbered in their first bytes, one millisecond apart.
pub(crate) fn numbered(count: u32) -> Vec<Frame> {
    (0..count)
        .map(|n| {
            let frame = Frame::classic(FrameId::Standard(0x181), &n.to_le_bytes()).unwrap();
            frame.with_stamp(u64::from(n) * 1_000_000)
        })
        .collect()
}

pub(crate) fn number(frame: &Frame) -> u32 {
    u32::from_le_bytes(frame.data()[..4].try_into().unwrap())
}

/// Takes frames until `count` are there, and fails when they do not come.
pub(crate) fn take(source: &mut dyn Source, count: usize) -> Vec<Frame> {
    let (mut frames, mut batch) = (Vec::new(), Vec::with_capacity(64));
    let give_up = Instant::now() + Duration::from_secs(20);
    while frames.len() < count {
        match source.receive(&mut batch, Duration::from_millis(100)).unwrap() {
            Received::Frames => assert!(!batch.is_empty(), "`Frames` without a frame"),
            Received::Silence => assert!(batch.is_empty(), "`Silence` with frames"),
            Received::End => panic!("the end after {} of {count} frames", frames.len()),
        }
        assert!(Instant::now() < give_up, "only {} of {count} frames came", frames.len());
        frames.append(&mut batch);
    }
    frames
}

fn every_kind_of_frame_arrives_in_order_with_its_interface<R: Rig>(rig: &R) {
    let (short, long) = (FrameId::Standard(0x123), FrameId::Extended(0x123));
    let fast = FrameKind::Fd { bit_rate_switch: true, error_state_indicator: true };
    let kinds = [
        Frame::classic(short, &[1, 2, 3, 4, 5, 6, 7, 8]),
        Frame::classic(long, &[]),
        Frame::fd(short, false, &[1, 2, 3]),
        Frame::new(long, fast, &[9; 64]),
        Frame::remote(short, 4),
        Frame::error(0x4, &[0, 0xC, 0, 0, 0, 0, 0, 0]),
    ]
    .map(Result::unwrap);
    let sent: Vec<Frame> = (0u8..60)
        .map(|n| {
            kinds[usize::from(n) % 6].on_interface(n / 3 % 2).with_stamp(u64::from(n) * 1_000_001)
        })
        .collect();
    let names = interfaces(&["vcan0", "vcan1"]);
    let mut source = rig.bring(&names, &sent);
    assert_eq!(source.interfaces(), names);
    assert_eq!(source.counters(), SourceCounters::default());
    let received = take(&mut *source, sent.len());
    assert_eq!(received.len(), sent.len());

    for interface in 0..2 {
        let round_trip = |frames: &[Frame]| -> Vec<Frame> {
            let strip = |frame: &Frame| if R::KEEPS_STAMPS { *frame } else { frame.with_stamp(0) };
            // A socket on the sender's host sees its frames as transmitted.
            let strip = |frame: &Frame| Frame { direction: sent[0].direction, ..strip(frame) };
            frames.iter().filter(|frame| frame.interface == interface).map(strip).collect()
        };
        assert_eq!(round_trip(&received), round_trip(&sent));
        let stamps: Vec<u64> =
            received.iter().filter(|f| f.interface == interface).map(|f| f.stamp_ns).collect();
        assert!(stamps.is_sorted(), "stamps of interface {interface}: {stamps:?}");
    }
    let expected = SourceCounters { frames: 60, error_frames: 10, ..SourceCounters::default() };
    assert_eq!(source.counters(), expected);

    if R::ENDS {
        for _ in 0..3 {
            let again = source.receive(&mut Vec::with_capacity(1), Duration::from_millis(10));
            assert_eq!(again.unwrap(), Received::End);
        }
        assert_eq!(source.counters(), expected);
    }
}

fn a_batch_never_grows<R: Rig>(rig: &R) {
    let sent = numbered(100);
    let mut source = rig.bring(&interfaces(&["vcan0"]), &sent);
    let mut batch = Vec::with_capacity(7);
    let (capacity, place) = (batch.capacity(), batch.as_ptr());
    let mut received = Vec::new();
    while received.len() < sent.len() {
        let filler = sent[0];
        // Part of the batch may be used already: only the rest is there to fill.
        batch.extend([filler; 3]);
        source.receive(&mut batch, Duration::from_secs(5)).unwrap();
        assert!(batch.len() > 3 && batch.len() <= capacity);
        assert_eq!((batch.capacity(), batch.as_ptr()), (capacity, place));
        assert!(batch[..3].iter().all(|frame| *frame == filler));
        received.extend(batch.drain(..).skip(3));
    }
    assert_eq!(received.iter().map(number).collect::<Vec<_>>(), (0..100).collect::<Vec<_>>());
}

fn a_batch_without_room_is_refused<R: Rig>(rig: &R) {
    let mut source = rig.bring(&interfaces(&["vcan0"]), &numbered(3));
    let error = source.receive(&mut Vec::new(), Duration::from_millis(10)).unwrap_err();
    assert!(matches!(error, SourceError::NoRoom) && error.is_recoverable());
    assert_eq!(take(&mut *source, 3).iter().map(number).collect::<Vec<_>>(), [0, 1, 2]);
}

fn silence_is_reported_in_time<R: Rig>(rig: &R) {
    if !R::LIVE {
        return;
    }
    let mut source = rig.bring(&interfaces(&["vcan0"]), &numbered(3));
    take(&mut *source, 3);
    if R::ENDS {
        return; // The in-process bus is silent only while a sender lives: see its own tests.
    }
    let mut batch = Vec::with_capacity(1);
    for timeout in [Duration::ZERO, Duration::from_millis(30)] {
        let start = Instant::now();
        assert_eq!(source.receive(&mut batch, timeout).unwrap(), Received::Silence);
        let waited = start.elapsed();
        assert!(waited >= timeout, "gave up after {waited:?} of {timeout:?}");
        assert!(waited < timeout + Duration::from_secs(2), "waited {waited:?} for {timeout:?}");
    }
}

fn nothing_is_allocated_after_start<R: Rig>(rig: &R) {
    const FRAMES: u32 = 10_000;
    let sent = numbered(FRAMES);
    let mut source = rig.bring(&interfaces(&["vcan0"]), &sent);
    let mut batch = Vec::with_capacity(64);
    // The first frames may set up what the thread needs once.
    source.receive(&mut batch, Duration::from_secs(5)).unwrap();
    let mut next = 0;
    let mut follow = |batch: &mut Vec<Frame>| {
        let before = next;
        for frame in batch.drain(..) {
            assert_eq!(number(&frame), next);
            next += 1;
        }
        next - before
    };
    let mut received = follow(&mut batch);
    let counted = allocation_counter::measure(|| {
        while received < FRAMES {
            let got = source.receive(&mut batch, Duration::from_secs(5));
            assert!(matches!(got, Ok(Received::Frames)), "{got:?} after {received}");
            received += follow(&mut batch);
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
}
