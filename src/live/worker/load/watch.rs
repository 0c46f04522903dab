//! The thread that identifies the load from the last seconds of motion.

use core::time::Duration;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::Instant;

use didim_identification::identification::PayloadLimits;

use super::track::{LoadTrack, Survey};
use crate::archive::drift::{Baseline, BaselineWatch};
use crate::archive::store::{FoundLoad, Timestamp, mass_text};
use crate::live::worker::configuration::Identifier;
use crate::live::worker::load_status::{LoadState, LoadStatus};
use crate::live::worker::log_rate::LogRate;
use crate::live::worker::setup::{WhenBusy, WorkerError};
use crate::live::worker::state::SharedEstimation;
use crate::window::Window;

/// Maximum time until a change of the baseline is noticed.
const BASELINE_POLL_INTERVAL: Duration = Duration::from_millis(500);
/// Interval at which a thread that waits for this one checks whether it has ended.
const POLL_INTERVAL: Duration = Duration::from_millis(2);
/// Message while there is no baseline.
const NO_BASELINE: &str = "there is no baseline; `didim baseline set` sets one, with the arm empty";

/// Message after a panic.
const PANICKED: &str = "the load survey panicked; the log has its message, report it";

/// A few seconds of motion, and the identifier that finds their payload.
struct SurveyPiece {
    window: Window,
    identifier: Identifier,
}

/// The sending side of the thread's queue. While one piece is processed, one more may wait.
#[derive(Debug)]
pub(in crate::live::worker) struct LoadWatch {
    parts: SyncSender<SurveyPiece>,
    thread: JoinHandle<()>,
    shared: SharedEstimation,
}

impl LoadWatch {
    /// Starts the thread with the baseline of the folder.
    pub(in crate::live::worker) fn start(
        folder: &Path,
        shared: &SharedEstimation,
    ) -> Result<Self, WorkerError> {
        let (parts, waiting) = sync_channel(1);
        shared.update().load = Some(LoadStatus::default());
        let mut watcher = SurveyThread::new(folder, shared.clone());
        let thread = std::thread::Builder::new()
            .name("load".into())
            .spawn(move || watcher.run(&waiting))
            .map_err(WorkerError::Thread)?;
        Ok(Self { parts, thread, shared: shared.clone() })
    }

