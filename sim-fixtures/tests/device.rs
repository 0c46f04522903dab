//! What the virtual device puts on a bus.
#![allow(clippy::float_cmp, reason = "counts are whole numbers")]
#![allow(clippy::needless_range_loop, reason = "an axis indexes several arrays")]

use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::common::{cia402, packed, scenario};
use didim_drivers::frame::{Frame, FrameId, FrameKind};
use didim_drivers::layout::{CompiledLayout, Quantity};
use didim_drivers::source::{
    CandumpWriter, InterfaceName, Received, Source, StampDigits, WhenFull, in_process_bus,
};
use didim_drivers::units::Scales;
use didim_sim::{
    CYCLE_FRAMES, CandumpSink, CycleError, DeviceError, Fault, FaultAction, InProcessSink, Pace,
    PlayError, Scenario, SinkError, VirtualDevice, play,
};

const COUNTS: [f64; 6] = [196_608.0, 196_608.0, 65_536.0, 65_536.0, 65_536.0, 65_536.0];
const EPOCH_NS: u64 = 1_700_000_000_000_000_000;

fn new_device(
    scenario: &Scenario,
    (layout, scales): (CompiledLayout, Scales),
    epoch_ns: u64,
) -> Result<VirtualDevice, DeviceError> {
    VirtualDevice::new(scenario, layout, scales, epoch_ns)
}

fn cycle(device: &mut VirtualDevice) -> Vec<Frame> {
    let mut frames = Vec::new();
    device.poll_cycle(&mut frames).unwrap();
    frames
}

fn read(layout: &CompiledLayout, frames: &[Frame], quantity: Quantity, axis: usize) -> f64 {
    let raw = frames.iter().find_map(|frame| {
        let (_, message) = layout.read(frame).unwrap();
        let extraction =
            message.extractions.iter().find(|e| e.quantity == quantity && e.axis == axis)?;
        extraction.value(&frame.payload)
    });
    raw.unwrap()
}

#[test]
fn the_packed_frames_hold_the_loop_s_samples() {
    let scenario = scenario();
    let (layout, scales) = packed();
    let mut device =
        VirtualDevice::new(&scenario, layout.clone(), scales.clone(), EPOCH_NS).unwrap();
    let mut closed_loop = scenario.played_loop().unwrap();
    for k in 0..2000_u64 {
        assert_eq!(device.poll_due(), Some(k * 200_000));
        let frames = cycle(&mut device);
        let sample = closed_loop.step().unwrap();
        assert_eq!(frames.len(), 1);
        assert_eq!(frames[0].stamp_ns, EPOCH_NS + k * 200_000);
        assert_eq!((frames[0].id, frames[0].length), (FrameId::Standard(0x100), 64));
        assert!(matches!(frames[0].kind, FrameKind::Fd { .. }));
        assert_eq!(read(&layout, &frames, Quantity::Counter, 0), k as f64);
        for j in 0..6 {
            let value = |quantity| read(&layout, &frames, quantity, j);
            // On the encoder's grid already: nothing is lost.
            let position = value(Quantity::Position) * TAU / COUNTS[j];
            assert!((position - sample.motor_position_rad[j]).abs() < 1e-9);
            let reference = value(Quantity::Reference) * TAU / COUNTS[j];
            assert!((reference - sample.motor_reference_rad[j]).abs() <= 0.5001 * TAU / COUNTS[j]);
            let torque = scales.torque_nm(j, value(Quantity::Torque));
            let count = scales.torque_nm(j, 1.0);
            assert!((torque - sample.motor_torque_nm[j]).abs() <= 0.5001 * count);
        }
    }
}

#[test]
fn cia_402_frames_follow_the_sync_and_targets_lead_by_a_cycle() {
    let scenario = scenario();
    let (layout, scales) = cia402();
    let mut device = VirtualDevice::new(&scenario, layout.clone(), scales, 0).unwrap();
    let mut closed_loop = scenario.played_loop().unwrap();
    let mut targets = [None; 6];
    let mut has_moved = false;
    for k in 0..600_u64 {
        assert_eq!(device.poll_due(), Some(k * 2_000_000));
        let frames = cycle(&mut device);
        let sample = *closed_loop.step().unwrap();
        for _ in 1..10 {
            closed_loop.step().unwrap();
        }
        let ids: Vec<u32> = frames.iter().map(|frame| frame.id.number()).collect();
        let expected: Vec<u32> =
            [0x080].into_iter().chain(0x181..=0x186).chain(0x201..=0x206).collect();
        assert_eq!(ids, expected);
        assert_eq!(frames[0].stamp_ns, k * 2_000_000);
        assert!(frames.windows(2).all(|pair| pair[0].stamp_ns < pair[1].stamp_ns));
        assert!(frames[12].stamp_ns < (k + 1) * 2_000_000, "the bus carries it");
        for j in 0..6 {
            let value = |quantity| read(&layout, &frames, quantity, j);
            let position = value(Quantity::Position) * TAU / COUNTS[j];
            assert!((position - sample.motor_position_rad[j]).abs() < 1e-9);
            assert_eq!(value(Quantity::StatusWord), f64::from(0x1237), "operation enabled");
            // The target sent one cycle ago is the reference now.
            let reference = (sample.motor_reference_rad[j] * COUNTS[j] / TAU).round();
            if let Some(target) = targets[j].replace(value(Quantity::Reference)) {
                let off: f64 = target - reference;
                assert!(off.abs() <= 1.0, "{k} {j}: {target} {reference}");
                has_moved |= value(Quantity::Reference) != reference;
            }
        }
    }
    assert!(has_moved);
}

