//! The results of one arm in a folder: stored with their configuration, compared with a baseline.

use std::collections::VecDeque;
use std::path::Path;

use crate::archive::drift::{
    AlarmEvent, BASELINE_PLACE, Baseline, BaselineWatch, DriftOptions, DriftStatus, Tracker,
};
use crate::archive::store::{
    Attachments, ConfigurationTexts, HistoryLine, ModelDifference, RECENT_LINES, ResultRecord,
    Store, StoreError, Stored, Timestamp,
};

/// Data stored with the results, so that they can be reproduced and compared.
#[derive(Clone, Debug, Default)]
pub struct ResultOptions {
    /// The files of the configuration as read.
    pub texts: ConfigurationTexts,
    /// Hash of the composition of the base parameters, for the history.
    pub regrouping: String,
    /// Options for drift from the baseline.
    pub drift: DriftOptions,
    /// Function that describes the comparison with the baseline in a report (HTML).
    pub baseline_section: Option<fn(&DriftStatus) -> String>,
}

/// A folder of results, open for writing.
#[derive(Debug)]
pub struct Results {
    store: Store,
    /// Drift options of the last result.
    drift: DriftOptions,
    /// Last lines of the history. A baseline may be set to one of them.
    recent_lines: VecDeque<HistoryLine>,
    baseline: BaselineWatch,
    /// Reason why the existing baseline cannot be read. `None` if it was read or does not exist.
    baseline_error: Option<String>,
    /// Baseline, and the evaluation of the results after it. `None` without a baseline.
    tracker: Option<Tracker>,
}

impl Results {
    /// Opens a folder, and creates it if it does not exist. `max_results` is the number of result
    /// files to keep.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn open(
        folder: &Path,
        max_results: usize,
        drift: DriftOptions,
    ) -> Result<Self, StoreError> {
        let (store, recent) = Store::open_with_history(folder, max_results)?;
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

    /// Checks whether another process has set or cleared the baseline. If so, compares the lines in
    /// memory with the new one and returns true. An unreadable baseline is read again at each
    /// check, because the same file may become readable, but is logged once.
    pub fn poll_baseline(&mut self) -> bool {
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
    pub fn baseline(&self) -> Option<&Baseline> {
        Some(self.tracker.as_ref()?.baseline())
    }

    /// Writes the pending history lines. If this fails, [`Self::pending_count`] has the reason, and
    /// the next call tries again.
    pub fn settle(&mut self) {
        let _ = self.store.settle();
    }

    /// Returns the number of pending history lines, and the reason.
    pub fn pending_count(&self) -> (usize, Option<&str>) {
        self.store.pending_count()
    }

    /// Returns the reason why the existing baseline cannot be read.
    pub fn baseline_error(&self) -> Option<&str> {
        self.baseline_error.as_deref()
    }

    /// Returns the drift from the baseline. `None` without a baseline.
    pub fn drift(&self) -> Option<DriftStatus> {
        self.tracker.as_ref().map(Tracker::status)
    }

    /// Returns the stored result with these values from this input and configuration, among the
    /// last results.
    pub fn find_equal(&self, record: &ResultRecord) -> Option<u64> {
        let equal = |line: &&HistoryLine| line.has_values_of(record);
        self.recent_lines.iter().rev().find(equal).map(|line| line.result)
    }

    fn follow_line(&mut self, line: HistoryLine, drift: DriftOptions) {
        if drift != self.drift {
            // The lines in memory are compared again with the same baseline and the new drift
            // options.
            self.drift = drift;
            self.baseline.report_again();
        }
        // The baseline is checked before the line is added. If the baseline is later set to this
        // line, it must be in memory.
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

    /// Stores a result of this time. The function fails only if the result itself cannot be stored.
    /// Failures to store the related data are only logged.
    ///
    /// # Errors
    /// [`StoreError`]; the previous content is unchanged.
    pub fn store_result(
        &mut self,
        record: &ResultRecord,
        auxiliary: &Attachments,
        options: &ResultOptions,
        time: Timestamp,
    ) -> Result<Stored, StoreError> {
        // The configuration is written before the result that refers to it.
        let configured = self.store.keep_configuration(&record.configuration, &options.texts);
        // The report is written after the comparison with the baseline, which it contains.
        let attachments = Attachments {
            against: self.model_difference(record),
            report: None,
            ..auxiliary.clone()
        };
        let stored = self.store.write(record, &attachments, time)?;
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
        if let Some(report) = &auxiliary.report {
            let report = report.replacen(BASELINE_PLACE, &self.comparison(&stored, options), 1);
            if let Err(problem) = self.store.write_report(stored.number, &report) {
                tracing::warn!("{} is stored, but: {problem}", stored.path.display());
            }
        }
        Ok(stored)
    }

    /// Describes the comparison of a result with the baseline (HTML). Empty without a baseline.
    fn comparison(&self, stored: &Stored, options: &ResultOptions) -> String {
        let tracker = self.tracker.as_ref().filter(|of| of.is_after_baseline(&stored.line));
        let section = tracker.zip(options.baseline_section);
        section.map(|(tracker, describe)| describe(&tracker.status())).unwrap_or_default()
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
