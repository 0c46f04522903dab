//! The bus thread: what it costs, how it ends, what it tells.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::common::bus::{assembler, frames, interface};
use crate::common::expectation::Expectation;

use crate::common::{Network, eventually};
use didim::cell::Cell;
use didim::live::acquire::{
    AcquireEnd, AcquireOptions, Acquisition, BusState, FrameLatency, FrameTime, SharedAcquisition,
};
use didim::live::external_torque::{SharedExternalTorque, sample_queue};
use didim::live::real_time_options::RealTimeOptions;
use didim::live::recording::frame_queue;
use didim::live::stream::{BatchKind, Pace, SampleReader, StreamNode};
use didim::service::status::{Collector, Health};
use didim_drivers::assemble::Assembler;
use didim_drivers::frame::{Frame, FrameId};
use didim_drivers::layout::{CycleValues, Role};
use didim_drivers::source::{
    InProcessSender, InterfaceFault, InterfaceFaults, InterfaceName, Received, SocketCanError,
    Source, SourceCounters, SourceError, StampClock, WhenFull, in_process_bus,
};

fn options(network: &Network, pace: Pace) -> AcquireOptions {
    AcquireOptions {
        stream: network.options(),
        pace,
        real_time: RealTimeOptions::default(),
        silence_after: Duration::from_millis(100),
    }
}

fn bus(when_full: WhenFull) -> (InProcessSender, Box<dyn Source>) {
    let (sender, source) = in_process_bus(&[interface()], 1024, when_full);
    (sender, Box::new(source))
}

/// A frame every 200 µs. A sender that is late by more does not catch up: its frames come one by
/// one.
fn send_at_5_khz(sender: &InProcessSender, frames: &[Frame]) {
    let mut due = Instant::now();
    for frame in frames {
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        sender.send(*frame).unwrap();
        due = Instant::now().max(due + Duration::from_micros(200));
    }
}

/// Samples whose way from the frame was timed.
fn counted(shared: &SharedAcquisition) -> u64 {
    shared.frame_to_buffer().map_or(0, |latency| latency.times.count)
}

fn reader(network: &Network) -> SampleReader {
    StreamNode::join(&network.options()).unwrap().sample_reader().unwrap()
}

#[test]
fn nothing_is_allocated_per_frame() {
    let network = Network::new();
    let (sender, source) = bus(WhenFull::Wait);
    let shared = SharedAcquisition::default();
    // A reader that never reads: the buffer overflows all the time, the costliest case.
    let _reader = reader(&network);
    let options = options(&network, Pace::Live);
    let start = Instant::now();
    let acquisition = Acquisition::start(&options, source, assembler(), &shared).unwrap();
    // A recorder that never writes: its queue is full most of the time, which is counted.
    let (tap, mut recorded, unrecorded) = frame_queue();
    // So it is with an observer of external torque that never looks.
    let observed = SharedExternalTorque::default();
    let (samples, _queue, _reader) = sample_queue(&observed);
    let acquisition = acquisition.with_observer(Some(samples));
    let mut acquisition = acquisition.with_tap(Some(tap));
    // The first wait sets up the thread's parking place.
    assert_eq!(acquisition.step().unwrap(), None);
    let frames = frames(60_000, |_| true);
    let expected = frames.clone();
    let bus =
        std::thread::spawn(move || frames.iter().for_each(|frame| sender.send(*frame).unwrap()));
    // The first batches connect the reader. A turn takes 256 frames at most.
    for _ in 0..30 {
        assert_eq!(acquisition.step().unwrap(), None);
    }
    let cost = allocation_counter::measure(|| while acquisition.step().unwrap().is_none() {});
    bus.join().unwrap();
    // The library's loan of a slot takes one small block and gives it back, per batch.
    assert_eq!(cost.bytes_total, 48 * cost.count_total, "{cost:?}");
    assert_eq!(counted(&shared), 60_000, "the latencies are part of it");
    // The slot being filled may still be on loan, or have been before.
    assert!(cost.count_current.abs() <= 1, "{cost:?}");
    let counts = acquisition.run(&AtomicBool::new(false)).map(|_| shared.counts()).unwrap();
    assert_eq!(counts.losses.samples, 60_000);
    assert_eq!(unrecorded.load(Ordering::Relaxed), 60_000 - (1 << 15));
    assert_eq!(observed.snapshot().skipped, 60_000 - (1 << 12));
    let queued: Vec<_> = std::iter::from_fn(|| recorded.pop().ok()).collect();
    assert_eq!(queued.len(), 1 << 15);
    assert!(
        queued.iter().zip(0..).all(|(of, n)| of.sequence == n && of.frame == expected[n as usize])
    );
    // All are full but the last one, the end, and those that a late sender left at their age.
    let (full, aged) = (60_000_u128.div_ceil(64) + 1, start.elapsed().as_millis() / 50);
    let batches = u128::from(counts.batches);
    assert!((full..=full + aged).contains(&batches), "{counts:?}, {aged}");
    assert!(u128::from(cost.count_total) <= 60_000 / 64 + aged, "{cost:?}, {aged}");
}

