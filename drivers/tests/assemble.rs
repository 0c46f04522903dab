//! Faults put on the bus on purpose: each is counted under its cause, and nothing is lost in
//! silence.
#![allow(clippy::cast_possible_truncation, reason = "stamps of minutes fit")]

use crate::common::bus::{
    EPOCH_NS, RAD_PER_COUNT, assembler, check, check_sums, cycle, drives, feed, packed_drives,
    values, with_id,
};
use crate::common::{CIA402, PACKED, cia402, cia402_dbc, compile, packed, packed_dbc};
use didim_drivers::assemble::{Assembler, CycleLosses, FrameLosses, Losses};
use didim_drivers::frame::{Frame, FrameId, FrameKind};
use didim_drivers::layout::{CompiledLayout, CycleValues, Role};
use didim_drivers::units::Scales;
use didim_dynamics::JointSample;

/// Cycles 0 to `cycles − 1`, with `fault` done to cycle `at`; what came out after the end.
fn run(
    layout: &CompiledLayout,
    cycles: u64,
    at: u64,
    fault: impl Fn(&mut Vec<Frame>),
) -> (Vec<JointSample>, Losses) {
    let mut assembler = assembler(layout);
    let period_ns = layout.period_ns() as u64;
    // The target of sample 0, sent in the cycle before it.
    let mut frames = cycle(layout, 0, EPOCH_NS);
    frames.retain(|frame| frame.id.number() >= 0x201);
    for frame in &mut frames {
        frame.payload = layout_target(layout, frame.id);
        frame.stamp_ns -= period_ns;
    }
    for k in 0..cycles {
        let mut next = cycle(layout, k, EPOCH_NS + k * period_ns);
        if k == at {
            fault(&mut next);
        }
        frames.extend(next);
    }
    let mut samples = feed(&mut assembler, &frames);
    assembler.handle_timeout(u64::MAX);
    samples.extend(assembler.poll_sample());
    check_sums(&assembler);
    for sample in &samples {
        check(sample, (sample.stamp_ns - EPOCH_NS + period_ns / 2) / period_ns, layout.axes());
    }
    (samples, *assembler.losses())
}

/// The payload of a target frame that holds the target of cycle 0.
fn layout_target(layout: &CompiledLayout, id: FrameId) -> [u8; 64] {
    let message = layout.messages().iter().find(|message| message.format.id == id).unwrap();
    message.encode(&values(0, 0), 0).unwrap().payload
}

/// What is counted when nothing is wrong: the last targets still wait for their SYNC.
fn clean(cycles: u64, per_cycle: u64) -> Losses {
    Losses {
        frames_received: cycles * per_cycle + 6,
        frames_used: cycles * per_cycle,
        cycles_begun: cycles,
        samples: cycles,
        ..Losses::default()
    }
}

#[test]
fn a_clean_bus_gives_one_sample_per_sync() {
    let (samples, losses) = run(&cia402(), 100, 1_000, |_| ());
    assert_eq!(losses, clean(100, 13));
    for (k, sample) in (0u64..).zip(&samples) {
        assert_eq!(sample.sequence, k);
        assert_eq!(sample.stamp_ns, EPOCH_NS + k * 4_000_000);
        assert!(sample.has_reference);
    }
}

