//! The window that is being filled.

use core::ops::Range;

use didim_dynamics::JointSample;

use super::window::{RejectedWindow, Rejection, WindowEvent};
use crate::live::limits::LiveLimits;
use crate::live::window_options::WindowPlan;
use crate::window::{Window, WindowEnd};

/// Returns the number of samples of a load survey.
pub(super) fn look_samples(sample_rate_hz: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 20 kHz, as planned windows have"
    )]
    let samples = (LiveLimits::DEFAULT.load_survey_s * sample_rate_hz).round() as usize;
    samples.max(1)
}

#[derive(Debug)]
pub(super) struct OpenWindow {
    number: u64,
    pub(super) samples: Vec<JointSample>,
    /// Number of samples at rest since the last sample in motion.
    pub(super) rest_samples: usize,
    /// Number of samples at which a command closes the window.
    pub(super) close_at: Option<usize>,
    /// True if a command closed the previous window in the middle of this motion.
    pub(super) is_remainder: bool,
    /// Number of counted samples that load surveys have used.
    surveyed_samples: usize,
}

impl OpenWindow {
    /// Opens a window with the samples of the margin before it.
    pub(super) fn new(number: u64, samples: Vec<JointSample>) -> Self {
        let is_remainder = false;
        Self { number, samples, rest_samples: 0, close_at: None, is_remainder, surveyed_samples: 0 }
    }

    /// Returns the range of samples that would count if the window were closed now.
    pub(super) fn counted(&self, plan: &WindowPlan) -> Range<usize> {
        let before = plan.margin_before;
        let end = self.samples.len().saturating_sub(plan.margin_after);
        before..end.max(before)
    }

    /// Returns the samples since the last load survey, if they are sufficient for the next one.
    pub(super) fn next_look(&mut self, plan: &WindowPlan) -> Option<Window> {
        let (length, first) = (look_samples(plan.sample_rate_hz), self.surveyed_samples);
        let end = first + plan.margin_before + length + plan.margin_after;
        let samples = self.samples.get(first..end)?.to_vec();
        self.surveyed_samples += length;
        Some(Window {
            number: self.number,
            sample_rate_hz: plan.sample_rate_hz,
            samples,
            counted_samples: plan.margin_before..plan.margin_before + length,
            end: WindowEnd::Length,
            recording_start: None,
            note: None,
        })
    }

    pub(super) fn close(self, plan: &WindowPlan, end: WindowEnd) -> WindowEvent {
        let counted = self.counted(plan);
        if counted.len() < plan.min {
            let (is_remainder, counted, minimum) = (self.is_remainder, counted.len(), plan.min);
            return self.reject(match is_remainder {
                true => Rejection::Remainder { counted, minimum },
                false => Rejection::TooShort { counted, minimum },
            });
        }
        WindowEvent::Closed(Window {
            number: self.number,
            sample_rate_hz: plan.sample_rate_hz,
            samples: self.samples,
            counted_samples: counted,
            end,
            recording_start: None,
            note: None,
        })
    }

    pub(super) fn reject(self, rejection: Rejection) -> WindowEvent {
        WindowEvent::Rejected(RejectedWindow {
            number: self.number,
            first_sequence: self.samples.first().map_or(0, |sample| sample.sequence),
            last_sequence: self.samples.last().map_or(0, |sample| sample.sequence),
            rejection,
        })
    }
}