/// Where the test above never waits, this bus makes the thread wait for almost every frame.
#[test]
fn nothing_is_allocated_while_waiting_for_a_bus_at_5_khz() {
    let network = Network::new();
    let (sender, source) = bus(WhenFull::Wait);
    let shared = SharedAcquisition::default();
    let mut reader = reader(&network);
    let options = options(&network, Pace::Live);
    let mut acquisition = Acquisition::start(&options, source, assembler(), &shared).unwrap();
    assert_eq!(acquisition.step().unwrap(), None);
    let (before, during) = (1_000, 10_000);
    let frames = frames(before + during, |_| true);
    let bus = std::thread::spawn(move || send_at_5_khz(&sender, &frames));
    // The first batches connect the reader.
    while counted(&shared) < before {
        assert_eq!(acquisition.step().unwrap(), None);
    }
    let mut turns = 0;
    let cost = allocation_counter::measure(|| {
        while acquisition.step().unwrap().is_none() {
            turns += 1;
        }
    });
    bus.join().unwrap();
    assert!(turns >= during / 2, "{turns} turns: most frames were waited for");
    // A batch is sent full, or at its age of 50 ms.
    let batches = shared.counts().batches;
    assert!(cost.count_total <= batches, "{cost:?}, {batches} batches");
    assert_eq!(cost.bytes_total, 48 * cost.count_total, "{cost:?}");
    assert!(cost.count_current.abs() <= 1, "{cost:?}");
    assert_eq!(counted(&shared), before + during);
    assert!(reader.receive().unwrap().is_some());
}

#[test]
fn a_stop_is_obeyed_within_100_ms() {
    let network = Network::new();
    let (sender, source) = bus(WhenFull::Wait);
    let shared = SharedAcquisition::default();
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let thread = scope.spawn(|| {
            let options = options(&network, Pace::Live);
            let acquisition = Acquisition::start(&options, source, assembler(), &shared).unwrap();
            let end = acquisition.run(&stop);
            (end, Instant::now())
        });
        sender.send(frames(1, |_| false)[0]).unwrap();
        eventually("the frame is counted", || shared.counts().source.frames == 1);
        let start = Instant::now();
        stop.store(true, Ordering::Relaxed);
        let (end, ended) = thread.join().unwrap();
        assert_eq!(end.unwrap(), AcquireEnd::Stopped);
        assert!(ended - start < Duration::from_millis(100), "{:?}", ended - start);
    });
}

#[test]
fn silence_is_noticed_and_ends_with_the_next_frame() {
    let network = Network::new();
    let (sender, source) = bus(WhenFull::Wait);
    let shared = SharedAcquisition::default();
    let stop = AtomicBool::new(false);
    let frames = frames(10_000, |_| false);
    let mut unsent = frames.iter();
    std::thread::scope(|scope| {
        let thread = scope.spawn(|| {
            let options = options(&network, Pace::Live);
            Acquisition::start(&options, source, assembler(), &shared).unwrap().run(&stop)
        });
        let is = |state: BusState| shared.counts().bus == state;
        assert!(is(BusState::Waiting));
        // One frame would be followed by silence before a slow machine looks.
        let mut is_ok_while_sending = || {
            sender.send(*unsent.next().unwrap()).unwrap();
            is(BusState::Ok)
        };
        eventually("the bus is there", &mut is_ok_while_sending);
        eventually("the bus is silent", || is(BusState::Silent));
        eventually("the bus is back", &mut is_ok_while_sending);
        drop(sender);
        assert_eq!(thread.join().unwrap().unwrap(), AcquireEnd::SourceEnded);
        assert!(is(BusState::Ended));
        let sent = frames.len() - unsent.len();
        assert_eq!(shared.counts().losses.samples, sent as u64);
    });
}

