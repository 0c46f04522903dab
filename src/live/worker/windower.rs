//! Samples to windows: a pure state machine over the uniform grid of sequence numbers.
//!
//! It knows no clock and no stamp: a replayed log gives the same windows, whatever the pace.

use std::collections::VecDeque;

use didim_core::{JointSample, Readings};

use super::open::OpenWindow;
use super::options::{PlannedTrigger, WindowPlan};
use super::window::{Loss, Rejection, WindowEvent};
use crate::live::recording::RecordedWindow;
use crate::window::{Window, WindowEnd};

/// Feed it each sample once, in order. At most one event follows from each call.
#[derive(Debug)]
pub struct Windower {
    plan: WindowPlan,
    /// The samples before the next one: what a new window takes as its margin.
    recent: VecDeque<JointSample>,
    recent_limit: usize,
    open: Option<OpenWindow>,
    /// Begin, waiting for the next sample.
    begin: bool,
    /// A command closed a window with the last sample.
    identified: bool,
    last_sequence: Option<u64>,
    /// The modes that the drives told last.
    modes: Readings,
    opened: u64,
    /// The one window of a recording, in place of whatever the plan would open.
    recorded: Option<RecordedWindow>,
}

/// A command does not fit the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CommandError {
    /// The cell's windows are opened by motion or by interval, not by command.
    #[error("the cell file does not open windows by command")]
    NotByCommand,
    /// `begin` when one is open.
    #[error("a window is open already")]
    AlreadyOpen,
    /// `end` or `identify` when none is open.
    #[error("no window is open")]
    NotOpen,
    /// `identify` when too little counts; the window stays open.
    #[error("too little of the open window counts: {counted} samples, {minimum} are needed")]
    TooShort {
        /// Samples that count.
        counted: usize,
        /// Samples that must count.
        minimum: usize,
    },
    /// `identify` when earlier windows wait; the window stays open.
    #[error("the identification is busy with earlier windows")]
    Busy,
}

impl Windower {
    /// A windower that has seen no sample yet.
    pub fn new(plan: WindowPlan) -> Self {
        let recent_limit = recent_limit(&plan);
        Self {
            recent: VecDeque::with_capacity(recent_limit + 1),
            recent_limit,
            plan,
            open: None,
            begin: false,
            identified: false,
            last_sequence: None,
            modes: Readings::default(),
            opened: 0,
            recorded: None,
        }
    }

    /// Cuts windows otherwise from now on; to be called while none is open. What was seen stays, as
    /// the margin of the next.
    pub(super) fn change_plan(&mut self, plan: WindowPlan) {
        // `begin` is a command, and the new plan may know none.
        self.begin &= plan.trigger == PlannedTrigger::Command;
        self.recent_limit = recent_limit(&plan);
        let surplus = self.recent.len().saturating_sub(self.recent_limit);
        self.recent.drain(..surplus);
        self.plan = plan;
    }

    /// For the recording of one window: that window and no other is made, whatever the trigger. The
    /// margins are the plan's.
    pub fn of_recorded(plan: WindowPlan, window: RecordedWindow) -> Self {
        Self { recorded: Some(window), ..Self::new(plan) }
    }

    /// Takes the next sample.
    pub fn handle_sample(&mut self, sample: &JointSample) -> Option<WindowEvent> {
        if let Some(window) = self.recorded.clone() {
            return self.handle_recorded(&window, sample);
        }
        let loss = self.last_sequence.and_then(|after| Loss::between(after, sample.sequence));
        let rejected = loss.and_then(|loss| self.handle_loss(loss));
        let parted = self.handle_modes(&sample.readings);
        let moving = self.is_moving(sample);
        if self.open.is_none() && self.opens(moving) {
            let before = self.recent.iter().copied().collect();
            let mut open = OpenWindow::new(self.opened, before);
            open.is_remainder = self.identified;
            self.open = Some(open);
            self.opened += 1;
        }
        self.identified = false;
        let closed = self.append(sample, moving);
        self.remember(sample);
        // A window takes more than one sample, so one that has just been opened after another is
        // not closed by the same sample.
        rejected.or(parted).or(closed)
    }

