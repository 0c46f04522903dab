//! Faults of frames.

use didim_drivers::frame::{Frame, FrameError, FrameId};
use didim_drivers::layout::{CompiledLayout, Role};

use super::InjectedFault;
use super::action::{FrameFault, FrameRole};
use super::signals::uniform;

/// First identifier of the frames that do not belong to the layout.
const FIRST_FOREIGN_ID: u16 = 0x6A0;

/// Returns true if a frame has this role and axis.
fn has_role(layout: &CompiledLayout, role: FrameRole, axis: Option<usize>, frame: &Frame) -> bool {
    let Ok((_, message)) = layout.read(frame) else { return false };
    let of_role = match role {
        FrameRole::Sync => message.role == Role::Sync,
        FrameRole::Sample => message.role == Role::Sample,
        FrameRole::Target => message.role == Role::Target,
        FrameRole::All => true,
    };
    let of_axis = |axis: usize| message.extractions.iter().any(|signal| signal.axis + 1 == axis);
    of_role && axis.is_none_or(of_axis)
}

impl InjectedFault {
    pub(super) fn corrupt_frames(
        &self,
        action: &FrameFault,
        layout: &CompiledLayout,
        cycles: &mut [Vec<Frame>],
    ) -> Result<(), FrameError> {
        let count = cycles.len();
        let start_ns = cycles.iter().flatten().next().map_or(0, |frame| frame.stamp_ns);
        for k in (0..count).filter(|k| self.affects_cycle(*k)) {
            match *action {
                FrameFault::Drop { frame: role, axis } => {
                    cycles[k].retain(|frame| !has_role(layout, role, axis, frame));
                }
                FrameFault::Double { frame: role, axis } => {
                    let chosen = |frame: &Frame| has_role(layout, role, axis, frame);
                    insert_copies(&mut cycles[k], chosen, |_| ());
                }
                FrameFault::Contradict { axis } => {
                    let sample =
                        |frame: &Frame| has_role(layout, FrameRole::Sample, Some(axis), frame);
                    insert_copies(&mut cycles[k], sample, |frame| frame.payload[2] ^= 0x10);
                }
                FrameFault::Flip { frame: role, axis, bit } => {
                    for frame in cycles[k].iter_mut().filter(|of| has_role(layout, role, axis, of))
                    {
                        if let Some(byte) = frame.payload.get_mut(bit / 8) {
                            *byte ^= 1 << (bit % 8);
                        }
                    }
                }
                FrameFault::Truncate { frame: role, axis } => {
                    for frame in cycles[k].iter_mut().filter(|of| has_role(layout, role, axis, of))
                    {
                        frame.length = frame.length.saturating_sub(1);
                        frame.payload[usize::from(frame.length)] = 0;
                    }
                }
                FrameFault::Late { axis } => move_to_next_cycle(layout, cycles, k, axis),
                FrameFault::Reverse => reverse_frames(cycles, k),
                FrameFault::Exchange if k + 1 < count => exchange_neighbours(cycles, k),
                FrameFault::Exchange => {}
                FrameFault::Burst { length } => delay_to_burst(cycles, count, k, length),
                FrameFault::Error { class } => {
                    let stamp_ns = cycles[k].first().map_or(start_ns, |frame| frame.stamp_ns);
                    cycles[k].insert(0, Frame::error(class, &[0; 8])?.with_stamp(stamp_ns));
                }
                FrameFault::Remote => {
                    let sample = |frame: &&Frame| has_role(layout, FrameRole::Sample, None, frame);
                    if let Some(frame) = cycles[k].iter().find(sample).copied() {
                        cycles[k].push(Frame::remote(frame.id, 8)?.with_stamp(frame.stamp_ns));
                    }
                }
                FrameFault::Foreign { frames } => {
                    add_foreign(cycles, start_ns, k, frames)?;
                }
                FrameFault::Jitter { us, seed } => {
                    let late_ns = signed_ns(1e3 * us * uniform(seed, k));
                    move_by(&mut cycles[k], |_| late_ns);
                }
                FrameFault::Stretch { ratio } => {
                    move_by(&mut cycles[k], |frame| {
                        signed_ns((ratio - 1.0) * frame.stamp_ns.saturating_sub(start_ns) as f64)
                    });
                }
                FrameFault::ClockStep { ms } => move_by(&mut cycles[k], |_| signed_ns(1e6 * ms)),
                FrameFault::SecondArm { offset } => {
                    second_arm(layout, cycles, count, k, offset);
                }
                FrameFault::SecondSync { after_us } => {
                    second_sync(layout, cycles, k, after_us);
                }
            }
        }
        Ok(())
    }
}

