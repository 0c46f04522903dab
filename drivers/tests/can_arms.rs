//! Arms without a SYNC, by the shipped cells: logs of a known motion decode to it.
//!
//! The logs and their truth are made: joint j at 0.4 sin(2π (0.3 + 0.1 j) t + j) rad, under a
//! torque of its position and speed. `fixtures/*_truth.csv` has both, of each frame with its stamp.

#![allow(clippy::needless_range_loop, reason = "axes of truth and of samples")]

use std::path::Path;

use didim_drivers::assemble::{Assembler, CycleLosses, FrameLosses, Losses};
use didim_drivers::frame::Frame;
use didim_drivers::layout::{CompiledLayout, LayoutError, LayoutSpec};
use didim_drivers::samples::Samples;
use didim_drivers::source::{Received, Source as _, TextLog};
use didim_drivers::units::{DriveSpec, Scales};
use didim_dynamics::JointSample;

use crate::common::bus::{check_sums, feed};

/// Where the logs begin \[ns\].
const EPOCH_NS: u64 = 1_700_000_000_000_000_000;

#[derive(serde::Deserialize)]
struct Cell {
    bus: Bus,
}

#[derive(serde::Deserialize)]
struct Bus {
    layout: LayoutSpec,
    drives: Vec<DriveSpec>,
}

fn config(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config").join(file);
    std::fs::read_to_string(path).unwrap()
}

/// A shipped cell, with some of its text replaced.
fn compile(cell: &str, replaced: &[(&str, &str)]) -> Result<(CompiledLayout, Scales), LayoutError> {
    let mut text = config(&format!("cells/{cell}.toml"));
    for (from, to) in replaced {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let bus = toml::from_str::<Cell>(&text).unwrap().bus;
    let dbc = bus.layout.dbc.as_ref().unwrap().file_name().unwrap().to_str().unwrap().to_owned();
    let layout = CompiledLayout::compile(&config(&format!("dbc/{dbc}")), &bus.layout)?;
    let scales = Scales::new(&bus.drives, &layout).unwrap();
    Ok((layout, scales))
}

fn assembler(cell: &str) -> Assembler {
    let (layout, scales) = compile(cell, &[]).unwrap();
    Assembler::new(layout, scales)
}

fn fixture(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn frames(log: &str) -> Vec<Frame> {
    let mut source = TextLog::open(&fixture(log), &[]).unwrap();
    let (mut all, mut batch) = (Vec::new(), Vec::with_capacity(4096));
    while source.receive(&mut batch, std::time::Duration::ZERO).unwrap() != Received::End {
        all.append(&mut batch);
    }
    all
}

fn decode(cell: &str, log: &str) -> (Vec<JointSample>, Losses) {
    let source = TextLog::open(&fixture(log), &[]).unwrap();
    let mut samples = Samples::new(Box::new(source), assembler(cell), 64);
    let decoded = samples.by_ref().map(Result::unwrap).collect();
    (decoded, *samples.losses())
}

/// The samples of a log by a shipped cell.
pub(crate) fn samples_of(cell: &str, log: &str) -> Vec<JointSample> {
    decode(cell, log).0
}

/// Of each cycle and axis: stamp \[s\], position \[rad\], torque \[N·m\]; nothing where no frame
/// came.
fn truth(name: &str, axes: usize) -> Vec<Vec<Option<[f64; 3]>>> {
    let text = std::fs::read_to_string(fixture(name)).unwrap();
    let mut rows: Vec<Vec<Option<[f64; 3]>>> = Vec::new();
    for line in text.lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small counts")]
        let (cycle, axis) = (cells[0] as usize, cells[1] as usize - 1);
        rows.resize_with(rows.len().max(cycle + 1), || vec![None; axes]);
        rows[cycle][axis] = Some([cells[2], cells[3], cells[5]]);
    }
    rows
}

/// Linear between two points (time, value).
fn between(at: f64, (t0, x0): (f64, f64), (t1, x1): (f64, f64)) -> f64 {
    x0 + (x1 - x0) * (at - t0) / (t1 - t0)
}

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() <= tolerance, "{what}: {found}, expected {expected}");
}