    /// A window does not span a change of a drive's mode: the open one ends before it, and what was seen
    /// cannot be the margin of what follows.
    fn handle_modes(&mut self, readings: &Readings) -> Option<WindowEvent> {
        let changed = readings.changes_mode(&self.modes);
        self.modes.update(readings);
        if !changed {
            return None;
        }
        self.recent.clear();
        Some(self.open.take()?.close(&self.plan, WindowEnd::ModeChange))
    }

    /// Takes the next sample of a recording: its window was opened and closed before, and is so again.
    fn handle_recorded(
        &mut self,
        window: &RecordedWindow,
        sample: &JointSample,
    ) -> Option<WindowEvent> {
        let before = self.last_sequence.replace(sample.sequence);
        if sample.sequence == window.first_sequence && self.opened == 0 {
            self.opened = 1;
            self.open = Some(OpenWindow::new(window.number, Vec::new()));
        } else if self.open.is_some()
            && let Some(loss) = before.and_then(|after| Loss::between(after, sample.sequence))
        {
            return self.handle_loss(loss);
        }
        let open = self.open.as_mut()?;
        open.samples.push(*sample);
        if open.samples.len() < window.samples {
            return None;
        }
        let mut event = self.open.take()?.close(&self.plan, window.end);
        if let WindowEvent::Closed(closed) = &mut event {
            closed.start = window.start;
        }
        Some(event)
    }

    /// Something was lost before the next sample: an open window is worth nothing, and what was
    /// seen before cannot be the margin of what follows.
    pub fn handle_loss(&mut self, loss: Loss) -> Option<WindowEvent> {
        self.recent.clear();
        self.last_sequence = None;
        let open = self.open.take()?;
        Some(open.reject(Rejection::Loss(loss)))
    }

    /// Opens a window at the next sample.
    ///
    /// # Errors
    /// [`CommandError`] when windows are not opened by command, or one is open.
    pub fn handle_begin(&mut self) -> Result<(), CommandError> {
        if self.plan.trigger != PlannedTrigger::Command {
            return Err(CommandError::NotByCommand);
        }
        if self.open.is_some() || self.begin {
            return Err(CommandError::AlreadyOpen);
        }
        self.begin = true;
        Ok(())
    }

    /// Closes the window once it has its margin.
    ///
    /// # Errors
    /// [`CommandError`] when windows are not opened by command, or none is open.
    pub fn handle_end(&mut self) -> Result<(), CommandError> {
        if self.plan.trigger != PlannedTrigger::Command {
            return Err(CommandError::NotByCommand);
        }
        if core::mem::take(&mut self.begin) {
            return Ok(());
        }
        match &mut self.open {
            Some(open) if open.close_at.is_none() => {
                open.close_at = Some(open.samples.len() + self.plan.margin_after);
                Ok(())
            }
            _ => Err(CommandError::NotOpen),
        }
    }

    /// No sample comes any more: a window that was to be closed has its margin within it.
    pub fn handle_silence(&mut self) -> Option<WindowEvent> {
        let open = self.open.take_if(|open| open.close_at.is_some())?;
        Some(open.close(&self.plan, WindowEnd::Command))
    }

    /// Closes the open window here, its last samples being its margin.
    ///
    /// # Errors
    /// [`CommandError`] when none is open, or too little of it counts: then it stays open.
    pub fn handle_identify(&mut self) -> Result<WindowEvent, CommandError> {
        let open = self.open.take().ok_or(CommandError::NotOpen)?;
        let counted = open.counted(&self.plan).len();
        if counted < self.plan.min {
            self.open = Some(open);
            return Err(CommandError::TooShort { counted, minimum: self.plan.min });
        }
        self.identified = true;
        Ok(open.close(&self.plan, WindowEnd::Command))
    }