/// One fault in cycle 50 of 100: the difference from the clean run, exactly.
#[test]
fn every_fault_of_a_bus_with_sync_is_counted_under_its_cause_alone() {
    type Fault = Box<dyn Fn(&mut Vec<Frame>)>;
    type Change = Box<dyn Fn(&mut Losses)>;
    let drop_id = |id| -> Fault { Box::new(move |f| f.retain(|f| f.id != FrameId::Standard(id))) };
    let add = |make: fn(&[Frame]) -> Frame| -> Fault {
        Box::new(move |frames| frames.push(make(frames)))
    };
    let tpdo = |frames: &[Frame]| frames[with_id(frames, 0x183)];
    let cases: Vec<(&str, Fault, Change)> = vec![
        (
            "SYNC missing",
            drop_id(0x80),
            Box::new(|l| {
                // Its six TPDOs have no cycle; its targets are of before a SYNC that we have not
                // seen.
                l.frames_received -= 1;
                l.samples -= 1;
                l.cycles.missing_sync = 1;
                l.frames.late = 6;
                // Those of cycle 49 were replaced by those of cycle 50.
                l.frames.duplicate = 6;
                l.frames_used -= 13;
            }),
        ),
        (
            "SYNC twice",
            add(|f| Frame { stamp_ns: f[0].stamp_ns + 5, ..f[0] }),
            Box::new(|l| {
                l.frames_received += 1;
                l.frames.duplicate = 1;
            }),
        ),
        (
            "TPDO missing",
            drop_id(0x183),
            Box::new(|l| {
                l.frames_received -= 1;
                l.samples -= 1;
                l.cycles.missing_axis = 1;
                l.frames.cycle_lost = 12;
                l.frames_used -= 13;
            }),
        ),
        (
            "TPDO twice",
            add(|f| f[with_id(f, 0x183)]),
            Box::new(|l| {
                l.frames_received += 1;
                l.frames.duplicate = 1;
            }),
        ),
        (
            "TPDO twice, different",
            add(|f| {
                let mut frame = f[with_id(f, 0x183)];
                frame.payload[2] ^= 1;
                frame
            }),
            Box::new(|l| {
                l.frames_received += 1;
                l.samples -= 1;
                l.frames.duplicate = 1;
                l.cycles.contradiction = 1;
                l.frames.cycle_lost = 13;
                l.frames_used -= 13;
            }),
        ),
        (
            "TPDO from before its SYNC",
            Box::new(|f| {
                let place = with_id(f, 0x183);
                f[place].stamp_ns = f[0].stamp_ns - 1;
            }),
            Box::new(|l| {
                l.samples -= 1;
                l.frames.late = 1;
                l.cycles.missing_axis = 1;
                l.frames.cycle_lost = 12;
                l.frames_used -= 13;
            }),
        ),
        (
            "RPDO missing",
            drop_id(0x203),
            Box::new(|l| {
                l.frames_received -= 1;
                l.samples_without_reference = 1;
                l.frames.reference_unused = 5;
                l.frames_used -= 6;
            }),
        ),
        (
            "error frame",
            add(|f| Frame { kind: FrameKind::Error, ..f[1] }),
            Box::new(|l| {
                l.frames_received += 1;
                l.frames.error = 1;
            }),
        ),
        (
            "remote frame",
            add(|f| Frame { kind: FrameKind::Remote, ..f[1] }),
            Box::new(|l| {
                l.frames_received += 1;
                l.frames.remote = 1;
            }),
        ),
        (
            "heartbeat",
            add(|f| Frame { id: FrameId::Standard(0x701), ..f[1] }),
            Box::new(|l| {
                l.frames_received += 1;
                l.frames.unknown_id = 1;
            }),
        ),
        (
            "FD",
            add(|f| {
                let kind = FrameKind::Fd { bit_rate_switch: true, error_state_indicator: false };
                Frame { kind, ..f[1] }
            }),
            Box::new(|l| {
                l.frames_received += 1;
                l.frames.wrong_format = 1;
            }),
        ),
        (
            "seven bytes",
            add(|f| Frame { length: 7, ..f[1] }),
            Box::new(|l| {
                l.frames_received += 1;
                l.frames.wrong_length = 1;
            }),
        ),
        (
            "drive switched on only",
            Box::new(move |f| {
                let place = with_id(f, 0x183);
                assert_eq!(tpdo(f).payload[..2], [0x37, 0x12]);
                f[place].payload[0] = 0x33;
            }),
            Box::new(|l| {
                l.samples -= 1;
                l.cycles.not_enabled = 1;
                l.frames.cycle_lost = 13;
                l.frames_used -= 13;
            }),
        ),
        (
            "position out of range",
            Box::new(|f| {
                let place = with_id(f, 0x183);
                f[place].payload[2..6].copy_from_slice(&2_000_000_000_i32.to_le_bytes());
            }),
            Box::new(|l| {
                l.samples -= 1;
                l.cycles.out_of_range = 1;
                l.frames.cycle_lost = 13;
                l.frames_used -= 13;
            }),
        ),
    ];
    let dbc = cia402_dbc().replace("[-2147483648|2147483647]", "[-1000000000|1000000000]");
    let layout = compile(&dbc, CIA402);
    for (name, fault, change) in cases {
        let (samples, losses) = run(&layout, 100, 50, fault);
        let mut expected = clean(100, 13);
        change(&mut expected);
        assert_eq!(losses, expected, "{name}");
        assert_eq!(samples.last().unwrap().sequence, 99, "{name}");
    }
}

