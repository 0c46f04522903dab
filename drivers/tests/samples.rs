//! From a source to samples: everything that was read is assembled, in whatever order it is asked
//! for.
#![allow(clippy::cast_possible_truncation, reason = "stamps of minutes fit")]

use core::time::Duration;

use crate::common::bus::{EPOCH_NS, assembler, check, cycle};
use crate::common::cia402;
use didim_drivers::frame::Frame;
use didim_drivers::layout::CompiledLayout;
use didim_drivers::samples::{Assembled, Samples};
use didim_drivers::source::{InterfaceName, Received, WhenFull, in_process_bus};

const CYCLES: u64 = 20;

fn frames(layout: &CompiledLayout) -> Vec<Frame> {
    let period_ns = layout.period_ns() as u64;
    (0..CYCLES).flat_map(|k| cycle(layout, k, EPOCH_NS + k * period_ns)).collect()
}

/// A bus that has ended, with the frames still in it, read `at_a_time`.
fn samples(layout: &CompiledLayout, at_a_time: usize) -> Samples<'static> {
    let frames = frames(layout);
    let interface = InterfaceName::new("can0").unwrap();
    let (sender, source) = in_process_bus(&[interface], frames.len(), WhenFull::Wait);
    frames.iter().for_each(|frame| sender.send(*frame).unwrap());
    Samples::new(Box::new(source), assembler(layout), at_a_time)
}

#[test]
fn all_samples_come_in_order_the_last_cycle_included_and_then_none() {
    let layout = cia402();
    for at_a_time in [0, 1, 7, 4096] {
        let mut samples = samples(&layout, at_a_time);
        let decoded: Vec<_> = samples.by_ref().map(Result::unwrap).collect();
        assert_eq!(decoded.len() as u64, CYCLES, "{at_a_time}");
        for (sample, k) in decoded.iter().zip(0..) {
            check(sample, k, layout.axes());
        }
        assert!(samples.next().is_none());
        assert_eq!(samples.losses().samples, CYCLES);
        assert_eq!(samples.losses().frames_received, samples.counters().frames);
    }
}

#[test]
fn a_tap_gets_every_frame_before_the_samples_that_are_made_of_it() {
    let layout = cia402();
    let expected = frames(&layout);
    let mut tapped = Vec::new();
    let samples = samples(&layout, 7);
    let tap = |frames: &[Frame], _| tapped.extend_from_slice(frames);
    let count = samples.with_tap(Some(Box::new(tap))).count();
    assert_eq!((count as u64, tapped), (CYCLES, expected));
}

#[test]
fn frames_that_are_not_assembled_yet_are_not_read_over() {
    let layout = cia402();
    let mut samples = samples(&layout, 4096);
    let mut count = 0;
    // One sample a turn, though all frames came with the first.
    while samples.read(Duration::ZERO).unwrap() == Received::Frames {
        count += u64::from(samples.poll().is_some());
    }
    // That of the last cycle, which no frame completed.
    let Assembled { sample, completed_ns } = samples.poll().unwrap();
    check(&sample, CYCLES - 1, layout.axes());
    assert_eq!((count, completed_ns), (CYCLES - 1, None));
    assert!(samples.poll().is_none());
}