#[test]
fn a_pipers_log_decodes_to_its_truth() {
    let (samples, losses) = decode("piper", "piper_1s.log");
    let truth = truth("piper_1s_truth.csv", 6);
    let sequences: Vec<u64> = samples.iter().map(|sample| sample.sequence).collect();
    assert_eq!(sequences, (1..199).collect::<Vec<u64>>());
    for sample in &samples {
        let k = usize::try_from(sample.sequence).unwrap();
        // Angles come 3 ms after the cycle of the truth begins, those of the next pair 0.15 ms
        // later.
        #[allow(clippy::cast_precision_loss, reason = "small counts")]
        let angles = |k: usize, axis: usize| 5e-3 * k as f64 + 3e-3 + 0.15e-3 * (axis / 2) as f64;
        let angles_expected = angles(k, 0);
        assert_eq!(sample.stamp_ns, EPOCH_NS + 5_000_000 * sample.sequence + 3_000_000);
        for axis in 0..6 {
            let row = |k: usize| truth[k][axis].unwrap();
            let position = |k: usize| (angles(k, axis), row(k)[1]);
            let torque = |k: usize| (row(k)[0], row(k)[2]);
            let expected = between(angles_expected, position(k - 1), position(k));
            // Half a step of 0.001 deg, and what the truth was rounded to.
            close(sample.motor_position_rad[axis], expected, 1e-5, "position");
            // Half a milliampere.
            let step = 0.5e-3 * if axis < 3 { 4.725 } else { 0.95844 };
            let expected = between(angles_expected, torque(k), torque(k + 1));
            close(sample.motor_torque_nm[axis], expected, step + 1e-5, "torque");
        }
    }
    // The log begins and ends with currents: the first angles have none before them to be
    // interpolated from, and the last no currents after them.
    let cycles = CycleLosses { missing_axis: 2, ..CycleLosses::default() };
    assert_eq!((losses.cycles, losses.samples), (cycles, 198));
    let frames =
        FrameLosses { before_first_sync: 6 + 6, cycle_lost: 3 + 6 + 3, ..FrameLosses::default() };
    assert_eq!(losses.frames, frames);
}

#[test]
fn an_openarms_log_decodes_to_its_truth_and_a_reply_that_never_came_costs_its_cycle() {
    let (samples, losses) = decode("openarm", "openarm_half_second.log");
    let truth = truth("openarm_half_second_truth.csv", 7);
    let sequences: Vec<u64> = samples.iter().map(|sample| sample.sequence).collect();
    let expected: Vec<u64> = (1..250).filter(|k| *k != 100).collect();
    assert_eq!(sequences, expected);
    let lsb = [26.4e-3, 26.4e-3, 13.7e-3, 13.7e-3, 4.9e-3, 4.9e-3, 4.9e-3];
    for sample in &samples {
        let k = usize::try_from(sample.sequence).unwrap();
        #[allow(clippy::cast_precision_loss, reason = "small counts")]
        let time_s = 2e-3 * k as f64;
        assert_eq!(sample.stamp_ns, EPOCH_NS + 2_000_000 * sample.sequence);
        assert!(sample.has_reference);
        for axis in 0..7 {
            let before = truth[k - 1][axis].or_else(|| truth[k - 2][axis]).unwrap();
            let after = truth[k][axis].unwrap();
            let value = |of: usize| between(time_s, (before[0], before[of]), (after[0], after[of]));
            close(sample.motor_position_rad[axis], value(1), 0.2e-3, "position");
            close(sample.motor_torque_nm[axis], value(2), 0.51 * lsb[axis], "torque");
            // The target of each command is the motion at the beginning of its cycle.
            #[allow(clippy::cast_precision_loss, reason = "small counts")]
            let (joint, later) = ((axis + 1) as f64, 1e-4 * axis as f64);
            let q = |t: f64| 0.4 * (std::f64::consts::TAU * (0.3 + 0.1 * joint) * t + joint).sin();
            let expected = between(
                time_s,
                (time_s - 2e-3 + later, q(time_s - 2e-3)),
                (time_s + later, q(time_s)),
            );
            close(sample.motor_reference_rad[axis], expected, 0.2e-3, "reference");
        }
    }
    // The first cycle has nothing before it to be interpolated from.
    let cycles = CycleLosses { missing_axis: 2, ..CycleLosses::default() };
    assert_eq!((losses.cycles, losses.samples), (cycles, 248));
    let frames = FrameLosses {
        unknown_id: 1, // A read of a register …
        excepted: 1,   // … and the answer to it.
        cycle_lost: 14 + 13,
        ..FrameLosses::default()
    };
    assert_eq!(losses.frames, frames);
}

/// Logs of adapters begin at 0: what came before them is nothing, and no value of that time.
#[test]
fn a_log_that_begins_at_zero_gives_the_same() {
    let log = frames("openarm_half_second.log");
    let shifted: Vec<Frame> =
        log.iter().map(|frame| frame.with_stamp(frame.stamp_ns - EPOCH_NS)).collect();
    let (mut one, mut other) = (assembler("openarm"), assembler("openarm"));
    let (expected, found) = (feed(&mut one, &log), feed(&mut other, &shifted));
    let same = expected
        .iter()
        .zip(&found)
        .all(|(one, other)| JointSample { stamp_ns: other.stamp_ns, ..*one } == *other);
    assert!(same);
    assert_eq!(one.losses(), other.losses());
}

