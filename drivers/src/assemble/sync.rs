//! Cycles between SYNCs.

use super::State;
use super::cycle::Cycle;
use super::grid::Grid;
use super::losses::{CycleCause, FrameCause};
use super::values::{References, index_bit, prior_cause, read_values};
use crate::frame::Frame;
use crate::layout::MessagePlan;

impl State {
    /// Takes a SYNC: it ends the previous cycle and begins the next one.
    pub(super) fn sync_frame(&mut self, stamp_ns: u64) {
        self.period_watch.handle_stamp(stamp_ns);
        let Some(grid) = &mut self.grid else {
            self.start(stamp_ns);
            return self.begin_cycle(stamp_ns, 0);
        };
        if grid.is_silence(stamp_ns) {
            self.end_cycle(false);
            let cycles = self.cycles_of_silence(stamp_ns);
            self.start_again(stamp_ns, CycleCause::Silence, cycles);
            return self.begin_cycle(stamp_ns, 0);
        }
        if self.by_frames {
            *grid = Grid::start(self.limits, self.period_ns, stamp_ns);
            self.end_cycle(true);
            self.lose_all_but_last(CycleCause::MissingSync, 1);
            return self.begin_cycle(stamp_ns, 1);
        }
        let periods = grid.periods_to(stamp_ns);
        let cycles = periods.round();
        if cycles < 1.0 && periods.abs() > self.limits.repeated_sync {
            self.end_cycle(false);
            self.start_again(stamp_ns, CycleCause::ClockStep, 2);
            return self.begin_cycle(stamp_ns, 0);
        }
        if cycles < 1.0 {
            // This is the same SYNC again. If the two stamps differ more, it may also be the next
            // SYNC of a clock that was set back by about a period. Then the next frames may belong
            // to the next cycle and would complete this one, and earlier targets may be one cycle
            // older than later ones. So the cycle is lost.
            let echo_ns = rounded_ns(self.limits.echoed_sync * self.period_ns);
            let distance_ns = |cycle: &&mut Cycle| cycle.stamp_ns.abs_diff(stamp_ns) > echo_ns;
            if let Some(cycle) = self.open_cycle.as_mut().filter(distance_ns) {
                cycle.fault = prior_cause(cycle.fault, CycleCause::Contradiction);
                self.pending_references.drop_older(u64::MAX);
            }
            return self.losses.frames.count(FrameCause::Duplicate, 1);
        }
        #[allow(clippy::cast_possible_truncation, reason = "positive, and shorter than a silence")]
        let cycles = cycles as u64;
        grid.advance(stamp_ns, cycles);
        self.end_cycle(cycles == 1);
        if cycles > 1 {
            // A message that was missing before the gap is not expected after the gap.
            self.missing_before = 0;
        }
        self.lose_all_but_last(CycleCause::MissingSync, cycles);
        self.begin_cycle(stamp_ns, cycles);
    }

    /// Begins the cycle of a SYNC that is `cycles` cycles after the previous one. `cycles` is 0 if
    /// the grid has just started.
    fn begin_cycle(&mut self, stamp_ns: u64, cycles: u64) {
        let mut references = References::default();
        if self.next_sync {
            references = std::mem::take(&mut self.pending_references);
            if cycles != 1 {
                // The drives may have received a SYNC that was not recorded. They then no longer
                // use older targets.
                references.drop_older(stamp_ns.saturating_sub(rounded_ns(self.period_ns)));
            }
        }
        self.open_cycle = Some(Cycle {
            stamp_ns,
            sequence: self.sequence,
            references,
            frames: 1,
            missing_before: self.missing_before,
            previous_arrivals: self.latest_arrivals,
            ..Cycle::default()
        });
    }