#[test]
fn a_log_is_replayed_to_its_end_without_loss_to_a_slow_reader() {
    let network = Network::new();
    let (sender, source) = bus(WhenFull::Wait);
    let shared = SharedAcquisition::default();
    let stop = AtomicBool::new(false);
    // Many times what the buffer holds.
    let total = 20_000;
    std::thread::scope(|scope| {
        let thread = scope.spawn(|| {
            let options = options(&network, Pace::Replay);
            Acquisition::start(&options, source, assembler(), &shared).unwrap().run(&stop)
        });
        scope.spawn(move || {
            frames(total, |_| true).iter().for_each(|frame| sender.send(*frame).unwrap());
        });
        let mut reader = reader(&network);
        let mut next = 0;
        let start = Instant::now();
        'stream: loop {
            if start.elapsed() > Duration::from_secs(60) {
                stop.store(true, Ordering::Relaxed);
                panic!("stuck at sample {next} of {total}");
            }
            reader.wait_for_batch(Duration::from_millis(20)).unwrap();
            while let Some(batch) = reader.receive().unwrap() {
                assert_eq!(batch.lost_batches, 0);
                for sample in batch.samples() {
                    assert_eq!(sample.sequence, next);
                    next += 1;
                }
                std::thread::sleep(Duration::from_micros(500));
                reader.acknowledge().unwrap();
                if batch.kind() == BatchKind::End {
                    break 'stream;
                }
            }
        }
        assert_eq!(next, total);
        assert_eq!(thread.join().unwrap().unwrap(), AcquireEnd::SourceEnded);
    });
}

/// Hands out frames one at a time, with drops and failures at chosen places.
struct Faulty {
    frames: std::vec::IntoIter<Frame>,
    handed_out: u64,
    names: [InterfaceName; 1],
}

impl Source for Faulty {
    fn receive(&mut self, batch: &mut Vec<Frame>, _: Duration) -> Result<Received, SourceError> {
        self.handed_out += 1;
        if self.handed_out == 3 {
            return Err(SourceError::NoRoom);
        }
        match self.frames.next() {
            Some(frame) => batch.push(frame),
            None => return Ok(Received::End),
        }
        Ok(Received::Frames)
    }

    fn counters(&self) -> SourceCounters {
        let queue_drops = if self.handed_out > 5 { 7 } else { 0 };
        SourceCounters { frames: self.handed_out, queue_drops, ..SourceCounters::default() }
    }

    fn interfaces(&self) -> &[InterfaceName] {
        &self.names
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Own
    }
}

fn faulty_frames(length: u64) -> Faulty {
    let frames = frames(length, |_| true).into_iter();
    Faulty { frames, handed_out: 0, names: [interface()] }
}

fn faulty() -> Box<dyn Source> {
    Box::new(faulty_frames(10))
}

#[test]
fn drops_travel_with_the_first_sample_after_them() {
    let network = Network::new();
    let mut reader = reader(&network);
    let shared = SharedAcquisition::default();
    let options = options(&network, Pace::Live);
    let mut drops: Vec<_> = Vec::new();
    std::thread::scope(|scope| {
        let thread = scope.spawn(|| {
            let acquisition = Acquisition::start(&options, faulty(), assembler(), &shared).unwrap();
            acquisition.run(&AtomicBool::new(false))
        });
        eventually("the end", || {
            let Some(batch) = reader.receive().unwrap() else { return false };
            drops.extend(batch.samples().iter().map(|sample| sample.queue_drops));
            reader.acknowledge().unwrap();
            batch.kind() == BatchKind::End
        });
        assert_eq!(thread.join().unwrap().unwrap(), AcquireEnd::SourceEnded);
    });
    assert_eq!(drops, [0, 0, 0, 0, 7, 7, 7, 7, 7, 7]);
    assert_eq!(shared.counts().source.queue_drops, 7);
    assert_eq!(shared.counts().source_failures, 1, "a failure is counted and survived");
}

#[test]
fn a_log_that_cannot_be_read_is_not_replayed_past_the_fault() {
    let network = Network::new();
    let _reader = reader(&network);
    let shared = SharedAcquisition::default();
    let options = options(&network, Pace::Replay);
    let acquisition = Acquisition::start(&options, faulty(), assembler(), &shared).unwrap();
    assert!(acquisition.run(&AtomicBool::new(false)).is_err());
    assert_eq!(shared.counts().bus, BusState::Down);
}

/// An interface that is down, and up again without a frame.
struct UpAgain {
    calls: u32,
    names: [InterfaceName; 1],
}

