//! Six drives and a controller that put known numbers on the bus.
#![allow(clippy::cast_possible_truncation, reason = "periods fit")]

use didim_drivers::assemble::Assembler;
use didim_drivers::frame::{Frame, FrameId};
use didim_drivers::layout::{CompiledLayout, CycleValues, Role, SampledBy};
use didim_drivers::units::Scales;
use didim_dynamics::JointSample;

/// Somewhere in 2026, as live stamps are.
pub(crate) const EPOCH_NS: u64 = 1_790_000_000_000_000_000;

/// 8,192 counts per revolution and 2 N·m of rated torque, for every axis.
pub(crate) const DRIVES: &str = "
[[drives]]
position = { scale = { counts_per_revolution = 8192 }, sign = 1, zero = 0, wraps = \"refuse\", \
    provenance = \"test\" }
torque = { scale = { per_mille_of_rated_torque = { rated_torque_nm = 2.0 } }, sign = 1, \
    provenance = \"test\" }
";

/// The same torque for the packed frame, whose DBC file has counts.
pub(crate) fn packed_drives() -> String {
    DRIVES.replace(
        "{ per_mille_of_rated_torque = { rated_torque_nm = 2.0 } }",
        "{ nm_per_count = 2e-3 }",
    )
}

pub(crate) const RAD_PER_COUNT: f64 = std::f64::consts::TAU / 8192.0;

#[derive(serde::Deserialize)]
struct Drives {
    drives: Vec<didim_drivers::units::DriveSpec>,
}

/// Gains from the text of one drive or of all.
pub(crate) fn drives(text: &str, axes: usize) -> Vec<didim_drivers::units::DriveSpec> {
    let mut drives = toml::from_str::<Drives>(text).unwrap().drives;
    while drives.len() < axes {
        drives.push(drives[0].clone());
    }
    drives
}

pub(crate) fn assembler(layout: &CompiledLayout) -> Assembler {
    let text = match layout.sampled_by() {
        SampledBy::Sync => DRIVES.to_owned(),
        SampledBy::Packed => packed_drives(),
    };
    let scales = Scales::new(&drives(&text, layout.axes()), layout).unwrap();
    Assembler::new(layout.clone(), scales)
}

/// Counts that axis `axis` reports in cycle `k`.
pub(crate) fn position(k: u64, axis: usize) -> i32 {
    i32::try_from(1_000 * axis as u64 + k % 500_000).unwrap()
}

/// Per mille that it reports.
pub(crate) fn torque(k: u64, axis: usize) -> i16 {
    i16::try_from((k + 7 * axis as u64) % 1_000).unwrap() - 500
}

/// What is on the bus in cycle `k`; the target is that of cycle `k + lead`.
pub(crate) fn values(k: u64, lead: u64) -> CycleValues {
    let mut values = CycleValues { counter: k, ..CycleValues::default() };
    for (axis, entry) in values.axes.iter_mut().enumerate() {
        entry.position = position(k, axis).into();
        entry.torque = torque(k, axis).into();
        entry.reference = f64::from(position(k + lead, axis)) + 5.0;
        entry.status_word = 0x1237;
    }
    values
}

/// The frames of cycle `k`, whose SYNC is at `stamp_ns`: SYNC, drives, controller, spread over half
/// of the period.
pub(crate) fn cycle(layout: &CompiledLayout, k: u64, stamp_ns: u64) -> Vec<Frame> {
    let mut frames = Vec::new();
    let lead = u64::from(layout.reference_at_next_sync());
    for role in [Role::Sync, Role::Sample, Role::Target] {
        layout.encode(role, &values(k, lead), stamp_ns, &mut frames).unwrap();
    }
    let spacing = layout.period_ns() as u64 / 2 / frames.len() as u64;
    for (n, frame) in (0u64..).zip(&mut frames) {
        frame.stamp_ns += n * spacing;
    }
    frames
}

/// Whether a sample is that of cycle `k`, and of no other, in every signal.
pub(crate) fn check(sample: &JointSample, k: u64, axes: usize) {
    for axis in 0..axes {
        let counts = f64::from(position(k, axis));
        assert!((sample.motor_position_rad[axis] - counts * RAD_PER_COUNT).abs() < 1e-9, "{k}");
        let torque = f64::from(torque(k, axis)) * 2e-3;
        assert!((sample.motor_torque_nm[axis] - torque).abs() < 1e-12, "{k}");
        if sample.has_reference {
            let reference = (counts + 5.0) * RAD_PER_COUNT;
            assert!((sample.motor_reference_rad[axis] - reference).abs() < 1e-9, "{k}");
        }
    }
}

/// Hands frames in, checks the sums, and returns the samples.
pub(crate) fn feed(assembler: &mut Assembler, frames: &[Frame]) -> Vec<JointSample> {
    let mut samples = Vec::new();
    for frame in frames {
        assembler.handle_frame(frame);
        samples.extend(assembler.poll_sample());
    }
    check_sums(assembler);
    samples
}

/// Every frame and every cycle is somewhere.
pub(crate) fn check_sums(assembler: &Assembler) {
    let losses = assembler.losses();
    assert_eq!(
        losses.frames_received,
        losses.frames_used + losses.frames.total() + assembler.frames_waiting(),
        "{losses:?}"
    );
    assert_eq!(
        losses.cycles_begun,
        losses.samples + losses.cycles.total() + assembler.cycles_waiting(),
        "{losses:?}"
    );
}

pub(crate) fn with_id(frames: &[Frame], id: u16) -> usize {
    frames.iter().position(|frame| frame.id == FrameId::Standard(id)).unwrap()
}
