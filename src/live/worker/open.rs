//! The window that is being filled.

use core::ops::Range;

use didim_core::JointSample;

use super::options::WindowPlan;
use super::window::{RejectedWindow, Rejection, WindowEvent};
use crate::window::{Window, WindowEnd};

#[derive(Debug)]
pub(super) struct OpenWindow {
    number: u64,
    pub(super) samples: Vec<JointSample>,
    /// Samples at rest since the last one in motion.
    pub(super) quiet: usize,
    /// Length at which a command closes it.
    pub(super) close_at: Option<usize>,
}

impl OpenWindow {
    /// With the samples of its margin before.
    pub(super) fn new(number: u64, samples: Vec<JointSample>) -> Self {
        Self { number, samples, quiet: 0, close_at: None }
    }

    /// What would count of it if it were closed here.
    pub(super) fn counted(&self, plan: &WindowPlan) -> Range<usize> {
        let before = plan.margin_before;
        let end = self.samples.len().saturating_sub(plan.margin_after);
        before..end.max(before)
    }

    pub(super) fn close(self, plan: &WindowPlan, end: WindowEnd) -> WindowEvent {
        let counted = self.counted(plan);
        if counted.len() < plan.min {
            let rejection = Rejection::TooShort { counted: counted.len(), minimum: plan.min };
            return self.reject(rejection);
        }
        WindowEvent::Closed(Window {
            number: self.number,
            sample_rate_hz: plan.sample_rate_hz,
            samples: self.samples,
            counted,
            end,
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