#[test]
fn a_frame_that_comes_in_the_next_cycle_is_late_there() {
    let layout = cia402();
    let mut frames: Vec<Frame> =
        (0..10).flat_map(|k| cycle(&layout, k, EPOCH_NS + k * 4_000_000)).collect();
    // Axis 3 of cycle 5 comes after SYNC 6.
    let place = 5 * 13 + 3;
    let mut late = frames.remove(place);
    late.stamp_ns = EPOCH_NS + 6 * 4_000_000 + 1_000;
    let sync = 6 * 13 - 1;
    assert_eq!(frames[sync].id, FrameId::Standard(0x80));
    frames.insert(sync + 1, late);
    let mut assembler = assembler(&layout);
    let samples = feed(&mut assembler, &frames);
    for sample in &samples {
        check(sample, sample.sequence, 6);
    }
    let sequences: Vec<u64> = samples.iter().map(|sample| sample.sequence).collect();
    assert_eq!(sequences, [0, 1, 2, 3, 4, 6, 7, 8]);
    let losses = assembler.losses();
    assert_eq!(losses.cycles, CycleLosses { missing_axis: 1, ..CycleLosses::default() });
    // The SYNC, five drives, and the six targets that were for it.
    let expected = FrameLosses { late: 1, cycle_lost: 12, ..FrameLosses::default() };
    assert_eq!(losses.frames, expected);
}

#[test]
fn a_target_takes_effect_at_the_next_sync() {
    let layout = cia402();
    let mut assembler = assembler(&layout);
    let mut frames = Vec::new();
    for k in 0..20 {
        frames.extend(cycle(&layout, k, EPOCH_NS + k * 4_000_000));
    }
    let samples = feed(&mut assembler, &frames);
    assert!(!samples[0].has_reference);
    for sample in &samples[1..] {
        // The target sent in cycle k − 1 was that of k.
        assert!(sample.has_reference);
        let position = sample.motor_position_rad[2] + 5.0 * RAD_PER_COUNT;
        assert!((sample.motor_reference_rad[2] - position).abs() < 1e-9);
    }
    // The same bus, said to be instant: the target of cycle k is its own.
    let instant = compile(cia402_dbc(), &CIA402.replace("next-sync", "instant"));
    let mut assembler = crate::common::bus::assembler(&instant);
    for sample in feed(&mut assembler, &frames) {
        assert!(sample.has_reference);
        let position = sample.motor_position_rad[2] + 6.0 * RAD_PER_COUNT;
        assert!((sample.motor_reference_rad[2] - position).abs() < 1e-9);
    }
}

#[test]
fn targets_from_before_a_missing_sync_are_outdated() {
    let layout = cia402();
    let mut frames: Vec<Frame> =
        (0..10).flat_map(|k| cycle(&layout, k, EPOCH_NS + k * 4_000_000)).collect();
    // SYNC 5 and the targets of cycle 5 are lost: those of cycle 4 were for SYNC 5.
    let is_lost = |frame: &Frame| {
        let k = (frame.stamp_ns - EPOCH_NS) / 4_000_000;
        k == 5 && (frame.id == FrameId::Standard(0x80) || frame.id.number() > 0x200)
    };
    frames.retain(|frame| !is_lost(frame));
    let mut assembler = assembler(&layout);
    let samples = feed(&mut assembler, &frames);
    for sample in &samples {
        check(sample, sample.sequence, 6);
        assert_eq!(sample.has_reference, sample.sequence != 0 && sample.sequence != 6);
    }
    assert_eq!(assembler.losses().frames.reference_unused, 6);
}

#[test]
fn the_order_of_the_frames_in_a_cycle_does_not_matter() {
    let layout = cia402();
    let (mut forward, mut backward) = (assembler(&layout), assembler(&layout));
    for k in 0..50 {
        let frames = cycle(&layout, k, EPOCH_NS + k * 4_000_000);
        let mut reversed = frames.clone();
        reversed[1..].reverse();
        for (a, b) in frames.iter().zip(&mut reversed) {
            b.stamp_ns = a.stamp_ns;
        }
        assert_eq!(feed(&mut forward, &frames), feed(&mut backward, &reversed));
    }
    assert_eq!(forward.losses(), backward.losses());
    assert_eq!(forward.losses().samples, 49);
}

