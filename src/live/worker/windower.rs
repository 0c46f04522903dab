//! Conversion of samples into windows. It is a pure state machine over the uniform grid of sequence
//! numbers.
//!
//! It uses neither a clock nor the stamps. A replayed log therefore gives the same windows at any
//! pace.

use std::collections::VecDeque;

use didim_dynamics::{JointSample, Readings};

use super::open::OpenWindow;
use super::window::{Loss, Rejection, WindowEvent};
use crate::live::recording::RecordedWindow;
use crate::live::window_options::{PlannedTrigger, WindowPlan};
use crate::window::{Window, WindowEnd};

/// State machine that takes each sample once, in order. Each call returns at most one event.
#[derive(Debug)]
pub struct Windower {
    plan: WindowPlan,
    /// Previous samples, which become the margin of a new window.
    recent_samples: VecDeque<JointSample>,
    recent_limit: usize,
    open_window: Option<OpenWindow>,
    /// True if a `begin` command waits for the next sample.
    begins_at_next_sample: bool,
    /// True if a command closed a window at the last sample.
    closed_by_command: bool,
    last_sequence: Option<u64>,
    /// Latest modes reported by the drives.
    drive_modes: Readings,
    windows_opened: u64,
    /// The only window of a recording. It replaces the windows of the plan.
    recorded: Option<RecordedWindow>,
}

/// Error of a command that does not match the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CommandError {
    /// The windows of this cell are opened by motion or by interval, not by command.
    #[error("the cell file does not open windows by command")]
    NotByCommand,
    /// The command was `begin`, but a window is open.
    #[error("a window is open already")]
    AlreadyOpen,
    /// The command was `end` or `identify`, but no window is open.
    #[error("no window is open")]
    NotOpen,
    /// The command was `identify`, but the window has too few counted samples. The window stays
    /// open.
    #[error("too little of the open window counts: {counted} samples, {minimum} are needed")]
    TooShort {
        /// Number of counted samples.
        counted: usize,
        /// Required number of counted samples.
        minimum: usize,
    },
    /// The command was `identify`, but earlier windows are queued. The window stays open.
    #[error("the identification is busy with earlier windows")]
    Busy,
}

impl Windower {
    /// Creates a windower that has received no sample yet.
    pub fn new(plan: WindowPlan) -> Self {
        let recent_limit = recent_limit(&plan);
        Self {
            recent_samples: VecDeque::with_capacity(recent_limit + 1),
            recent_limit,
            plan,
            open_window: None,
            begins_at_next_sample: false,
            closed_by_command: false,
            last_sequence: None,
            drive_modes: Readings::default(),
            windows_opened: 0,
            recorded: None,
        }
    }

    /// Changes the window plan. Must be called only while no window is open. The previous samples
    /// remain available as the margin of the next window.
    pub(super) fn change_plan(&mut self, plan: WindowPlan) {
        // A waiting `begin` is dropped if the new plan has no windows by command.
        self.begins_at_next_sample &= plan.trigger == PlannedTrigger::Command;
        self.recent_limit = recent_limit(&plan);
        let surplus = self.recent_samples.len().saturating_sub(self.recent_limit);
        self.recent_samples.drain(..surplus);
        self.plan = plan;
    }

    /// Creates a windower for the recording of one window. It makes only that window, independent
    /// of the trigger. The margins are those of the plan.
    pub fn of_recorded(plan: WindowPlan, window: RecordedWindow) -> Self {
        Self { recorded: Some(window), ..Self::new(plan) }
    }

    /// Processes the next sample.
    pub fn handle_sample(&mut self, sample: &JointSample) -> Option<WindowEvent> {
        if let Some(window) = self.recorded.clone() {
            return self.handle_recorded(&window, sample);
        }
        let loss =
            self.last_sequence.and_then(|after| Loss::from_sequences(after, sample.sequence));
        let rejected = loss.and_then(|loss| self.handle_loss(loss));
        let parted = self.handle_modes(&sample.readings);
        let moving = self.is_moving(sample);
        if self.open_window.is_none() && self.should_open(moving) {
            let before = self.recent_samples.iter().copied().collect();
            let mut window_open = OpenWindow::new(self.windows_opened, before);
            window_open.is_remainder = self.closed_by_command;
            self.open_window = Some(window_open);
            self.windows_opened += 1;
        }
        self.closed_by_command = false;
        let closed = self.append(sample, moving);
        self.keep_recent(sample);
        // A window needs more than one sample, so a window that this sample opens is not closed by
        // the same sample. At most one event occurs.
        rejected.or(parted).or(closed)
    }

