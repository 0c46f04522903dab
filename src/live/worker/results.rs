//! Stored data of each result: its file, its history line, its configuration.

use std::collections::VecDeque;
use std::path::Path;

use super::setup::{ResultOptions, WorkerOptions};
use super::state::EstimationStatus;
use crate::archive::drift::{
    AlarmEvent, Baseline, BaselineWatch, DriftOptions, DriftStatus, Tracker,
};
use crate::archive::store::{
    Attachments, HistoryLine, ModelDifference, RECENT_LINES, ResultRecord, Store, StoreError,
    Stored, Timestamp,
};

/// The results folder as seen by the identifying thread.
#[derive(Debug)]
pub(super) struct Results {
    store: Store,
    /// Drift options of the last window.
    drift: DriftOptions,
    /// Last lines of the history. A baseline may be set to one of them.
    recent_lines: VecDeque<HistoryLine>,
    baseline: BaselineWatch,
    /// Reason why the existing baseline cannot be read.
    baseline_error: Option<String>,
    tracker: Option<Tracker>,
}

impl Results {
    pub(super) fn open(folder: &Path, options: &WorkerOptions) -> Result<Self, StoreError> {
        let (store, recent) = Store::open_with_history(folder, options.max_results)?;
        let drift = options.results.drift;
        let baseline = BaselineWatch::new(folder);
        Ok(Self {
            store,
            drift,
            recent_lines: recent,
            baseline,
            baseline_error: None,
            tracker: None,
        })
    }

    /// Checks if another process has set or cleared the baseline, and compares the lines in memory
    /// with the new one. Returns true if so. An unreadable baseline is tried again at each check,
    /// because the same file may become readable. It is logged once.
    pub(super) fn poll_baseline(&mut self) -> bool {
        if self.baseline_error.is_some() {
            self.baseline.report_again();
        }
        let baseline = match self.baseline.poll() {
            None => return false,
            Some(Ok(baseline)) => {
                self.baseline_error = None;
                baseline
            }
            Some(Err(error)) => {
                let why = error.to_string();
                if self.baseline_error.as_ref() == Some(&why) {
                    return false;
                }
                tracing::warn!("nothing is compared: {why}");
                self.baseline_error = Some(why);
                None
            }
        };
        let had = self.tracker.is_some();
        self.tracker = baseline.map(|baseline| {
            let mut tracker = Tracker::new(baseline, self.drift);
            self.recent_lines.iter().for_each(|line| drop(tracker.handle_line(line)));
            tracker
        });
        match &self.tracker {
            Some(tracker) => {
                let baseline = &tracker.baseline().result;
                tracing::info!("the baseline is result {} of {}", baseline.result, baseline.time);
                for (parameter, _) in tracker.alarms() {
                    log_alarm(tracker, parameter);
                }
            }
            None if had && self.baseline_error.is_none() => {
                tracing::info!("the baseline is cleared");
            }
            None => {}
        }
        true
    }

    /// Returns the baseline, if there is one.
    pub(super) fn baseline(&self) -> Option<&Baseline> {
        Some(self.tracker.as_ref()?.baseline())
    }

    /// Writes the missing history lines. If this is refused, the status reports the reason, and it
    /// is tried again.
    pub(super) fn settle(&mut self) {
        let _ = self.store.settle();
    }

    /// Writes to the status: the drift, obstacles to its judgement, and missing history lines.
    pub(super) fn report(&self, status: &mut EstimationStatus) {
        status.drift = self.drift();
        status.baseline_unreadable.clone_from(&self.baseline_error);
        self.report_pending(status);
    }

    /// Writes the missing history lines to the status.
    pub(super) fn report_pending(&self, status: &mut EstimationStatus) {
        let (lines, why) = self.store.pending_count();
        status.history_lines_waiting = lines as u64;
        status.history_waits_for = why.map(str::to_owned);
    }

    /// Returns the drift for the status. `None` without a baseline.
    fn drift(&self) -> Option<DriftStatus> {
        self.tracker.as_ref().map(Tracker::status)
    }

    fn follow_line(&mut self, line: HistoryLine, drift: DriftOptions) {
        if drift != self.drift {
            // The same baseline with other drift options from here on, for the lines in memory.
            self.drift = drift;
            self.baseline.report_again();
        }
        // Before the line is added: a baseline that is set after it has to find it in memory.
        self.poll_baseline();
        if let Some(tracker) = &mut self.tracker {
            for (parameter, event) in tracker.handle_line(&line) {
                match event {
                    AlarmEvent::Raised => log_alarm(tracker, &parameter),
                    AlarmEvent::Cleared => {
                        tracing::info!("drift: {parameter} is back in its band");
                    }
                }
            }
        }
        self.recent_lines.push_back(line);
        if self.recent_lines.len() > RECENT_LINES {
            self.recent_lines.pop_front();
        }
    }

    /// Returns the possible difference from the baseline due to model errors.
    fn model_difference(&self, record: &ResultRecord) -> Option<ModelDifference> {
        let baseline = self.tracker.as_ref()?.baseline();
        baseline.compare_uncertainty(record.estimate.model_uncertainty.as_ref()?)
    }

    /// Stores a result. Only this step may fail. Failures to store its related data are logged,
    /// because the result itself is stored.
    pub(super) fn store_result(
        &mut self,
        record: &ResultRecord,
        auxiliary: &Attachments,
        options: &ResultOptions,
    ) -> Result<Stored, StoreError> {
        // Written before the result that refers to it.
        let configured = self.store.keep_configuration(&record.configuration, &options.texts);
        let attachments =
            Attachments { against: self.model_difference(record), ..auxiliary.clone() };
        let stored = self.store.write(record, &attachments, Timestamp::now())?;
        if !stored.line.time.is_set() {
            tracing::warn!(
                "the clock is not set: result {} is left out of plots and trends",
                stored.number
            );
        }
        if let Err(problem) = configured {
            tracing::warn!("{} is stored, but: {problem}", stored.path.display());
        }
        self.follow_line(stored.line.clone(), options.drift);
        Ok(stored)
    }
}

fn log_alarm(tracker: &Tracker, parameter: &str) {
    tracing::warn!(
        "drift: {}",
        tracker.sentence(parameter).unwrap_or_else(|| parameter.to_owned())
    );
}

#[cfg(test)]
mod tests;
