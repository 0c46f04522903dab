//! Random faults: whatever happens on the bus, every frame and every cycle is counted once, and a
//! sample is never made of two cycles.
#![allow(clippy::cast_possible_truncation, reason = "stamps of minutes fit")]

use crate::common::bus::{EPOCH_NS, assembler, check, check_sums, cycle, feed, values, with_id};
use crate::common::{cia402, packed};
use didim_drivers::assemble::Losses;
use didim_drivers::frame::{Direction, Frame, FrameId, FrameKind};
use didim_drivers::layout::{CycleValues, Role};
use proptest::prelude::*;

#[derive(Clone, Copy, Debug)]
enum Fault {
    None,
    Drop(prop::sample::Index),
    Repeat(prop::sample::Index),
    /// A frame arrives after the next SYNC.
    Late(prop::sample::Index),
    Garble(prop::sample::Index, u8),
    Truncate(prop::sample::Index),
    Kind(prop::sample::Index, bool),
    Disable(prop::sample::Index),
    Shuffle(prop::sample::Index, prop::sample::Index),
    Silence(u64),
    ClockBack(u64),
}

fn fault() -> impl Strategy<Value = Fault> {
    let index = || any::<prop::sample::Index>();
    prop_oneof![
        20 => Just(Fault::None),
        3 => index().prop_map(Fault::Drop),
        2 => index().prop_map(Fault::Repeat),
        2 => index().prop_map(Fault::Late),
        1 => (index(), any::<u8>()).prop_map(|(at, id)| Fault::Garble(at, id)),
        1 => index().prop_map(Fault::Truncate),
        1 => (index(), any::<bool>()).prop_map(|(at, error)| Fault::Kind(at, error)),
        1 => index().prop_map(Fault::Disable),
        3 => (index(), index()).prop_map(|(a, b)| Fault::Shuffle(a, b)),
        1 => (0..3_000_u64).prop_map(Fault::Silence),
        1 => (1..3_000_u64).prop_map(Fault::ClockBack),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]
    #[test]
    fn a_bus_with_random_faults_is_accounted_for(
        faults in proptest::collection::vec(fault(), 1..120),
        jitter in proptest::collection::vec(0..800_000_u64, 120),
    ) {
        let layout = cia402();
        let mut assembler = assembler(&layout);
        let mut samples = Vec::new();
        let mut syncs = Vec::new();
        let mut start_ns = EPOCH_NS;
        let mut delayed: Option<Frame> = None;
        for (k, (fault, jitter)) in (0_u64..).zip(faults.iter().zip(&jitter)) {
            if let Fault::Silence(ms) = fault { start_ns += ms * 1_000_000; }
            if let Fault::ClockBack(ms) = fault { start_ns -= ms * 1_000_000; }
            let stamp_ns = start_ns + k * 4_000_000 + jitter;
            syncs.push((stamp_ns, k));
            let mut frames = cycle(&layout, k, stamp_ns);
            let was_carried = delayed.take().map(|late| {
                frames.insert(1, Frame { stamp_ns: stamp_ns + 1_000, ..late });
            });
            // A late frame that replaces the one of its cycle looks like it: it is not
            // distinguished.
            let fault = if was_carried.is_some() { &Fault::None } else { fault };
            match *fault {
                Fault::None | Fault::Silence(_) | Fault::ClockBack(_) => {}
                Fault::Drop(at) => { frames.remove(at.index(13)); }
                Fault::Repeat(at) => frames.insert(at.index(13), frames[at.index(13)]),
                Fault::Late(at) => delayed = Some(frames.remove(1 + at.index(6))),
                Fault::Garble(at, id) => frames[at.index(13)].id = FrameId::Extended(id.into()),
                Fault::Truncate(at) => frames[1 + at.index(12)].length = 3,
                Fault::Kind(at, true) => frames[at.index(13)].kind = FrameKind::Error,
                Fault::Kind(at, false) => frames[at.index(13)].kind = FrameKind::Remote,
                Fault::Disable(at) => frames[1 + at.index(6)].payload[0] = 0x21,
                Fault::Shuffle(a, b) => {
                    let (a, b) = (1 + a.index(12), 1 + b.index(12));
                    let stamps = (frames[a].stamp_ns, frames[b].stamp_ns);
                    frames.swap(a, b);
                    (frames[a].stamp_ns, frames[b].stamp_ns) = stamps;
                }
            }
            samples.extend(feed(&mut assembler, &frames));
        }
        assembler.handle_timeout(u64::MAX);
        samples.extend(assembler.poll_sample());
        check_sums(&assembler);
        for sample in &samples {
            // A clock that goes back can show one instant twice.
            let cycles = syncs.iter().filter(|(stamp_ns, _)| *stamp_ns == sample.stamp_ns);
            let k: Vec<u64> = cycles.map(|(_, k)| *k).collect();
            prop_assert!(!k.is_empty());
            if let [k] = k[..] {
                check(sample, k, 6);
            }
        }
        prop_assert!(samples.windows(2).all(|pair| pair[0].sequence < pair[1].sequence));
    }

    /// Packed frames dropped, doubled, swapped, a device that starts again, a pause.
    #[test]
    fn packed_frames_with_random_faults_are_accounted_for(
        faults in proptest::collection::vec((0..12_u8, 0..3_000_u64), 1..300),
        start in any::<u32>(),
    ) {
        let layout = packed();
        let mut assembler = assembler(&layout);
        let (mut frames, mut pause_ns, mut reset) = (Vec::new(), 0, 0);
        let (mut stamps, mut resets) = (Vec::new(), Vec::new());
        for (k, (fault, size)) in (0_u64..).zip(&faults) {
            if *fault == 3 { pause_ns += size * 1_000_000; }
            // Back by more than the second that counter and time may disagree by.
            if *fault == 4 {
                reset += 6_000 + size;
                resets.push(k);
            }
            let stamp_ns = EPOCH_NS + pause_ns + k * 200_000;
            stamps.push(stamp_ns);
            let values = values(k, 0);
            let counter = (u64::from(start) + k).wrapping_sub(reset);
            layout
                .encode(Role::Sample, &CycleValues { counter, ..values }, stamp_ns, &mut frames)
                .unwrap();
            match fault {
                0 => { frames.pop(); }
                1 => frames.extend_from_within(frames.len() - 1..),
                2 if frames.len() > 1 => {
                    let last = frames.len() - 1;
                    frames.swap(last, last - 1);
                }
                _ => {}
            }
        }
        let samples = feed(&mut assembler, &frames);
        // Which cycle a sample is of says its stamp; its content has to be of that cycle.
        let cycles: Vec<u64> = samples.iter().map(|sample| {
            let k = stamps.binary_search(&sample.stamp_ns).unwrap() as u64;
            check(sample, k, 6);
            k
        }).collect();
        // How far the time may be ahead of the counter: by the pauses since the train began.
        let mut ahead_ns = 0;
        for (pair, k) in samples.windows(2).zip(cycles.windows(2)) {
            let step = pair[1].sequence - pair[0].sequence;
            let pause_ns = pair[1].stamp_ns.saturating_sub(pair[0].stamp_ns);
            ahead_ns += pause_ns;
            let begun_again = k[1] < k[0]
                || resets.iter().any(|reset| (k[0] + 1..=k[1]).contains(reset));
            // A pause of less than a second has lost nothing, several in a row may be too much.
            let counted = k[1].checked_sub(k[0]) == Some(step);
            if pause_ns >= 1_000_000_000 {
                // Where the counter does not go on, as many as the stamps tell, late ones among
                // them.
                let (least, most) = (pause_ns / 200_000, ahead_ns / 200_000);
                let by_time = least * 98 / 100..=most * 102 / 100 + 2;
                let by_counter = counted && step > 1;
                prop_assert!(by_counter || by_time.contains(&step), "{k:?} {step} {by_time:?}");
                ahead_ns = 0;
            } else if begun_again || (ahead_ns >= 900_000_000 && !counted) {
                prop_assert_eq!(step, 2, "{:?}", k);
                ahead_ns = 0;
            } else {
                prop_assert_eq!(step, k[1] - k[0], "{:?}", k);
            }
        }
        check_sums(&assembler);
    }

    /// Frames that no drive sends: nothing panics, everything is counted.
    #[test]
    fn noise_is_accounted_for(
        noise in proptest::collection::vec(
            (any::<u64>(), 0..0x210_u16, 0..=80_u8, 0..4_u8, any::<[u8; 32]>()), 0..200),
    ) {
        for layout in [cia402(), packed()] {
            let mut assembler = assembler(&layout);
            for (stamp_ns, id, length, kind, bytes) in &noise {
                let mut payload = [0; 64];
                payload[..32].copy_from_slice(bytes);
                let kind = match kind {
                    0 => FrameKind::Remote,
                    1 => FrameKind::Fd { bit_rate_switch: true, error_state_indicator: true },
                    2 => FrameKind::Error,
                    _ => FrameKind::Classic,
                };
                let length =
                    if *length > 64 { layout.messages()[0].format.length } else { *length };
                let frame = Frame {
                    stamp_ns: *stamp_ns,
                    interface: 0,
                    id: FrameId::Standard(if *id > 0x206 { 0x80 } else { *id }),
                    kind,
                    direction: Direction::Received,
                    length,
                    payload,
                };
                assembler.handle_frame(&frame);
                check_sums(&assembler);
            }
            assembler.handle_timeout(u64::MAX);
            assembler.poll_sample();
            check_sums(&assembler);
        }
    }
}

#[test]
fn losses_are_written_by_cause() {
    let mut assembler = assembler(&cia402());
    let frames = cycle(&cia402(), 0, EPOCH_NS);
    feed(&mut assembler, &[Frame { kind: FrameKind::Error, ..frames[with_id(&frames, 0x80)] }]);
    let text = toml::to_string(assembler.losses()).unwrap();
    assert!(text.contains("[frames]\nerror = 1\nremote = 0\n"), "{text}");
    assert_ne!(*assembler.losses(), Losses::default());
}