#[test]
fn microseconds_give_the_samples_of_nanoseconds() {
    for layout in [cia402(), packed()] {
        let (mut fine, mut coarse) = (assembler(&layout), assembler(&layout));
        // Jitter of up to a fifth of the period, and gaps.
        let mut jitter = 1_u64;
        for k in (0..3_000).filter(|k| *k == 0 || k % 97 != 5 && k % 501 > 8) {
            jitter = jitter.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(k);
            let period_ns = layout.period_ns() as u64;
            let stamp_ns = EPOCH_NS + k * period_ns + (jitter >> 33) % (period_ns / 5);
            let frames = cycle(&layout, k, stamp_ns);
            let mut cut = frames.clone();
            for frame in &mut cut {
                frame.stamp_ns -= frame.stamp_ns % 1_000;
            }
            let (a, b) = (feed(&mut fine, &frames), feed(&mut coarse, &cut));
            assert_eq!(a.len(), b.len());
            for (a, b) in a.iter().zip(&b) {
                assert_eq!(a.sequence, b.sequence);
                assert_eq!(a.stamp_ns - a.stamp_ns % 1_000, b.stamp_ns);
                assert_eq!(*a, JointSample { stamp_ns: a.stamp_ns, ..*b });
                check(a, a.sequence, 6);
            }
        }
        assert_eq!(fine.losses(), coarse.losses());
        assert_eq!(fine.losses().cycles_begun, 3_000);
        assert!(fine.losses().cycles.total() > 70);
    }
}

/// Two hours of a bus whose clock is 200 ppm off, with jitter and gaps: no cycle is miscounted.
#[test]
fn hours_of_drift_do_not_slip_a_cycle() {
    let spec = CIA402.replace("axes = 6", "axes = 1");
    let layout = compile(cia402_dbc(), &spec);
    let mut assembler = assembler(&layout);
    let mut jitter = 7_u64;
    let mut samples = 0;
    for k in 0..1_800_000_u64 {
        if k % 10_000 > 9_900 {
            continue;
        }
        jitter = jitter.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963);
        let stamp_ns = EPOCH_NS + k * 4_000_800 + (jitter >> 40) % 1_200_000;
        let mut payloads = Vec::with_capacity(2);
        for role in [Role::Sync, Role::Sample] {
            layout.encode(role, &values(k, 1), stamp_ns, &mut payloads).unwrap();
        }
        for frame in &payloads {
            assembler.handle_frame(frame);
            if let Some(sample) = assembler.poll_sample() {
                assert_eq!(sample.sequence, (sample.stamp_ns - EPOCH_NS) / 4_000_800);
                samples += 1;
            }
        }
    }
    assert_eq!(samples, 180 * 9_901 - 1);
    assert_eq!(assembler.losses().cycles.missing_sync, 179 * 99);
    assert!((assembler.measured_period_ns() - 4_000_800.0).abs() < 100.0 * 4.0);
}

#[test]
fn a_silence_is_as_many_cycles_as_the_stamps_show_and_a_step_of_the_clock_is_one() {
    let hour = CycleLosses { silence: 900_000, ..CycleLosses::default() };
    let gap = CycleLosses { silence: 8_000, ..CycleLosses::default() };
    let step = CycleLosses { clock_step: 1, ..CycleLosses::default() };
    for (name, pause_ns, expected) in [
        ("an hour", 3_600_000_000_000_i64, hour),
        ("8,000 cycles", 32_000_000_000, gap),
        ("a step", -5_000_000_000, step),
    ] {
        let layout = cia402();
        let mut assembler = assembler(&layout);
        let mut samples = Vec::new();
        for k in 0..20_u64 {
            let pause = if k < 10 { 0 } else { pause_ns };
            let stamp_ns = (EPOCH_NS + k * 4_000_000).checked_add_signed(pause).unwrap();
            samples.extend(feed(&mut assembler, &cycle(&layout, k, stamp_ns)));
        }
        assert_eq!(assembler.losses().cycles, expected, "{name}");
        let sequences: Vec<u64> = samples.iter().map(|sample| sample.sequence).collect();
        let after = 10 + expected.total();
        assert_eq!(sequences[8..12], [8, 9, after, after + 1], "{name}");
    }
}

