//! Results that are not on disk yet: each waits for its turn, and none for ever.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::setup::ResultOptions;
use super::state::{EstimateSummary, SharedEstimation};
use super::window::{RejectedWindow, Rejection};
use crate::archive::store::{Beside, ResultRecord};
use crate::live::recording::RecordedWindow;

/// Results that wait for a disk which refuses them; some 200 kB each, mostly their report.
const MOST: usize = 32;
/// How often they are tried again.
const RETRY_EVERY: Duration = Duration::from_secs(2);

/// A result with all that is to be stored and told of it.
#[derive(Clone, Debug)]
pub(super) struct Finished {
    pub(super) record: ResultRecord,
    pub(super) beside: Beside,
    pub(super) options: ResultOptions,
    pub(super) recorded: RecordedWindow,
    pub(super) summary: EstimateSummary,
    /// What is counted when it is not stored at all.
    pub(super) rejected: RejectedWindow,
}

impl Finished {
    /// It is lost: that is counted, and what was noted with its window goes to the next one.
    pub(super) fn give_up(self, shared: &SharedEstimation, why: &str) {
        let number = self.rejected.number;
        let rejection = Rejection::NotStored { why: why.to_owned() };
        shared.reject(RejectedWindow { rejection, ..self.rejected });
        shared.return_note(self.beside.note);
        shared.settle(number);
    }
}

/// The results that wait, oldest first.
#[derive(Debug, Default)]
pub(super) struct Unstored {
    waiting: VecDeque<Finished>,
    tried: Option<Instant>,
}

impl Unstored {
    /// Adds one; gives the oldest when there are too many.
    pub(super) fn add(&mut self, finished: Finished) -> Option<Finished> {
        self.waiting.push_back(finished);
        if self.waiting.len() > MOST { self.waiting.pop_front() } else { None }
    }

    /// Whether it is time to try again.
    pub(super) fn is_due(&self, now: Instant) -> bool {
        let waited = |tried| now.saturating_duration_since(tried) >= RETRY_EVERY;
        !self.waiting.is_empty() && self.tried.is_none_or(waited)
    }

    /// The oldest, to be tried now.
    pub(super) fn first(&mut self, now: Instant) -> Option<&Finished> {
        self.tried = Some(now);
        self.waiting.front()
    }

    /// The oldest is stored, or given up.
    pub(super) fn take_first(&mut self) -> Option<Finished> {
        self.waiting.pop_front()
    }

    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }
}

#[cfg(test)]
mod tests {
    use didim_core::identification::Estimate;

    use super::*;
    use crate::window::{Note, Window, WindowEnd};

    fn window(number: u64, note: Option<Note>) -> Window {
        Window {
            number,
            sample_rate_hz: 500.0,
            samples: vec![didim_core::JointSample::zero(0, 0)],
            counted: 0..1,
            end: WindowEnd::Rest,
            start: None,
            note,
        }
    }

    fn finished(window: &Window) -> Finished {
        let estimate = Estimate::default();
        Finished {
            summary: EstimateSummary::new(window, &estimate, None),
            record: ResultRecord::new("cell", "c0ffee", window, estimate),
            rejected: RejectedWindow::new(window, Rejection::Stopped),
            recorded: RecordedWindow::of(window, "c0ffee"),
            beside: Beside { note: window.note.clone(), ..Beside::default() },
            options: ResultOptions::default(),
        }
    }

    #[test]
    fn a_disk_that_refuses_for_a_day_is_asked_every_two_seconds_and_the_oldest_go() {
        let (mut unstored, start) = (Unstored::default(), Instant::now());
        let (mut attempts, mut lost) = (0, Vec::new());
        assert!(!unstored.is_due(start), "nothing waits");
        // Looked at twice a second, a result a minute.
        for half in 0..2 * 86_400_u32 {
            let now = start + half * Duration::from_millis(500);
            if half % 120 == 0 {
                let dropped = unstored.add(finished(&window(u64::from(half / 120), None)));
                lost.extend(dropped.map(|finished| finished.rejected.number));
            }
            if unstored.is_due(now) {
                attempts += 1;
                assert!(unstored.first(now).is_some() && !unstored.is_due(now));
            }
        }
        assert_eq!(attempts, 86_400 / 2);
        let minutes = 86_400 / 60;
        assert!(lost.into_iter().eq(0..minutes - MOST as u64));
        assert_eq!(unstored.len(), MOST);
        assert_eq!(unstored.take_first().unwrap().rejected.number, minutes - MOST as u64);
    }

    #[test]
    fn the_note_of_a_lost_result_goes_to_the_next_window() {
        let note = Note { text: Some("cold".into()), ..Note::default() };
        let window = window(7, Some(note.clone()));
        let finished = finished(&window);
        let shared = SharedEstimation::default();
        shared.pend(&window);
        assert!(shared.claim(7));
        shared.put_aside(7);
        assert!(!shared.is_settled());
        finished.give_up(&shared, "no room");
        assert!(shared.is_settled());
        let status = shared.snapshot();
        assert_eq!(status.note, Some(note));
        assert_eq!(status.windows_rejected["not-stored"], 1);
    }
}