    /// Submits a piece of motion for a load survey. On a live bus, the piece is skipped and counted
    /// while the thread is busy.
    pub(in crate::live::worker) fn submit(
        &self,
        mut window: Window,
        identifier: Identifier,
        when_busy: WhenBusy,
        stop: &AtomicBool,
    ) -> Result<(), WorkerError> {
        window.note.clone_from(&self.shared.update().note);
        let mut piece = SurveyPiece { window, identifier };
        loop {
            piece = match self.parts.try_send(piece) {
                Ok(()) => return Ok(()),
                // The thread panicked. Its message is in the log.
                Err(TrySendError::Disconnected(_)) => return Err(WorkerError::IdentificationEnded),
                Err(TrySendError::Full(piece)) => piece,
            };
            if when_busy == WhenBusy::Reject {
                if let Some(load) = &mut self.shared.update().load {
                    load.looks_left_out += 1;
                }
                return Ok(());
            }
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            self.shared.count_iteration();
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Waits until the pending piece is processed, or `stop` is set. At a stop, the thread is not
    /// waited for, because it has nothing to close.
    pub(in crate::live::worker) fn finish(self, stop: &AtomicBool) {
        drop(self.parts);
        while !self.thread.is_finished() && !stop.load(Ordering::Relaxed) {
            self.shared.count_iteration();
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

struct SurveyThread {
    baseline_watch: BaselineWatch,
    baseline: Option<Baseline>,
    load_track: LoadTrack,
    shared: SharedEstimation,
    /// Rate limit of log messages. It is needed because a pick-and-place arm changes its load in
    /// each cycle.
    change_log_rate: LogRate,
}

impl SurveyThread {
    fn new(folder: &Path, shared: SharedEstimation) -> Self {
        let watch = BaselineWatch::new(folder);
        Self {
            baseline_watch: watch,
            baseline: None,
            load_track: LoadTrack::from(Survey::BASELINE_STATE),
            shared,
            change_log_rate: LogRate::default(),
        }
    }

    fn run(&mut self, parts: &Receiver<SurveyPiece>) {
        self.look_for_baseline();
        loop {
            match parts.recv_timeout(BASELINE_POLL_INTERVAL) {
                Ok(SurveyPiece { window, identifier }) => {
                    self.look_for_baseline();
                    self.survey(&window, &identifier);
                }
                Err(RecvTimeoutError::Timeout) => self.look_for_baseline(),
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    /// Surveys one piece. A panic fails this survey, and not the service: windows do not need it.
    fn survey(&mut self, window: &Window, identifier: &Identifier) {
        let Some(baseline) = &self.baseline else { return };
        match catch_unwind(AssertUnwindSafe(|| identifier.load(baseline, window))) {
            Ok(None) => {}
            Ok(Some(found)) => self.take_survey(found.map_err(|why| why.to_string())),
            Err(_) => self.take_survey(Err(PANICKED.to_owned())),
        }
    }

    /// Resets the survey if the baseline was replaced.
    fn look_for_baseline(&mut self) {
        let (baseline, why_not) = match self.baseline_watch.poll() {
            None => return,
            Some(Ok(Some(baseline))) => {
                (Some(baseline), "the arm has not moved long enough yet".to_owned())
            }
            Some(Ok(None)) => (None, NO_BASELINE.to_owned()),
            Some(Err(error)) => {
                // The file may become readable without being replaced.
                self.baseline_watch.report_again();
                (None, error.to_string())
            }
        };
        self.baseline = baseline;
        self.load_track = LoadTrack::from(Survey::BASELINE_STATE);
        report(&self.shared, |status| {
            *status = LoadStatus {
                why_not: Some(why_not),
                changes: status.changes,
                looks_left_out: status.looks_left_out,
                ..LoadStatus::default()
            };
        });
    }

    fn take_survey(&mut self, found: Result<FoundLoad, String>) {
        let load = match found {
            Ok(found) => found,
            Err(why) => return report(&self.shared, |status| status.why_not = Some(why)),
        };
        let before = self.load_track.handle_look(Survey::from_load(&load));
        let (level, suspects) =
            (self.load_track.current_load(), self.load_track.needs_confirmation());
        let log = &mut self.change_log_rate;
        report(&self.shared, |status| {
            status.why_not = None;
            status.last_look = Some(load);
            let first = status.state == LoadState::Unknown;
            // The absence of a load is reported only after two surveys have had the chance to agree
            // on a load.
            if before.is_none() && (!first || suspects) {
                return;
            }
            status.state = state_of(level);
            status.since = Some(Timestamp::now());
            status.mass_kg = level.mass.filter(|_| before.is_some());
            if let Some(before) = before.filter(|_| !first) {
                status.before_kg = before.mass;
                status.changes += 1;
                let [from, to] = [before, level].map(text_of);
                if let Some(unlogged) = log.should_log("load", Instant::now()) {
                    tracing::info!(
                        unlogged,
                        "the load on the flange has changed: {from} before, {to} now"
                    );
                }
            } else {
                tracing::info!("the load on the flange: {}", text_of(level));
            }
        });
    }
}

fn report(shared: &SharedEstimation, change: impl FnOnce(&mut LoadStatus)) {
    change(shared.update().load.get_or_insert_default());
}

fn state_of(survey: Survey) -> LoadState {
    match survey.mass {
        _ if survey.has_load => LoadState::Load,
        Some(mass) if mass.differs_from_none(&PayloadLimits::default()) => LoadState::Less,
        _ => LoadState::None,
    }
}

fn text_of(survey: Survey) -> String {
    match state_of(survey) {
        LoadState::Unknown | LoadState::None => "none".to_owned(),
        LoadState::Load | LoadState::Less => mass_text(survey.mass),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::archive::ResultOptions;
    use crate::live::worker::configuration::FindLoad;
    use crate::window::WindowEnd;

    const LINE: &str = r#"{
        "schema": 2, "time": "2026-11-29T12:00:00Z", "result": 0, "robot": "tx40",
        "configuration": "c0ffee", "method": "idim-ls", "applicable": true,
        "relative_error": 0.05, "parameters": []
    }"#;

    fn identifier(find_load: FindLoad) -> Identifier {
        let options = ResultOptions::default();
        Identifier::new(Box::new(|_| Err("".into())), Some(find_load), String::new(), options)
    }

    #[test]
    fn a_survey_that_panics_is_reported_and_the_next_one_is_tried() {
        let (folder, shared) = (tempfile::tempdir().unwrap(), SharedEstimation::default());
        let mut thread = SurveyThread::new(folder.path(), shared.clone());
        thread.baseline = Some(Baseline::from_result(serde_json::from_str(LINE).unwrap()));
        let window = Window {
            number: 0,
            sample_rate_hz: 500.0,
            samples: Vec::new(),
            counted_samples: 0..0,
            end: WindowEnd::Rest,
            recording_start: None,
            note: None,
        };
        thread.survey(&window, &identifier(Arc::new(|_, _| panic!("on purpose"))));
        let why_not = || shared.snapshot().load.unwrap().why_not.unwrap();
        assert_eq!(why_not(), PANICKED);
        thread.survey(&window, &identifier(Arc::new(|_, _| Err("too short".into()))));
        assert_eq!(why_not(), "too short");
    }
}