/// 8,000 cycles, 1.6 s, are missing. After them the counter starts anew.
#[test]
fn a_silence_of_a_packed_bus_is_what_its_counter_says() {
    let (first, gap) = (70_000, 8_000);
    let losses_of = |silence, restart, counter_gap| CycleLosses {
        silence,
        restart,
        counter_gap,
        ..CycleLosses::default()
    };
    let uncounted = PACKED.replace("counter = \"Sample.Counter\"\n", "");
    let frames = PACKED.replace("axes = 6", "axes = 6\ncycles_by = \"frames\"");
    // The layout, the counter after the gap, and what is lost.
    let cases = [
        (PACKED, first + 10 + gap, losses_of(0, 0, gap)),
        (PACKED, 0, losses_of(gap - 1, 1, 0)),
        (uncounted.as_str(), 0, losses_of(gap, 0, 0)),
        (frames.as_str(), first + 10 + gap, losses_of(0, 0, gap)),
        (frames.as_str(), 0, losses_of(0, 1, 0)),
    ];
    for (spec, counter, expected) in cases {
        let layout = compile(packed_dbc(), spec);
        let mut assembler = assembler(&layout);
        let mut samples = Vec::new();
        for k in 0..20 {
            let (cycle, counter) =
                if k < 10 { (k, first + k) } else { (k + gap, counter + k - 10) };
            let mut frames = Vec::new();
            let values = CycleValues { counter, ..values(k, 0) };
            layout.encode(Role::Sample, &values, EPOCH_NS + cycle * 200_000, &mut frames).unwrap();
            samples.extend(feed(&mut assembler, &frames));
        }
        assert_eq!(assembler.losses().cycles, expected, "{spec}");
        let sequences: Vec<u64> = samples.iter().map(|sample| sample.sequence).collect();
        let after = 10 + expected.total();
        assert_eq!(sequences[8..12], [8, 9, after, after + 1], "{spec}");
    }
}

/// Drives that are switched off together are at rest; one that is off alone is a fault.
#[test]
fn cycles_of_drives_that_are_all_disabled_are_idle() {
    let layout = cia402();
    for (disabled, idle) in [(6, 10), (1, 0), (5, 0)] {
        let mut assembler = assembler(&layout);
        for k in 0..10 {
            let mut values = values(k, 1);
            for axis in values.axes.iter_mut().take(disabled) {
                axis.status_word = 0x0250;
            }
            let mut frames = Vec::new();
            for role in [Role::Sync, Role::Sample, Role::Target] {
                layout.encode(role, &values, EPOCH_NS + k * 4_000_000, &mut frames).unwrap();
            }
            assert!(feed(&mut assembler, &frames).is_empty());
        }
        assembler.handle_timeout(u64::MAX);
        let losses = assembler.losses();
        assert_eq!((losses.cycles.not_enabled, losses.cycles_idle), (10, idle), "{disabled}");
    }
}

#[test]
fn silence_ends_the_cycle_and_what_follows_is_late() {
    let layout = cia402();
    let mut assembler = assembler(&layout);
    let frames = cycle(&layout, 0, EPOCH_NS);
    assert!(feed(&mut assembler, &frames[..6]).is_empty());
    assembler.handle_timeout(EPOCH_NS + 3_999_999);
    assert_eq!(assembler.losses().cycles.missing_axis, 0);
    assembler.handle_timeout(EPOCH_NS + 4_000_000);
    assert_eq!(assembler.losses().cycles.missing_axis, 1);
    feed(&mut assembler, &frames[6..7]);
    assert_eq!(assembler.losses().frames.late, 1);
    check_sums(&assembler);
}

#[test]
fn what_comes_before_the_first_sync_has_no_cycle() {
    let layout = cia402();
    let mut assembler = assembler(&layout);
    feed(&mut assembler, &cycle(&layout, 0, EPOCH_NS)[1..]);
    assert_eq!(assembler.losses().frames.before_first_sync, 6);
    assert_eq!(assembler.frames_waiting(), 6);
}

