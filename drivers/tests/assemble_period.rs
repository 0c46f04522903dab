//! A layout that states another period than the bus has: no samples, under a cause of its own.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "stamps of minutes fit"
)]

use crate::common::bus::{EPOCH_NS, assembler, check_sums, cycle, values};
use crate::common::{CIA402, PACKED, cia402_dbc, compile, packed_dbc};
use didim_drivers::assemble::{CycleLosses, Losses};
use didim_drivers::layout::{CompiledLayout, CycleValues, Role};

/// Thirty seconds of a bus whose period is `ratio` × that of the layout, each cycle
/// `late_ns(cycle)` late, by the losses after ten seconds and at the end.
fn run(layout: &CompiledLayout, ratio: f64, late_ns: impl Fn(u64) -> u64) -> [Losses; 2] {
    let mut assembler = assembler(layout);
    let cycles = (30e9 / layout.period_ns()) as u64;
    let mut early = Losses::default();
    let mut frames = Vec::new();
    for k in 0..cycles {
        let stamp_ns = EPOCH_NS + (k as f64 * ratio * layout.period_ns()) as u64 + late_ns(k);
        frames.clear();
        for role in [Role::Sync, Role::Sample] {
            let values = CycleValues { counter: k, ..values(k, 0) };
            layout.encode(role, &values, stamp_ns, &mut frames).unwrap();
        }
        for frame in &frames {
            assembler.handle_frame(frame);
            assembler.poll_sample();
        }
        if k == cycles / 3 {
            early = *assembler.losses();
        }
    }
    check_sums(&assembler);
    [early, *assembler.losses()]
}

fn layouts() -> [(&'static str, CompiledLayout); 3] {
    let fewer = |spec: &str| spec.replace("axes = 6", "axes = 1");
    let uncounted = PACKED.replace("counter = \"Sample.Counter\"\n", "");
    [
        ("sync", compile(cia402_dbc(), &fewer(CIA402))),
        ("counter", compile(packed_dbc(), &fewer(PACKED))),
        ("packed", compile(packed_dbc(), &fewer(&uncounted))),
    ]
}

#[test]
fn a_wrong_nominal_period_gives_no_samples() {
    for (name, layout) in layouts() {
        for ratio in [0.8, 0.95, 0.98, 1.02, 1.05, 1.25] {
            let [early, end] = run(&layout, ratio, |_| 0);
            assert!(end.cycles.wrong_period > 0, "{name} {ratio}: {:?}", end.cycles);
            assert_eq!(early.samples, end.samples, "{name} {ratio}: {:?}", end.cycles);
        }
    }
}

#[test]
fn the_counter_shows_a_period_of_twice_or_half_the_nominal_one() {
    let layout = compile(packed_dbc(), PACKED);
    for ratio in [0.5, 2.0] {
        let [early, end] = run(&layout, ratio, |_| 0);
        assert!(end.cycles.wrong_period > 0, "{ratio}: {:?}", end.cycles);
        assert_eq!(early.samples, end.samples, "{ratio}");
    }
}

#[test]
fn half_a_percent_and_late_frames_are_no_wrong_period() {
    for (name, layout) in layouts() {
        for ratio in [0.995, 1.0, 1.005] {
            let [_, end] = run(&layout, ratio, |_| 0);
            assert_eq!(end.cycles, CycleLosses::default(), "{name} {ratio}");
            // Once in 1.7 s everything stands still for 200 ms, and comes at once.
            let period_ns = layout.period_ns() as u64;
            let (every, still) = (1_700_000_000 / period_ns, 200_000_000 / period_ns);
            let [_, end] = run(&layout, ratio, |k| still.saturating_sub(k % every) * period_ns);
            assert_eq!(end.cycles.wrong_period, 0, "{name} {ratio}: {:?}", end.cycles);
            assert!(end.samples > 0, "{name} {ratio}");
        }
    }
}

/// The controller is set right while the assembler listens.
#[test]
fn samples_come_again_when_the_period_is_right() {
    for (name, layout) in layouts() {
        let mut assembler = assembler(&layout);
        let mut stamp_ns = EPOCH_NS;
        let mut samples = [0; 2];
        for (ratio, samples) in [1.05, 1.0].iter().zip(&mut samples) {
            let cycles = (8e9 / layout.period_ns()) as u64;
            for k in 0..cycles {
                stamp_ns += (ratio * layout.period_ns()) as u64;
                for frame in cycle(&layout, k, stamp_ns) {
                    assembler.handle_frame(&frame);
                    *samples += u64::from(assembler.poll_sample().is_some());
                }
            }
            assert!(*samples < cycles - cycles / 8, "{name} {samples}");
            assert!(*samples > cycles / 3, "{name} {samples}");
        }
        assert!(samples[1] > samples[0], "{name} {samples:?}");
        check_sums(&assembler);
    }
}