/// The frames of the OpenArm's log as another process and its registers would have them.
#[test]
fn what_is_no_answer_to_a_command_costs_no_sample() {
    let clean = frames("openarm_half_second.log");
    let expected = feed(&mut assembler("openarm"), &clean);
    let mut busy = Vec::new();
    for frame in &clean {
        busy.push(*frame);
        let id = frame.id.to_string();
        fn changed_frame(bytes: &[u8], later_ns: u64, frame: &Frame) -> Frame {
            let mut other = *frame;
            other.payload[..bytes.len()].copy_from_slice(bytes);
            other.stamp_ns += later_ns;
            other
        }
        match id.as_str() {
            // A register that is written and stored.
            "013" => busy.extend([
                changed_frame(&[3, 0, 0x55], 1_000, frame),
                changed_frame(&[3, 0, 0xAA], 2_000, frame),
            ]),
            // Another process asks as well: a second answer in the cycle, of another position.
            "015" => busy.push(changed_frame(&[0x15, 0x80, 0x40], 1_000, frame)),
            // A motor is enabled that is so already.
            "004" => busy.push(changed_frame(
                &[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFC],
                1_000,
                frame,
            )),
            _ => {}
        }
    }
    let mut assembler = assembler("openarm");
    let samples = feed(&mut assembler, &busy);
    let losses = assembler.losses();
    assert_eq!(losses.cycles, CycleLosses { missing_axis: 2, ..CycleLosses::default() });
    assert_eq!((losses.frames.excepted, losses.frames.duplicate), (1 + 2 * 249 + 250, 250));
    assert_eq!(samples.len(), expected.len());
    for (found, expected) in samples.iter().zip(&expected) {
        // The second answer is a value of axis 5 too, before the next instant.
        for axis in [0, 1, 2, 3, 5, 6] {
            let (one, other) = (found.motor_position_rad[axis], expected.motor_position_rad[axis]);
            close(one, other, 0.0, "position");
        }
    }
}

#[test]
fn a_motor_that_is_not_enabled_costs_the_cycle_and_nothing_is_interpolated_from_it() {
    let mut log = frames("openarm_half_second.log");
    let of_cycle = |frame: &Frame, k: u64| (frame.stamp_ns - EPOCH_NS) / 2_000_000 == k;
    for frame in &mut log {
        if frame.id.to_string() == "012" && of_cycle(frame, 30) {
            frame.payload[0] = 0x02;
        }
    }
    let mut assembler = assembler("openarm");
    let samples = feed(&mut assembler, &log);
    let cycles = CycleLosses { missing_axis: 3, not_enabled: 1, ..CycleLosses::default() };
    assert_eq!((assembler.losses().cycles, assembler.losses().cycles_idle), (cycles, 0));
    assert!(samples.iter().all(|sample| ![30, 31].contains(&sample.sequence)));
    // All of them at rest.
    for frame in log
        .iter_mut()
        .filter(|frame| (0x11..0x18).any(|id| frame.id.to_string() == format!("{id:03X}")))
    {
        frame.payload[0] &= 0x0F;
    }
    let mut assembler = self::assembler("openarm");
    assert!(feed(&mut assembler, &log).is_empty());
    assert_eq!(assembler.losses().cycles_idle, assembler.losses().cycles.not_enabled);
    assert_eq!(assembler.losses().cycles.not_enabled, 248);
}

/// Frames that come early or late by a share of the period move no sample by more than the
/// interpolation misses: what a signal is worth follows from when its own frame came.
#[test]
fn frames_that_are_late_are_worth_their_own_instant() {
    let (layout, scales) = compile("openarm", &[]).unwrap();
    let motion = |t: f64| 0.5 * (std::f64::consts::TAU * 0.8 * t).sin();
    let mut seed = 7_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        #[allow(clippy::cast_precision_loss, reason = "31 bits")]
        let uniform = (seed >> 33) as f64 / f64::from(1_u32 << 31);
        uniform
    };
    let mut log = Vec::new();
    for k in 0..500_u64 {
        let start = EPOCH_NS + 2_000_000 * k;
        for message in layout.messages() {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "below 2 ms"
            )]
            let late_ns =
                if message.format.id.to_string() == "001" { 0 } else { (1.9e6 * random()) as u64 };
            #[allow(clippy::cast_precision_loss, reason = "a second")]
            let t = (start - EPOCH_NS + late_ns) as f64 * 1e-9;
            let mut values = didim_drivers::layout::CycleValues::default();
            for axis in &mut values.axes {
                (axis.position, axis.torque, axis.reference) = (motion(t), motion(t), motion(t));
                axis.status_word = 1;
            }
            log.push(message.encode(&values, start + late_ns).unwrap());
        }
    }
    log.sort_by_key(|frame| frame.stamp_ns);
    let mut assembler = Assembler::new(layout, scales);
    let samples = feed(&mut assembler, &log);
    check_sums(&assembler);
    assert!(samples.len() > 490, "{:?}", assembler.losses());
    for sample in &samples {
        #[allow(clippy::cast_precision_loss, reason = "a second")]
        let t = (sample.stamp_ns - EPOCH_NS) as f64 * 1e-9;
        for axis in 0..7 {
            // Half a step, and a (t1 - t0)² / 8 of at most 12.6 rad/s² and 3.9 ms.
            close(sample.motor_position_rad[axis], motion(t), 0.191e-3 + 24e-6, "position");
            close(sample.motor_reference_rad[axis], motion(t), 0.191e-3 + 24e-6, "reference");
        }
    }
}