#[test]
fn a_sample_that_nobody_takes_is_counted() {
    let layout = packed();
    let mut assembler = assembler(&layout);
    for k in 0..3 {
        assembler.handle_frame(&cycle(&layout, k, EPOCH_NS + k * 200_000)[0]);
    }
    assert_eq!(assembler.poll_sample().unwrap().sequence, 2);
    assert_eq!(assembler.losses().cycles.not_taken, 2);
    check_sums(&assembler);
}

/// A packed bus with counter `counter(k)` in cycle `k`, without the cycles `skipped`.
fn run_packed(counter: impl Fn(u64) -> u64, skipped: &[u64]) -> (Vec<JointSample>, Losses) {
    let layout = packed();
    let mut assembler = assembler(&layout);
    let mut samples = Vec::new();
    for k in (0..100).filter(|k| !skipped.contains(k)) {
        let mut frames = Vec::new();
        let values = CycleValues { counter: counter(k), ..values(k, 0) };
        layout.encode(Role::Sample, &values, EPOCH_NS + k * 200_000, &mut frames).unwrap();
        samples.extend(feed(&mut assembler, &frames));
    }
    (samples, *assembler.losses())
}

#[test]
fn the_counter_of_a_packed_frame_shows_what_is_lost() {
    let start = u64::from(u32::MAX) - 30;
    let (samples, losses) = run_packed(|k| start + k, &[]);
    assert_eq!(losses.samples, 100);
    assert_eq!(losses.cycles.total() + losses.frames.total(), 0);
    assert!(samples.iter().all(|sample| sample.has_reference));

    let (samples, losses) = run_packed(|k| start + k, &[40, 41, 42]);
    assert_eq!(losses.cycles, CycleLosses { counter_gap: 3, ..CycleLosses::default() });
    assert_eq!(samples[40].sequence, 43);
    assert_eq!(losses.frames.total(), 0);

    // One counter twice: the second is none, and the next is two periods later.
    let (_, losses) = run_packed(|k| if k < 50 { k } else { k - 1 }, &[]);
    assert_eq!(losses.frames.counter_repeated, 1);
    assert_eq!(losses.cycles.total(), 0);

    // The device starts again at 0.
    let (samples, losses) = run_packed(|k| if k < 50 { 3_000_000_000 + k } else { k - 50 }, &[]);
    assert_eq!(losses.cycles, CycleLosses { restart: 1, ..CycleLosses::default() });
    assert_eq!((samples[49].sequence, samples[50].sequence), (49, 51));
}

#[test]
fn without_a_counter_the_stamps_show_what_is_lost() {
    let spec = PACKED.replace("counter = \"Sample.Counter\"\n", "");
    let layout = compile(packed_dbc(), &spec);
    let mut assembler = assembler(&layout);
    let mut samples = Vec::new();
    for k in (0..100).filter(|k| *k != 30 && *k != 31) {
        samples.extend(feed(&mut assembler, &cycle(&layout, k, EPOCH_NS + k * 200_000)));
    }
    assert_eq!(samples[30].sequence, 32);
    let expected = CycleLosses { missing_sync: 2, ..CycleLosses::default() };
    assert_eq!(assembler.losses().cycles, expected);
}

#[test]
fn a_packed_target_can_be_that_of_the_next_frame() {
    let spec = PACKED.replace(
        "Sample.Reference_{axis}\", valid = \"instant\"",
        "Sample.Reference_{axis}\", valid = \"next-sync\"",
    );
    let layout = compile(packed_dbc(), &spec);
    let mut assembler = assembler(&layout);
    for k in (0..20).filter(|k| *k != 7) {
        for sample in feed(&mut assembler, &cycle(&layout, k, EPOCH_NS + k * 200_000)) {
            check(&sample, k, 6);
            assert_eq!(sample.has_reference, k != 0 && k != 8);
        }
    }
}