fn reverse_frames(cycles: &mut [Vec<Frame>], k: usize) {
    let stamps: Vec<u64> = cycles[k].iter().map(|frame| frame.stamp_ns).collect();
    if let Some((_, others)) = cycles[k].split_first_mut() {
        others.reverse();
    }
    restamp(&mut cycles[k], &stamps);
}

fn exchange_neighbours(cycles: &mut [Vec<Frame>], k: usize) {
    let stamps =
        [k, k + 1].map(|k| cycles[k].iter().map(|frame| frame.stamp_ns).collect::<Vec<_>>());
    cycles.swap(k, k + 1);
    restamp(&mut cycles[k], &stamps[0]);
    restamp(&mut cycles[k + 1], &stamps[1]);
}

fn delay_to_burst(cycles: &mut [Vec<Frame>], count: usize, k: usize, length: usize) {
    let piece = &mut cycles[k..(k + length).min(count)];
    let last = piece.iter().flatten().last().map(|frame| frame.stamp_ns);
    for frame in piece.iter_mut().flatten() {
        frame.stamp_ns = last.unwrap_or(frame.stamp_ns);
    }
}

fn add_foreign(
    cycles: &mut [Vec<Frame>],
    start_ns: u64,
    k: usize,
    frames: u16,
) -> Result<(), FrameError> {
    let stamp_ns = cycles[k].last().map_or(start_ns, |frame| frame.stamp_ns);
    for number in 0..frames {
        let id = FrameId::standard(FIRST_FOREIGN_ID + number)?;
        cycles[k].push(Frame::classic(id, &[0xA5; 8])?.with_stamp(stamp_ns));
    }
    Ok(())
}

fn second_arm(
    layout: &CompiledLayout,
    cycles: &mut [Vec<Frame>],
    count: usize,
    k: usize,
    offset: usize,
) {
    let other = cycles[(k + offset) % count].clone();
    let sample = |frame: &Frame| has_role(layout, FrameRole::Sample, None, frame);
    insert_copies(&mut cycles[k], sample, |frame| {
        let replacement = other.iter().find(|own| own.id == frame.id);
        frame.payload = replacement.map_or(frame.payload, |own| own.payload);
    });
}

fn second_sync(layout: &CompiledLayout, cycles: &mut [Vec<Frame>], k: usize, after_us: f64) {
    insert_copies(
        &mut cycles[k],
        |frame| has_role(layout, FrameRole::Sync, None, frame),
        |frame| {
            frame.stamp_ns = frame.stamp_ns.saturating_add_signed(signed_ns(1e3 * after_us));
        },
    );
    cycles[k].sort_by_key(|frame| frame.stamp_ns);
}

/// Inserts a changed copy after each chosen frame.
fn insert_copies(
    frames: &mut Vec<Frame>,
    chosen: impl Fn(&Frame) -> bool,
    change: impl Fn(&mut Frame),
) {
    *frames = frames
        .drain(..)
        .flat_map(|frame: Frame| {
            let mut second = frame;
            change(&mut second);
            core::iter::once(frame).chain(chosen(&frame).then_some(second))
        })
        .collect();
}

/// Moves the sample of an axis into the next cycle, after the SYNC of that cycle.
fn move_to_next_cycle(layout: &CompiledLayout, cycles: &mut [Vec<Frame>], k: usize, axis: usize) {
    let sample = |frame: &Frame| has_role(layout, FrameRole::Sample, Some(axis), frame);
    let Some([cycle, next]) = cycles.get_mut(k..k + 2) else { return };
    let (Some(place), Some(first)) = (cycle.iter().position(sample), next.first().copied()) else {
        return;
    };
    let frame = cycle.remove(place);
    next.insert(1, frame.with_stamp(first.stamp_ns + 1_000));
}

fn restamp(frames: &mut [Frame], stamps_ns: &[u64]) {
    for (frame, stamp_ns) in frames.iter_mut().zip(stamps_ns) {
        frame.stamp_ns = *stamp_ns;
    }
}

fn move_by(frames: &mut [Frame], by_ns: impl Fn(&Frame) -> i64) {
    for frame in frames {
        frame.stamp_ns = frame.stamp_ns.saturating_add_signed(by_ns(frame));
    }
}

#[allow(clippy::cast_possible_truncation, reason = "hours are far fewer than 2^52 ns")]
fn signed_ns(ns: f64) -> i64 {
    ns.round() as i64
}