    /// Takes a frame that a sample requires.
    pub(super) fn sample_frame(&mut self, index: usize, message: &MessagePlan, frame: &Frame) {
        let refusal = self.refusal_at(frame.stamp_ns);
        let (None, Some(cycle)) = (refusal, &mut self.open_cycle) else {
            return self.losses.frames.count(refusal.unwrap_or(FrameCause::Late), 1);
        };
        let mut values = cycle.values;
        let fault = read_values(message, frame.data(), &mut values, self.enabled_value);
        if cycle.messages & index_bit(index) == 0 {
            cycle.messages |= index_bit(index);
            cycle.frames += 1;
        } else if cycle.missing_before & index_bit(index) != 0 {
            // The earlier frame belonged to the previous cycle; this one belongs to this cycle.
            cycle.missing_before &= !index_bit(index);
            self.losses.frames.count(FrameCause::Late, 1);
        } else {
            if values != cycle.values {
                cycle.fault = prior_cause(cycle.fault, CycleCause::Contradiction);
            }
            return self.losses.frames.count(FrameCause::Duplicate, 1);
        }
        cycle.values = values;
        message.read_readings(frame, &mut self.readings);
        if let Some(fault) = fault {
            cycle.fault = prior_cause(cycle.fault, fault);
        }
        let references =
            if self.next_sync { &mut self.pending_references } else { &mut cycle.references };
        references.read_references(index, message, frame.data(), frame.stamp_ns);
    }

    /// Takes a frame that carries only references.
    pub(super) fn target_frame(&mut self, index: usize, message: &MessagePlan, frame: &Frame) {
        let refusal = if !self.next_sync {
            self.refusal_at(frame.stamp_ns)
        } else if self.open_cycle.is_some_and(|cycle| frame.stamp_ns < cycle.stamp_ns) {
            Some(FrameCause::Late)
        } else {
            None
        };
        let references = match (refusal, &mut self.open_cycle) {
            (None, _) if self.next_sync => &mut self.pending_references,
            (None, Some(cycle)) => &mut cycle.references,
            _ => return self.losses.frames.count(refusal.unwrap_or(FrameCause::Late), 1),
        };
        message.read_readings(frame, &mut self.readings);
        if references.read_references(index, message, frame.data(), frame.stamp_ns) {
            self.losses.frames.count(FrameCause::Duplicate, 1);
        } else {
            references.frames += 1;
        }
    }

    /// Returns the reason why the open cycle refuses a frame with this stamp, or `None` if the
    /// cycle accepts the frame. Before that, ends the open cycle if its time is over.
    pub(super) fn refusal_at(&mut self, stamp_ns: u64) -> Option<FrameCause> {
        let Some(grid) = self.grid else { return Some(FrameCause::BeforeFirstSync) };
        self.end_by_time(stamp_ns);
        let periods = grid.periods_to(stamp_ns);
        let by_sync = self.reach_ns.is_none();
        match &mut self.open_cycle {
            Some(_) if self.by_frames => None,
            Some(cycle) if periods < 1.0 && stamp_ns >= cycle.stamp_ns => {
                // A signal that is valid at its own arrival can be used in either cycle.
                cycle.is_doubtful |= by_sync && periods >= self.limits.doubtful_share;
                None
            }
            _ => Some(FrameCause::Late),
        }
    }

    /// Ends the open cycle if its time is over, one period after its grid point. If the last frames
    /// may belong to the next cycle, the cycle ends later, when the next SYNC counts as missing.
    pub(super) fn end_by_time(&mut self, now_ns: u64) {
        let (Some(grid), Some(cycle)) = (&self.grid, &self.open_cycle) else { return };
        let end = if cycle.is_doubtful { self.limits.missing_sync } else { 1.0 };
        let past = grid.periods_to(now_ns) >= end;
        // If the frames count the cycles, an incomplete cycle still waits for its frames. Only a
        // silence ends it here.
        let is_complete = self.complete_mask.missing_messages(cycle) == 0;
        let over =
            if self.by_frames { grid.is_silence(now_ns) || (is_complete && past) } else { past };
        if over {
            self.end_cycle(false);
        }
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a period: 1e4 to 1e9")]
fn rounded_ns(period_ns: f64) -> u64 {
    period_ns.round() as u64
}
