//! Results that are not stored yet. Each is tried in its turn, and their number is limited.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::state::{EstimateSummary, SharedEstimation};
use super::window::{RejectedWindow, Rejection};
use crate::archive::ResultOptions;
use crate::archive::store::{Attachments, ResultRecord};
use crate::live::recording::RecordedWindow;

/// Maximum number of results that wait for the disk. Each takes some 200 kB.
const MAX_WAITING_RESULTS: usize = 32;
/// Interval between two attempts to store the results.
const RETRY_INTERVAL: Duration = Duration::from_secs(2);

/// A result with all data to be stored and published.
#[derive(Clone, Debug)]
pub(super) struct FinishedResult {
    pub(super) record: ResultRecord,
    pub(super) attachments: Attachments,
    pub(super) options: ResultOptions,
    pub(super) recorded: RecordedWindow,
    pub(super) summary: EstimateSummary,
    /// Rejection that is counted if the result cannot be stored at all.
    pub(super) rejected_window: RejectedWindow,
}

impl FinishedResult {
    /// Counts the result as lost, and passes the note of its window to the next one.
    pub(super) fn give_up(self, shared: &SharedEstimation, why: &str) {
        let number = self.rejected_window.number;
        let rejection = Rejection::NotStored { why: why.to_owned() };
        shared.reject(RejectedWindow { rejection, ..self.rejected_window });
        shared.return_note(self.attachments.note);
        shared.settle(number);
    }
}

/// The waiting results, oldest first.
#[derive(Debug, Default)]
pub(super) struct UnstoredResults {
    waiting: VecDeque<FinishedResult>,
    last_attempt: Option<Instant>,
}

impl UnstoredResults {
    /// Adds a result. If there are too many, removes and returns the oldest.
    pub(super) fn add(&mut self, finished: FinishedResult) -> Option<FinishedResult> {
        self.waiting.push_back(finished);
        if self.waiting.len() > MAX_WAITING_RESULTS { self.waiting.pop_front() } else { None }
    }

    /// Returns true if the next attempt is due.
    pub(super) fn is_due(&self, now: Instant) -> bool {
        let waited = |tried| now.saturating_duration_since(tried) >= RETRY_INTERVAL;
        !self.waiting.is_empty() && self.last_attempt.is_none_or(waited)
    }

    /// Returns the oldest result for an attempt now.
    pub(super) fn next_attempt(&mut self, now: Instant) -> Option<&FinishedResult> {
        self.last_attempt = Some(now);
        self.waiting.front()
    }

    /// Removes and returns the oldest result, which was stored or is abandoned.
    pub(super) fn take_first(&mut self) -> Option<FinishedResult> {
        self.waiting.pop_front()
    }

    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }
}

#[cfg(test)]
mod tests {
    use didim_identification::identification::Estimate;

    use super::*;
    use crate::window::{Note, Window, WindowEnd};

    fn window(number: u64, note: Option<Note>) -> Window {
        Window {
            number,
            sample_rate_hz: 500.0,
            samples: vec![didim_dynamics::JointSample::zero(0, 0)],
            counted_samples: 0..1,
            end: WindowEnd::Rest,
            recording_start: None,
            note,
        }
    }

    fn finished(window: &Window) -> FinishedResult {
        let estimate = Estimate::default();
        FinishedResult {
            summary: EstimateSummary::new(window, &estimate, None),
            record: ResultRecord::new("cell", "c0ffee", window, estimate),
            rejected_window: RejectedWindow::new(window, Rejection::Stopped),
            recorded: RecordedWindow::new(window, "c0ffee"),
            attachments: Attachments { note: window.note.clone(), ..Attachments::default() },
            options: ResultOptions::default(),
        }
    }

    #[test]
    fn a_disk_that_refuses_for_a_day_is_asked_every_two_seconds_and_the_oldest_go() {
        let (mut unstored, start) = (UnstoredResults::default(), Instant::now());
        let (mut attempts, mut lost) = (0, Vec::new());
        assert!(!unstored.is_due(start), "nothing waits");
        // Checked twice a second, with one result a minute.
        for half in 0..2 * 86_400_u32 {
            let now = start + half * Duration::from_millis(500);
            if half % 120 == 0 {
                let dropped = unstored.add(finished(&window(u64::from(half / 120), None)));
                lost.extend(dropped.map(|finished| finished.rejected_window.number));
            }
            if unstored.is_due(now) {
                attempts += 1;
                assert!(unstored.next_attempt(now).is_some() && !unstored.is_due(now));
            }
        }
        assert_eq!(attempts, 86_400 / 2);
        let minutes = 86_400 / 60;
        assert!(lost.into_iter().eq(0..minutes - MAX_WAITING_RESULTS as u64));
        assert_eq!(unstored.len(), MAX_WAITING_RESULTS);
        assert_eq!(
            unstored.take_first().unwrap().rejected_window.number,
            minutes - MAX_WAITING_RESULTS as u64
        );
    }

    #[test]
    fn the_note_of_a_lost_result_goes_to_the_next_window() {
        let note = Note { text: Some("cold".into()), ..Note::default() };
        let window = window(7, Some(note.clone()));
        let finished = finished(&window);
        let shared = SharedEstimation::default();
        shared.add_pending(&window);
        assert!(shared.claim_window(7));
        shared.put_aside(7);
        assert!(!shared.is_settled());
        finished.give_up(&shared, "no room");
        assert!(shared.is_settled());
        let status = shared.snapshot();
        assert_eq!(status.note, Some(note));
        assert_eq!(status.windows_rejected["not-stored"], 1);
    }
}