    /// The stream has ended: what is open is closed.
    pub fn finish(&mut self) -> Option<WindowEvent> {
        let open = self.open.take()?;
        if let Some(window) = &self.recorded {
            let (counted, minimum) = (open.samples.len(), window.samples);
            return Some(open.reject(Rejection::TooShort { counted, minimum }));
        }
        Some(open.close(&self.plan, WindowEnd::EndOfStream))
    }

    /// The service is stopped: what is open is given up.
    pub fn stop(&mut self) -> Option<WindowEvent> {
        let open = self.open.take()?;
        Some(open.reject(Rejection::Stopped))
    }

    /// The last seconds of the open window, once a load can be looked for in them.
    pub(super) fn next_look(&mut self) -> Option<Window> {
        self.open.as_mut()?.next_look(&self.plan)
    }

    /// Samples of the open window.
    pub fn open_samples(&self) -> Option<usize> {
        self.open.as_ref().map(|open| open.samples.len())
    }

    /// Windows opened since the stream began.
    pub fn opened(&self) -> u64 {
        self.opened
    }

    /// Whether any motor moved further than the threshold allows over one lag: |q(k) − q(k − lag)|
    /// \> v·lag·T.
    fn is_moving(&self, sample: &JointSample) -> bool {
        let PlannedTrigger::Motion { travel_rad, lag, .. } = self.plan.trigger else {
            return false;
        };
        let Some(before) = self.recent.len().checked_sub(lag).and_then(|at| self.recent.get(at))
        else {
            return false;
        };
        let travels = sample.motor_position_rad.iter().zip(&before.motor_position_rad);
        travels.map(|(now, then)| (now - then).abs()).any(|travel| travel > travel_rad)
    }

    fn opens(&mut self, moving: bool) -> bool {
        match self.plan.trigger {
            PlannedTrigger::Motion { .. } => moving,
            PlannedTrigger::Interval { .. } => true,
            PlannedTrigger::Command => core::mem::take(&mut self.begin),
        }
    }

    fn append(&mut self, sample: &JointSample, moving: bool) -> Option<WindowEvent> {
        let mut open = self.open.take()?;
        open.samples.push(*sample);
        open.quiet = if moving { 0 } else { open.quiet + 1 };
        let length = open.samples.len();
        let ended = match self.plan.trigger {
            PlannedTrigger::Motion { idle, .. } if open.quiet >= idle => Some(WindowEnd::Rest),
            PlannedTrigger::Interval { length: counted }
                if length >= self.plan.margin_before + counted + self.plan.margin_after =>
            {
                Some(WindowEnd::Interval)
            }
            PlannedTrigger::Command if open.close_at.is_some_and(|at| length >= at) => {
                Some(WindowEnd::Command)
            }
            _ if length >= self.plan.max => Some(WindowEnd::Length),
            _ => None,
        };
        let Some(end) = ended else {
            self.open = Some(open);
            return None;
        };
        if end == WindowEnd::Rest {
            // Of the rest only the margin is wanted.
            open.samples.truncate(length - open.quiet + self.plan.margin_after);
        }
        Some(open.close(&self.plan, end))
    }

    fn remember(&mut self, sample: &JointSample) {
        self.last_sequence = Some(sample.sequence);
        self.recent.push_back(*sample);
        if self.recent.len() > self.recent_limit {
            self.recent.pop_front();
        }
    }
}

/// Samples that a new window may take from before it.
fn recent_limit(plan: &WindowPlan) -> usize {
    // A motion is noticed up to one lag after it began.
    let lag = match plan.trigger {
        PlannedTrigger::Motion { lag, .. } => lag,
        PlannedTrigger::Interval { .. } | PlannedTrigger::Command => 0,
    };
    plan.margin_before + lag
}

#[cfg(test)]
mod tests;
