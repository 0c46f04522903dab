//! What is kept of each result: its file, its line in the history, its configuration.

use std::collections::VecDeque;
use std::path::Path;

use super::setup::{ResultOptions, WorkerOptions};
use super::state::EstimationStatus;
use crate::archive::drift::{
    AlarmEvent, Baseline, BaselineWatch, DriftOptions, DriftStatus, Tracker,
};
use crate::archive::store::{
    Against, Beside, HistoryLine, RECENT_LINES, ResultRecord, Store, StoreError, Stored, Timestamp,
};

/// The folder of the results as the thread that identifies sees it.
#[derive(Debug)]
pub(super) struct Results {
    store: Store,
    /// What counts as drift: that of the last window.
    drift: DriftOptions,
    /// The last lines of the history, for a baseline that is set in their midst.
    recent: VecDeque<HistoryLine>,
    baseline: BaselineWatch,
    /// Why the baseline that there is cannot be read.
    unreadable: Option<String>,
    tracker: Option<Tracker>,
}

impl Results {
    pub(super) fn open(folder: &Path, options: &WorkerOptions) -> Result<Self, StoreError> {
        let (store, recent) = Store::open_with_history(folder, options.keep)?;
        let drift = options.results.drift;
        let baseline = BaselineWatch::new(folder);
        Ok(Self { store, drift, recent, baseline, unreadable: None, tracker: None })
    }

    /// Looks whether the baseline was set or cleared by another process, and compares with the new
    /// one what is at hand. True when it was. One that cannot be read is tried again at each look: it
    /// may be readable again without being another file. It is logged once.
    pub(super) fn look(&mut self) -> bool {
        if self.unreadable.is_some() {
            self.baseline.forget();
        }
        let baseline = match self.baseline.look() {
            None => return false,
            Some(Ok(baseline)) => {
                self.unreadable = None;
                baseline
            }
            Some(Err(error)) => {
                let why = error.to_string();
                if self.unreadable.as_ref() == Some(&why) {
                    return false;
                }
                tracing::warn!("nothing is compared: {why}");
                self.unreadable = Some(why);
                None
            }
        };
        let had = self.tracker.is_some();
        self.tracker = baseline.map(|baseline| {
            let mut tracker = Tracker::new(baseline, self.drift);
            self.recent.iter().for_each(|line| drop(tracker.handle_line(line)));
            tracker
        });
        match &self.tracker {
            Some(tracker) => {
                let baseline = &tracker.baseline().result;
                tracing::info!("the baseline is result {} of {}", baseline.result, baseline.time);
                for (parameter, _) in tracker.alarms() {
                    raised(tracker, parameter);
                }
            }
            None if had && self.unreadable.is_none() => {
                tracing::info!("the baseline is cleared");
            }
            None => {}
        }
        true
    }

    /// The baseline, if there is one.
    pub(super) fn baseline(&self) -> Option<&Baseline> {
        Some(self.tracker.as_ref()?.baseline())
    }

    /// Writes what the history lacks. Why that is refused is told; it is tried again.
    pub(super) fn settle(&mut self) {
        let _ = self.store.settle();
    }

    /// Tells the status of the drift, of what hinders its judgement, and of what the history lacks.
    pub(super) fn tell(&self, status: &mut EstimationStatus) {
        status.drift = self.drift();
        status.baseline_unreadable.clone_from(&self.unreadable);
        self.tell_owed(status);
    }

    /// Tells the status what the history lacks.
    pub(super) fn tell_owed(&self, status: &mut EstimationStatus) {
        let (lines, why) = self.store.owed();
        status.history_lines_waiting = lines as u64;
        status.history_waits_for = why.map(str::to_owned);
    }

    /// What the status tells of the drift; nothing without a baseline.
    fn drift(&self) -> Option<DriftStatus> {
        self.tracker.as_ref().map(Tracker::status)
    }

    fn follow(&mut self, line: HistoryLine, drift: DriftOptions) {
        if drift != self.drift {
            // The same baseline, judged otherwise from here on, with what is at hand.
            self.drift = drift;
            self.baseline.forget();
        }
        // Before the line: one that was set after it has to find it at hand.
        self.look();
        if let Some(tracker) = &mut self.tracker {
            for (parameter, event) in tracker.handle_line(&line) {
                match event {
                    AlarmEvent::Raised => raised(tracker, &parameter),
                    AlarmEvent::Cleared => {
                        tracing::info!("drift: {parameter} is back in its band");
                    }
                }
            }
        }
        self.recent.push_back(line);
        if self.recent.len() > RECENT_LINES {
            self.recent.pop_front();
        }
    }

    /// How far errors of the model may set a result apart from the baseline.
    fn against(&self, record: &ResultRecord) -> Option<Against> {
        let baseline = self.tracker.as_ref()?.baseline();
        baseline.against(record.estimate.model_uncertainty.as_ref()?)
    }

    /// Stores a result. Only that may fail: what belongs to the result and
    /// could not be kept is logged, for the result is there.
    pub(super) fn take(
        &mut self,
        record: &ResultRecord,
        beside: &Beside,
        options: &ResultOptions,
    ) -> Result<Stored, StoreError> {
        // Before the result that refers to it.
        let configured = self.store.keep_configuration(&record.configuration, &options.texts);
        let beside = Beside { against: self.against(record), ..beside.clone() };
        let stored = self.store.write(record, &beside, Timestamp::now())?;
        if !stored.line.time.is_set() {
            tracing::warn!(
                "the clock is not set: result {} is left out of plots and trends",
                stored.number
            );
        }
        if let Err(problem) = configured {
            tracing::warn!("{} is stored, but: {problem}", stored.path.display());
        }
        self.follow(stored.line.clone(), options.drift);
        Ok(stored)
    }
}

fn raised(tracker: &Tracker, parameter: &str) {
    tracing::warn!(
        "drift: {}",
        tracker.sentence(parameter).unwrap_or_else(|| parameter.to_owned())
    );
}

#[cfg(test)]
mod tests;