#[test]
fn what_does_not_fit_the_arrivals_is_refused() {
    fn refused(replaced: &[(&str, &str)], expected: &str) {
        let error = compile("openarm", replaced).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let torque = "torque = { signal = \"Feedback_{axis}.Torque\", valid = \"arrival\" }";
    let instant = torque.replace("arrival", "instant");
    refused(&[(torque, &instant)], "`torque.valid`: either every signal");
    let reference = "PositionRef\", valid = \"arrival\"";
    refused(&[(reference, "PositionRef\", valid = \"next-sync\"")], "`reference.valid`: either");
    refused(
        &[("sync = \"MitCommand_1\"\n", "")],
        "`sync`: missing: signals are valid at the arrival",
    );
    refused(&[("rate_hz = 500.0", "rate_hz = 500.0\ncycles_by = \"frames\"")], "`cycles_by`");
    refused(&[("\"arrival\"", "\"instant\"")], "`sync`: carries `MitCommand_1.PositionRef`");
    refused(&[("Feedback_{axis}.Register", "Feedback_{axis}.Position")], "factor 1");
    refused(&[("Feedback_{axis}.Register", "Feedback_8.Register")], "in no message");
    refused(&[("enabled = {", "status_word = \"A.B\"\nenabled = {")], "`enabled`: says what");
    let error = compile("piper", &[("\"JointFeedback_12.Position_2\",", "")]).unwrap_err();
    assert!(error.to_string().contains("5 signals for 6 axes"), "{error}");
}

/// The joints of a RealMan arm: degrees, currents, and the first command begins the cycle.
#[test]
fn joints_of_a_realman_arm_decode() {
    let layout = r#"
        dbc = "realman_joint.dbc"
        axes = 7
        rate_hz = 200.0
        sync = "ServoCommand_1"
        position = { signal = "ServoFeedback_{axis}.Position", valid = "arrival" }
        torque = { signal = "ServoFeedback_{axis}.Current", valid = "arrival" }
        reference = { signal = "ServoCommand_{axis}.TargetPosition", valid = "arrival" }
        enabled = { signal = "ServoFeedback_{axis}.Enabled", is = 1 }
    "#;
    let layout = crate::common::compile(&config("dbc/realman_joint.dbc"), layout);
    let drives = r#"
        [[drives]]
        position = { scale = "deg", sign = -1, zero = 10.0, wraps = "refuse", provenance = "test" }
        torque = { scale = { nm_per_a = 2.5 }, sign = -1, provenance = "test" }
    "#;
    let scales = Scales::new(&crate::common::bus::drives(drives, 7), &layout).unwrap();
    // The vendor's page: 100 mA at 8208 of 0.0001 deg, enabled.
    let data = [0x64, 0, 0, 0, 0, 0, 0, 0, 0x10, 0x20, 0, 0, 1, 0, 0, 0];
    let mut assembler = Assembler::new(layout.clone(), scales);
    let mut log = Vec::new();
    for k in 0..10 {
        let stamp_ns = EPOCH_NS + k * 5_000_000;
        for message in layout.messages() {
            let mut frame = message.encode(&Default::default(), stamp_ns).unwrap();
            if message.format.name.starts_with("ServoFeedback") {
                assert_eq!((frame.length, message.format.is_fd), (16, true));
                frame.payload[..16].copy_from_slice(&data);
            }
            log.push(frame);
        }
    }
    let samples = feed(&mut assembler, &log);
    assert_eq!((samples.len(), assembler.losses().cycles), (9, CycleLosses::default()));
    for sample in samples {
        assert!(sample.has_reference);
        for axis in 0..7 {
            close(
                sample.motor_position_rad[axis],
                -(0.8208_f64 - 10.0).to_radians(),
                1e-12,
                "position",
            );
            close(sample.motor_torque_nm[axis], -0.25, 1e-12, "torque");
            close(sample.motor_reference_rad[axis], 10_f64.to_radians(), 1e-12, "reference");
        }
    }
}