    /// Closes the open window if a drive changes its mode, because a window must not contain such a
    /// change. Samples before the change cannot become the margin of the next window.
    fn handle_modes(&mut self, readings: &Readings) -> Option<WindowEvent> {
        let changed = readings.changes_mode(&self.drive_modes);
        self.drive_modes.update(readings);
        if !changed {
            return None;
        }
        self.recent_samples.clear();
        Some(self.open_window.take()?.close(&self.plan, WindowEnd::ModeChange))
    }

    /// Processes the next sample of a recording. The recorded window is opened and closed at the
    /// same samples as in the original run.
    fn handle_recorded(
        &mut self,
        window: &RecordedWindow,
        sample: &JointSample,
    ) -> Option<WindowEvent> {
        let before = self.last_sequence.replace(sample.sequence);
        if sample.sequence == window.first_sequence && self.windows_opened == 0 {
            self.windows_opened = 1;
            self.open_window = Some(OpenWindow::new(window.number, Vec::new()));
        } else if self.open_window.is_some()
            && let Some(loss) =
                before.and_then(|after| Loss::from_sequences(after, sample.sequence))
        {
            return self.handle_loss(loss);
        }
        let window_open = self.open_window.as_mut()?;
        window_open.samples.push(*sample);
        if window_open.samples.len() < window.samples {
            return None;
        }
        let mut event = self.open_window.take()?.close(&self.plan, window.end);
        if let WindowEvent::Closed(closed) = &mut event {
            closed.recording_start = window.start;
        }
        Some(event)
    }

    /// Handles a loss before the next sample. An open window is rejected, and earlier samples
    /// cannot become the margin of the next window.
    pub fn handle_loss(&mut self, loss: Loss) -> Option<WindowEvent> {
        self.recent_samples.clear();
        self.last_sequence = None;
        let window_open = self.open_window.take()?;
        Some(window_open.reject(Rejection::Loss(loss)))
    }

    /// Requests that the next sample opens a window.
    ///
    /// # Errors
    /// [`CommandError`] if windows are not opened by command, or if a window is open.
    pub fn handle_begin(&mut self) -> Result<(), CommandError> {
        if self.plan.trigger != PlannedTrigger::Command {
            return Err(CommandError::NotByCommand);
        }
        if self.open_window.is_some() || self.begins_at_next_sample {
            return Err(CommandError::AlreadyOpen);
        }
        self.begins_at_next_sample = true;
        Ok(())
    }

    /// Requests that the open window is closed once it has its margin.
    ///
    /// # Errors
    /// [`CommandError`] if windows are not opened by command, or if no window is open.
    pub fn handle_end(&mut self) -> Result<(), CommandError> {
        if self.plan.trigger != PlannedTrigger::Command {
            return Err(CommandError::NotByCommand);
        }
        if core::mem::take(&mut self.begins_at_next_sample) {
            return Ok(());
        }
        match &mut self.open_window {
            Some(open) if open.close_at.is_none() => {
                open.close_at = Some(open.samples.len() + self.plan.margin_after);
                Ok(())
            }
            _ => Err(CommandError::NotOpen),
        }
    }

    /// Handles a silence of the bus. If a command has requested the end of the window, closes it
    /// with its last samples as the margin.
    pub fn handle_silence(&mut self) -> Option<WindowEvent> {
        let window_open = self.open_window.take_if(|open| open.close_at.is_some())?;
        Some(window_open.close(&self.plan, WindowEnd::Command))
    }

    /// Closes the open window at the last sample. Its last samples become its margin.
    ///
    /// # Errors
    /// [`CommandError`] if no window is open, or if it has too few counted samples and stays open.
    pub fn handle_identify(&mut self) -> Result<WindowEvent, CommandError> {
        let window_open = self.open_window.take().ok_or(CommandError::NotOpen)?;
        let counted = window_open.counted(&self.plan).len();
        if counted < self.plan.min {
            self.open_window = Some(window_open);
            return Err(CommandError::TooShort { counted, minimum: self.plan.min });
        }
        self.closed_by_command = true;
        Ok(window_open.close(&self.plan, WindowEnd::Command))
    }