impl Source for UpAgain {
    fn receive(&mut self, _: &mut Vec<Frame>, wait: Duration) -> Result<Received, SourceError> {
        self.calls += 1;
        std::thread::sleep(wait);
        match self.calls {
            1 => Err(SocketCanError::Down { interface: self.names[0] }.into()),
            _ => Ok(Received::Silence),
        }
    }

    fn counters(&self) -> SourceCounters {
        SourceCounters { frames: 1, link_down: 1, ..SourceCounters::default() }
    }

    fn interfaces(&self) -> &[InterfaceName] {
        &self.names
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Own
    }

    fn interface_faults(&self) -> InterfaceFaults {
        InterfaceFaults::new([(self.calls < 20).then_some(InterfaceFault::Down)].into_iter())
    }
}

#[test]
fn an_interface_that_is_up_again_is_silent_and_not_down() {
    let network = Network::new();
    let _reader = reader(&network);
    let shared = SharedAcquisition::default();
    let options = options(&network, Pace::Live);
    let source = Box::new(UpAgain { calls: 0, names: [interface()] });
    let mut acquisition = Acquisition::start(&options, source, assembler(), &shared).unwrap();
    let now = Instant::now();
    let mut collector = Collector::new(&options.stream, Some(shared.clone()), None, None, now);
    let mut reasons_after = |steps: u32| {
        for _ in 0..steps {
            acquisition.step().unwrap();
        }
        std::thread::sleep(Duration::from_millis(60));
        acquisition.step().unwrap();
        let mut reasons = collector.snapshot(Instant::now()).health.reasons;
        reasons.retain(|reason| !reason.starts_with("not granted"));
        reasons
    };
    assert_eq!(reasons_after(8), [format!("the interface {} is down", interface())]);
    let says: [String; 1] = Expectation::of("interface-up-and-silent").get("says");
    assert_eq!(reasons_after(20), says);
}

/// What becomes of the frames of cycle `k` of a CiA 402 bus at 500 Hz.
type Fate = fn(cycle: u64, &mut CycleValues, &mut Vec<Frame>);

/// Health after each of eighteen seconds of a bus whose frames have that fate from the tenth on.
fn healths(fate: Fate) -> Vec<Health> {
    let cell = Cell::read(Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/config/cells/tx40-cia402.toml"
    )))
    .unwrap();
    let network = Network::new();
    let _reader = reader(&network);
    let shared = SharedAcquisition::default();
    let (sender, source) = bus(WhenFull::Wait);
    let options =
        AcquireOptions { silence_after: Duration::from_secs(60), ..options(&network, Pace::Live) };
    let assembler =
        Assembler::new(cell.bus().unwrap().layout.clone(), cell.bus().unwrap().scales.clone());
    let mut acquisition = Acquisition::start(&options, source, assembler, &shared).unwrap();
    let start = Instant::now();
    let mut collector = Collector::new(&options.stream, Some(shared.clone()), None, None, start);
    let mut sent = 0;
    let mut second = |second: u64| {
        let mut frames = Vec::new();
        for cycle in 500 * second..500 * (second + 1) {
            let mut values = CycleValues::default();
            values.axes.iter_mut().for_each(|axis| axis.status_word = 0x1237);
            let mut of_cycle = Vec::new();
            let encode = |values: &CycleValues, frames: &mut Vec<Frame>| {
                for role in [Role::Sync, Role::Sample, Role::Target] {
                    cell.bus()
                        .unwrap()
                        .layout
                        .encode(role, values, cycle * 2_000_000, frames)
                        .unwrap();
                }
            };
            // Once for the values, once for the frames.
            if second >= 10 {
                fate(cycle, &mut values, &mut of_cycle);
            }
            encode(&values, &mut of_cycle);
            if second >= 10 {
                fate(cycle, &mut values, &mut of_cycle);
            }
            frames.append(&mut of_cycle);
        }
        sent += frames.len() as u64;
        let sender = sender.clone();
        let sending =
            std::thread::spawn(move || frames.iter().for_each(|f| sender.send(*f).unwrap()));
        eventually("the second is read", || {
            acquisition.step().unwrap();
            shared.counts().source.frames == sent
        });
        sending.join().unwrap();
        collector.snapshot(start + Duration::from_secs(second + 1)).health
    };
    (0..18).map(&mut second).collect()
}