#[test]
fn a_cycle_allocates_nothing() {
    for bus in [packed(), cia402()] {
        let mut device = new_device(&scenario(), bus, 0).unwrap();
        let mut frames = Vec::with_capacity(CYCLE_FRAMES);
        let counted = allocation_counter::measure(|| {
            for _ in 0..200 {
                frames.clear();
                device.poll_cycle(&mut frames).unwrap();
            }
        });
        assert_eq!(counted.count_total, 0);
    }
}

fn faulty(
    (layout, scales): (CompiledLayout, Scales),
    faults: &[(u64, FaultAction)],
) -> Vec<Vec<Frame>> {
    let faults = faults.iter().map(|&(cycle, action)| Fault { cycle, action }).collect();
    let scenario = scenario().with_faults(faults);
    let mut device = VirtualDevice::new(&scenario, layout, scales, 0).unwrap();
    (0..10).map(|_| cycle(&mut device)).collect()
}

#[test]
fn faults_happen_where_they_are_reported_to() {
    let good = faulty(cia402(), &[]);
    let bad = faulty(
        cia402(),
        &[
            (1, FaultAction::Drop { frame: 0 }),
            (2, FaultAction::Drop { frame: 3 }),
            (2, FaultAction::Drop { frame: 12 }),
            (3, FaultAction::Duplicate { frame: 6 }),
            (4, FaultAction::Pause { cycles: 2 }),
            (7, FaultAction::ErrorFrame { class: 0x20 }),
        ],
    );
    assert_eq!(bad[0], good[0]);
    assert_eq!(bad[1], good[1][1..]);
    fn without(frames: &[Frame], lost: &[usize]) -> Vec<Frame> {
        let remaining = frames.iter().enumerate().filter(|(k, _)| !lost.contains(k));
        remaining.map(|(_, frame)| *frame).collect()
    }
    assert_eq!(bad[2], without(&good[2], &[3, 12]));
    assert_eq!(bad[3][6], bad[3][7]);
    assert_eq!(without(&bad[3], &[7]), good[3]);
    assert!(bad[4].is_empty() && bad[5].is_empty());
    assert_eq!(bad[6], good[6], "the arm moved on in silence");
    assert!(bad[7][0].is_error());
    assert_eq!(bad[7][1..], good[7]);

    let (layout, _) = packed();
    let bad = faulty(packed(), &[(3, FaultAction::CorruptCounter { add: 5 })]);
    let counters: Vec<f64> =
        bad.iter().map(|frames| read(&layout, frames, Quantity::Counter, 0)).collect();
    assert_eq!(counters, [0.0, 1.0, 2.0, 8.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
}

#[test]
fn what_cannot_happen_on_this_bus_is_refused() {
    fn refused(bus: (CompiledLayout, Scales), action: FaultAction) -> DeviceError {
        let scenario = scenario().with_faults(vec![Fault { cycle: 1, action }]);
        new_device(&scenario, bus, 0).err().unwrap()
    }
    let error = refused(packed(), FaultAction::Drop { frame: 1 });
    assert!(matches!(error, DeviceError::Fault { cycle: 1, .. }), "{error}");
    let error = refused(cia402(), FaultAction::CorruptCounter { add: 1 });
    assert!(matches!(error, DeviceError::Fault { .. }), "{error}");
    let error = refused(packed(), FaultAction::ErrorFrame { class: u32::MAX });
    assert!(matches!(error, DeviceError::Frame(_)), "{error}");
}

fn name() -> [InterfaceName; 1] {
    [InterfaceName::new("can0").unwrap()]
}

fn log(scenario: &Scenario) -> Vec<u8> {
    let mut device = new_device(scenario, packed(), EPOCH_NS).unwrap();
    let writer = CandumpWriter::new(Vec::new(), &name(), StampDigits::Nanoseconds);
    let mut sink = CandumpSink::new(writer);
    let played = play(&mut device, &mut sink, Pace::Unpaced, &AtomicBool::new(false)).unwrap();
    assert_eq!((played.cycles, played.frames), (device.cycle_count(), device.cycle_count()));
    sink.finish().unwrap()
}

#[test]
fn the_same_scenario_gives_the_same_log() {
    let scenario = scenario();
    let first = log(&scenario);
    assert_eq!(first, log(&scenario));
    assert_ne!(first, log(&scenario.with_seed(2)));
    // 0.02 s of rest, 6.834 s of motion and dwells, 0.02 s of rest, at 5 kHz.
    let lines = first.iter().filter(|byte| **byte == b'\n').count();
    assert!((34_300..34_500).contains(&lines), "{lines}");
}

#[test]
fn a_reader_gets_every_frame_and_then_the_end() {
    let mut device = new_device(&scenario(), packed(), 0).unwrap();
    let cycles = device.cycle_count();
    let (sender, mut source) = in_process_bus(&name(), 64, WhenFull::Wait);
    let sending = std::thread::spawn(move || {
        let mut sink = InProcessSink::new(sender);
        play(&mut device, &mut sink, Pace::Unpaced, &AtomicBool::new(false)).unwrap()
    });
    let (mut received, mut batch) = (0, Vec::with_capacity(64));
    loop {
        batch.clear();
        match source.receive(&mut batch, Duration::from_secs(5)).unwrap() {
            Received::Frames => received += batch.len() as u64,
            Received::End => break,
            Received::Silence => panic!("the device stalled"),
        }
    }
    assert_eq!(received, cycles);
    assert_eq!(sending.join().unwrap().frames, cycles);
}

#[test]
fn it_stops_when_reported_to_or_when_nobody_listens() {
    let stop = AtomicBool::new(true);
    let (sender, source) = in_process_bus(&name(), 64, WhenFull::Wait);
    let mut sink = InProcessSink::new(sender);
    let mut device = new_device(&scenario(), packed(), 0).unwrap();
    assert_eq!(play(&mut device, &mut sink, Pace::RealTime, &stop).unwrap().cycles, 0);
    drop(source);
    stop.store(false, Ordering::Relaxed);
    let error = play(&mut device, &mut sink, Pace::Unpaced, &stop).unwrap_err();
    assert!(matches!(error, PlayError::Sink(SinkError::Closed(_))), "{error}");
}

/// A quarter of a second in real time is never shorter, and lateness does not add up.
#[test]
fn real_time_does_not_drift() {
    let mut device = new_device(&scenario(), cia402(), 0).unwrap();
    let (sender, mut source) = in_process_bus(&name(), 100_000, WhenFull::Drop);
    let stop = AtomicBool::new(false);
    let start = Instant::now();
    std::thread::scope(|scope| {
        let playing = scope.spawn(|| {
            play(&mut device, &mut InProcessSink::new(sender), Pace::RealTime, &stop).unwrap()
        });
        let mut batch = Vec::with_capacity(13);
        let mut frames = 0;
        while frames < 126 * 13 {
            batch.clear();
            source.receive(&mut batch, Duration::from_secs(5)).unwrap();
            frames += batch.len();
        }
        let elapsed = start.elapsed();
        stop.store(true, Ordering::Relaxed);
        let played = playing.join().unwrap();
        assert!(elapsed >= Duration::from_millis(250), "{elapsed:?}");
        // Were each late cycle to delay the next, 125 cycles would be late by their sum.
        let late = elapsed.saturating_sub(Duration::from_millis(250));
        assert!(
            late <= played.largest_delay + Duration::from_millis(50),
            "{late:?} {:?}",
            played.largest_delay
        );
    });
}

#[test]
fn frames_that_take_longer_than_their_cycle_are_refused() {
    let cell = include_str!("../../config/cells/tx40-cia402.toml");
    let faster = cell.replace("rate_hz = 500.0", "rate_hz = 1000.0");
    assert_ne!(cell, faster);
    let bus = crate::common::bus(&faster, include_str!("../../config/dbc/cia402_six_axes.dbc"));
    let mut device = new_device(&scenario(), bus, EPOCH_NS).unwrap();
    let mut frames = Vec::new();
    let refused = device.poll_cycle(&mut frames).unwrap_err();
    assert!(
        matches!(refused, DeviceError::Encode(CycleError::Overrun { needed_us, period_us })
            if period_us == 1000.0 && needed_us > 1500.0),
        "{refused}"
    );
    assert_eq!(frames.len(), 0);
}
