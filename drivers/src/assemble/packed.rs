//! Cycles that consist of one packed frame each.

use super::State;
use super::counter::{Step, step};
use super::cycle::Cycle;
use super::losses::{CycleCause, FrameCause};
use super::values::{References, Values, index_bit, read_values};
use crate::frame::Frame;
use crate::layout::{Extraction, MessagePlan, Quantity};

/// Position of a packed frame in the train.
enum FramePlace {
    First,
    After {
        cycles: u64,
        lost: CycleCause,
    },
    /// A new train of cycles begins. A silence cost `silent` cycles; `cycles` and `lost` have the
    /// same meaning as in `After`.
    Broken {
        silent: u64,
        cycles: u64,
        lost: CycleCause,
    },
    NotUsed(FrameCause),
}

impl State {
    /// Takes a packed frame, which is a complete cycle.
    pub(super) fn packed_frame(&mut self, index: usize, message: &MessagePlan, frame: &Frame) {
        let mut values = Values::default();
        let fault = read_values(message, frame.data(), &mut values, self.enabled_value);
        let mut follows = false;
        let counted = counter_of(message).is_some();
        if !counted {
            self.period_watch.handle_stamp(frame.stamp_ns);
        }
        match self.place_frame(message, &values, frame.stamp_ns) {
            FramePlace::First => self.start(frame.stamp_ns),
            FramePlace::Broken { silent, cycles, lost } => {
                if counted {
                    self.period_watch.start(frame.stamp_ns);
                }
                self.lose_cycles(CycleCause::Silence, silent);
                self.start_again(frame.stamp_ns, lost, cycles);
            }
            FramePlace::NotUsed(cause) => return self.losses.frames.count(cause, 1),
            FramePlace::After { cycles, lost } => {
                follows = cycles == 1;
                if counted {
                    self.period_watch.count(frame.stamp_ns, cycles);
                }
                if let Some(grid) = &mut self.grid {
                    grid.advance(frame.stamp_ns, cycles);
                }
                self.lose_all_but_last(lost, cycles);
            }
        }
        self.counter = values.counter;
        let mut references = References::default();
        references.read_references(index, message, frame.data(), frame.stamp_ns);
        if self.next_sync {
            let before = std::mem::replace(&mut self.pending_references, references);
            references = if follows { before } else { References::default() };
        }
        message.read_readings(frame, &mut self.readings);
        self.open_cycle = Some(Cycle {
            stamp_ns: frame.stamp_ns,
            sequence: self.sequence,
            values,
            references,
            messages: index_bit(index),
            frames: 1,
            fault,
            ..Cycle::default()
        });
        self.end_cycle(true);
    }

    /// Returns the position of a frame by its counter, or by its stamp if it has no counter.
    fn place_frame(&self, message: &MessagePlan, values: &Values, stamp_ns: u64) -> FramePlace {
        let Some(grid) = &self.grid else { return FramePlace::First };
        let silence = grid.is_silence(stamp_ns).then(|| self.cycles_of_silence(stamp_ns));
        let periods = grid.periods_to(stamp_ns);
        let Some(counter) = counter_of(message) else {
            if let Some(cycles) = silence {
                return FramePlace::Broken { silent: 0, cycles, lost: CycleCause::Silence };
            }
            #[allow(clippy::cast_possible_truncation, reason = "shorter than a silence")]
            return match periods.round() as i64 {
                _ if self.by_frames => {
                    FramePlace::After { cycles: 1, lost: CycleCause::MissingSync }
                }
                ..0 => FramePlace::Broken { silent: 0, cycles: 2, lost: CycleCause::ClockStep },
                0 => FramePlace::NotUsed(FrameCause::Duplicate),
                cycles => {
                    let cause = CycleCause::MissingSync;
                    FramePlace::After { cycles: cycles.unsigned_abs(), lost: cause }
                }
            };
        };
        let width = counter.signal.field.width();
        let backwards = grid.is_before(stamp_ns);
        let time = (periods, self.period_ns);
        let step = step(self.counter, values.counter, width, time, backwards, &self.limits);
        if let Some(cycles) = silence {
            return match step {
                // A narrow counter may have wrapped during the silence, so only a wide one is used.
                Step::Forward(counted) if width >= self.limits.wide_counter_bits && counted > 1 => {
                    FramePlace::Broken { silent: 0, cycles: counted, lost: CycleCause::CounterGap }
                }
                _ => {
                    FramePlace::Broken { silent: cycles - 2, cycles: 2, lost: CycleCause::Restart }
                }
            };
        }
        let broken = |lost| FramePlace::Broken { silent: 0, cycles: 2, lost };
        match step {
            Step::Forward(cycles) => FramePlace::After { cycles, lost: CycleCause::CounterGap },
            Step::Repeated => FramePlace::NotUsed(FrameCause::CounterRepeated),
            Step::Older => FramePlace::NotUsed(FrameCause::Late),
            Step::Restart if backwards => broken(CycleCause::ClockStep),
            Step::Restart => broken(CycleCause::Restart),
        }
    }
}

fn counter_of(message: &MessagePlan) -> Option<&Extraction> {
    message.extractions.iter().find(|extraction| extraction.quantity == Quantity::Counter)
}