/// An axis that runs through the end of int32.
fn through_the_end(wraps: &str) -> Assembler {
    let layout = packed();
    let text = packed_drives()
        .replace("wraps = \"refuse\"", &format!("wraps = \"{wraps}\""))
        .replace("zero = 0", "zero = 2147483000");
    let scales = Scales::new(&drives(&text, 6), &layout).unwrap();
    let mut assembler = Assembler::new(layout.clone(), scales);
    let mut last: Option<JointSample> = None;
    for k in 0..100_u64 {
        let counts = i32::MAX.wrapping_sub(500).wrapping_add(10 * k as i32);
        let mut cycle = CycleValues { counter: k, ..CycleValues::default() };
        for axis in &mut cycle.axes {
            axis.position = counts.into();
            axis.reference = counts.into();
        }
        let mut frames = Vec::new();
        layout.encode(Role::Sample, &cycle, EPOCH_NS + k * 200_000, &mut frames).unwrap();
        for sample in feed(&mut assembler, &frames) {
            if let Some(last) = last {
                let step = sample.motor_position_rad[0] - last.motor_position_rad[0];
                assert!((step - 10.0 * RAD_PER_COUNT).abs() < 1e-9);
                assert!(sample.has_reference);
            }
            last = Some(sample);
        }
    }
    assembler
}

#[test]
fn a_position_that_wraps_goes_on_or_is_refused() {
    assert_eq!(through_the_end("modulo").losses().samples, 100);
    let refused = through_the_end("refuse");
    assert_eq!(refused.losses().samples, 51);
    let expected = CycleLosses { out_of_range: 49, ..CycleLosses::default() };
    assert_eq!(refused.losses().cycles, expected);
}

/// A drive that says nonsense before it knows where it is.
#[test]
fn a_bad_first_position_does_not_lock_the_axis_out() {
    let layout = packed();
    let mut assembler = assembler(&layout);
    let mut sequences = Vec::new();
    for k in 0..20_u64 {
        let mut cycle = values(k, 0);
        if k == 0 {
            cycle.axes[4].position = f64::from(i32::MIN);
        }
        let mut frames = Vec::new();
        layout.encode(Role::Sample, &cycle, EPOCH_NS + k * 200_000, &mut frames).unwrap();
        for sample in feed(&mut assembler, &frames) {
            if k > 0 {
                check(&sample, k, 6);
            }
            sequences.push(sample.sequence);
        }
    }
    // Three that agree prove that the first one was wrong.
    let expected = CycleLosses { out_of_range: 2, restart: 1, ..CycleLosses::default() };
    assert_eq!(assembler.losses().cycles, expected);
    assert_eq!(sequences[..3], [0, 4, 5]);
    assert_eq!(sequences.len(), 17);
}

/// Where the frames count the cycles, nothing depends on their stamps: here the bus runs at a third
/// of its rate, with bursts that catch up and jitter of whole periods.
#[test]
fn frames_count_the_cycles_where_the_layout_says_so() {
    for (spec, dbc, per_cycle) in [(CIA402, cia402_dbc(), 13), (PACKED, packed_dbc(), 1)] {
        let by_frames = spec.replace("axes = 6", "axes = 6\ncycles_by = \"frames\"");
        assert_ne!(by_frames, spec);
        let layout = compile(dbc, &by_frames);
        let mut assembler = assembler(&layout);
        let period_ns = layout.period_ns() as u64;
        let (mut stamp_ns, mut frames) = (EPOCH_NS, Vec::new());
        for k in 0..3_000 {
            stamp_ns += match k % 100 {
                0 => 40 * period_ns,
                1..=30 => period_ns / 50,
                _ => 3 * period_ns + (k % 7) * period_ns / 3,
            };
            let before = frames.len();
            frames.extend(cycle(&layout, k, stamp_ns));
            // A burst has one stamp for many frames.
            for frame in &mut frames[before..] {
                frame.stamp_ns = stamp_ns;
            }
        }
        let mut samples = feed(&mut assembler, &frames);
        // The last cycle is whole: a short rest decides it.
        assembler.handle_timeout(stamp_ns + 2 * period_ns);
        samples.extend(assembler.poll_sample());
        check_sums(&assembler);
        assert_eq!(samples.len(), 3_000);
        for (k, sample) in (0_u64..).zip(&samples) {
            assert_eq!(sample.sequence, k);
            check(sample, k, 6);
        }
        let losses = assembler.losses();
        assert_eq!(losses.cycles, CycleLosses::default());
        assert_eq!(losses.frames_received, 3_000 * per_cycle);
        assert_eq!(losses.frames, FrameLosses::default());
    }
}