#[test]
fn health_is_of_the_last_seconds_and_names_the_cause() {
    let silent_drive: Fate = |_, _, frames| {
        frames.retain(|frame| frame.id != FrameId::Standard(0x183));
    };
    let other_identifier: Fate = |_, _, frames| {
        for frame in frames.iter_mut().filter(|frame| frame.id == FrameId::Standard(0x183)) {
            frame.id = FrameId::Standard(0x1f3);
        }
    };
    let one_disabled: Fate = |_, values, _| values.axes[2].status_word = 0x1218;
    let wrong_period: Fate = |cycle, _, frames| {
        let late_ns = (cycle - 5_000) * 40_000;
        frames.iter_mut().for_each(|frame| frame.stamp_ns += late_ns);
    };
    for (name, fate, causes) in [
        ("silent drive", silent_drive, &["missing axis"][..]),
        ("other identifier", other_identifier, &["missing axis", "unknown id"]),
        ("one drive disabled", one_disabled, &["not enabled"]),
        ("wrong period", wrong_period, &["wrong period"]),
    ] {
        let healths = healths(fate);
        assert!(healths[..10].iter().all(|health| health.ok), "{name}: {healths:?}");
        let [reason] = &healths[17].reasons[..] else { panic!("{name}: {:?}", healths[17]) };
        assert!(!healths[17].idle, "{name}");
        let stopped = reason.starts_with("frames come, but no sample is complete: ");
        assert!(stopped || name == "wrong period", "{name}: {reason}");
        assert!(causes.iter().all(|cause| reason.contains(cause)), "{name}: {reason}");
    }
}

#[test]
fn drives_that_are_all_disabled_are_idle_and_a_gap_is_over() {
    let all_disabled: Fate = |_, values, _| {
        values.axes.iter_mut().for_each(|axis| axis.status_word = 0x1250);
    };
    let idle = healths(all_disabled);
    assert!(idle.iter().all(|health| health.ok), "{idle:?}");
    assert_eq!((idle[9].idle, idle[17].idle), (false, true));
    // Eight thousand cycles.
    let gap: Fate = |_, _, frames| {
        frames.iter_mut().for_each(|frame| frame.stamp_ns += 16_000_000_000);
    };
    let gap = healths(gap);
    assert!(gap.iter().all(|health| health.ok && !health.idle), "{gap:?}");
}

/// How long frames were queued before they are read.
const QUEUED: Duration = Duration::from_millis(5);

/// Hands out a frame a millisecond, stamped by the computer's clock as long before as it was
/// queued.
struct Queued(Faulty);

impl Source for Queued {
    fn receive(&mut self, batch: &mut Vec<Frame>, _: Duration) -> Result<Received, SourceError> {
        std::thread::sleep(Duration::from_millis(1));
        let Some(frame) = self.0.frames.next() else { return Ok(Received::End) };
        let stamp = SystemTime::now().duration_since(UNIX_EPOCH).unwrap() - QUEUED;
        batch.push(frame.with_stamp(u64::try_from(stamp.as_nanos()).unwrap()));
        Ok(Received::Frames)
    }

    fn counters(&self) -> SourceCounters {
        self.0.counters()
    }

    fn interfaces(&self) -> &[InterfaceName] {
        self.0.interfaces()
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Realtime
    }
}

fn latency_of(source: Box<dyn Source>) -> FrameLatency {
    let network = Network::new();
    let _reader = reader(&network);
    let shared = SharedAcquisition::default();
    let options = options(&network, Pace::Live);
    let acquisition = Acquisition::start(&options, source, assembler(), &shared).unwrap();
    assert_eq!(acquisition.run(&AtomicBool::new(false)).unwrap(), AcquireEnd::SourceEnded);
    shared.frame_to_buffer().unwrap()
}

#[test]
fn the_time_of_a_stamped_frame_includes_its_queueing() {
    let FrameLatency { from, times } = latency_of(Box::new(Queued(faulty_frames(100))));
    assert_eq!((from, times.count), (FrameTime::Stamp, 100));
    let queued_ns = u64::try_from(QUEUED.as_nanos()).unwrap();
    assert!(times.p50_ns >= queued_ns && times.max_ns < 60_000_000_000, "{times:?}");
}

#[test]
fn the_time_of_a_frame_without_a_stamp_begins_when_it_is_read() {
    let FrameLatency { from, times } = latency_of(Box::new(faulty_frames(10)));
    assert_eq!((from, times.count), (FrameTime::Read, 10));
    // The stamps themselves lie at the start of a log.
    assert!(times.p50_ns > 0 && times.max_ns < 60_000_000_000, "{times:?}");
}