    /// Closes the open window at the end of the stream.
    pub fn finish(&mut self) -> Option<WindowEvent> {
        let window_open = self.open_window.take()?;
        if let Some(window) = &self.recorded {
            let (counted, minimum) = (window_open.samples.len(), window.samples);
            return Some(window_open.reject(Rejection::TooShort { counted, minimum }));
        }
        Some(window_open.close(&self.plan, WindowEnd::EndOfStream))
    }

    /// Rejects the open window when the service is stopped.
    pub fn stop(&mut self) -> Option<WindowEvent> {
        let window_open = self.open_window.take()?;
        Some(window_open.reject(Rejection::Stopped))
    }

    /// Returns the last seconds of the open window if they are sufficient for a load survey.
    pub(super) fn next_look(&mut self) -> Option<Window> {
        self.open_window.as_mut()?.next_look(&self.plan)
    }

    /// Returns the number of samples of the open window.
    pub fn open_samples(&self) -> Option<usize> {
        self.open_window.as_ref().map(|open| open.samples.len())
    }

    /// Returns the number of windows opened since the start of the stream.
    pub fn opened_count(&self) -> u64 {
        self.windows_opened
    }

    /// Returns true if any motor moved further than the threshold over one lag: |q(k) − q(k − lag)|
    /// \> v·lag·T.
    fn is_moving(&self, sample: &JointSample) -> bool {
        let PlannedTrigger::Motion { travel_rad, lag, .. } = self.plan.trigger else {
            return false;
        };
        let Some(before) =
            self.recent_samples.len().checked_sub(lag).and_then(|at| self.recent_samples.get(at))
        else {
            return false;
        };
        let travels = sample.motor_position_rad.iter().zip(&before.motor_position_rad);
        travels.map(|(now, then)| (now - then).abs()).any(|travel| travel > travel_rad)
    }

    fn should_open(&mut self, moving: bool) -> bool {
        match self.plan.trigger {
            PlannedTrigger::Motion { .. } => moving,
            PlannedTrigger::Interval { .. } => true,
            PlannedTrigger::Command => core::mem::take(&mut self.begins_at_next_sample),
        }
    }

    fn append(&mut self, sample: &JointSample, moving: bool) -> Option<WindowEvent> {
        let mut window_open = self.open_window.take()?;
        window_open.samples.push(*sample);
        window_open.rest_samples = if moving { 0 } else { window_open.rest_samples + 1 };
        let length = window_open.samples.len();
        let ended = match self.plan.trigger {
            PlannedTrigger::Motion { idle, .. } if window_open.rest_samples >= idle => {
                Some(WindowEnd::Rest)
            }
            PlannedTrigger::Interval { length: counted }
                if length >= self.plan.margin_before + counted + self.plan.margin_after =>
            {
                Some(WindowEnd::Interval)
            }
            PlannedTrigger::Command if window_open.close_at.is_some_and(|at| length >= at) => {
                Some(WindowEnd::Command)
            }
            _ if length >= self.plan.max => Some(WindowEnd::Length),
            _ => None,
        };
        let Some(end) = ended else {
            self.open_window = Some(window_open);
            return None;
        };
        if end == WindowEnd::Rest {
            // Only the margin of the samples at rest is kept.
            window_open
                .samples
                .truncate(length - window_open.rest_samples + self.plan.margin_after);
        }
        Some(window_open.close(&self.plan, end))
    }

    fn keep_recent(&mut self, sample: &JointSample) {
        self.last_sequence = Some(sample.sequence);
        self.recent_samples.push_back(*sample);
        if self.recent_samples.len() > self.recent_limit {
            self.recent_samples.pop_front();
        }
    }
}

/// Returns the number of previous samples that a new window may take.
fn recent_limit(plan: &WindowPlan) -> usize {
    // A motion is detected up to one lag after its beginning.
    let lag = match plan.trigger {
        PlannedTrigger::Motion { lag, .. } => lag,
        PlannedTrigger::Interval { .. } | PlannedTrigger::Command => 0,
    };
    plan.margin_before + lag
}

#[cfg(test)]
mod tests;
