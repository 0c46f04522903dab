//! The results of one arm in a folder: stored with their configuration, compared with a baseline.

use std::path::Path;

use crate::archive::drift::{
    AlarmEvent, Baseline, BaselineWatch, ChooseError, DriftOptions, DriftStatus, Tracker,
};
use crate::archive::store::{
    Attachments, ConfigurationTexts, HistoryError, HistoryLine, ModelDifference, ResultRecord,
    Store, StoreError, Stored, Timestamp, for_each_day, for_each_line,
};
use crate::files::remove_leftovers;

/// Data stored with the results, so that they can be reproduced and compared.
#[derive(Clone, Debug, Default)]
pub struct ResultOptions {
    /// The files of the configuration as read.
    pub texts: ConfigurationTexts,
    /// Hash of the composition of the base parameters, for the history.
    pub regrouping: String,
    /// Options for drift from the baseline.
    pub drift: DriftOptions,
}

/// A folder of results, open for writing.
#[derive(Debug)]
pub struct Results {
    store: Store,
    /// Drift options of the last result.
    drift: DriftOptions,
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
        let store = Store::open(folder, max_results)?;
        // A command that was killed while it set the baseline leaves an incomplete file.
        if let Err(cause) = remove_leftovers(folder, Baseline::is_file_name) {
            tracing::warn!("{}: an incomplete baseline stays: {cause}", folder.display());
        }
        let baseline = BaselineWatch::new(folder);
        Ok(Self { store, drift, baseline, baseline_error: None, tracker: None })
    }

    /// Checks whether another process has set or cleared the baseline. If so, compares the history
    /// with the new one and returns true. An unreadable baseline is read again at each
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
            self.for_each_line(|line| drop(tracker.handle_line(&line)));
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

    /// Returns the stored result with these values from this input and configuration, if it has a
    /// line of its own in the history.
    pub fn find_equal(&self, record: &ResultRecord) -> Option<u64> {
        let mut equal = None;
        self.for_each_line(|line| {
            if line.day.is_none() && line.has_values_of(record) {
                equal = Some(line.result);
            }
        });
        equal
    }

    /// Calls a function with each line of the history, also with those that are not written yet.
    fn for_each_line(&self, mut take: impl FnMut(HistoryLine)) {
        match for_each_line(self.store.folder(), &mut take) {
            Ok(_) | Err(HistoryError::None { .. }) => {}
            Err(error) => tracing::warn!("the drift is not complete: {error}"),
        }
        self.store.pending_lines().cloned().for_each(take);
    }

    /// Replaces results older than two weeks by rows of days, each with the alarms after it.
    fn summarise_days(&mut self, now: Timestamp) -> Result<(), StoreError> {
        let (folder, tracker) = (self.store.folder().to_owned(), self.tracker.as_ref());
        let tracker = tracker.map(|tracker| Tracker::new(tracker.baseline().clone(), self.drift));
        self.store.summarise_days(now, |rows, lines| {
            let Some(mut tracker) = tracker else { return };
            let earlier = for_each_day(&folder, |line| drop(tracker.handle_line(&line)));
            if let Err(error) = earlier {
                return tracing::warn!("the alarms of the days are not stored: {error}");
            }
            lines.iter().for_each(|line| drop(tracker.handle_line(line)));
            if let Some(day) = rows.last_mut().and_then(|row| row.day.as_mut()) {
                day.alarms = Some(tracker.checkpoint());
            }
        })
    }

    /// Prepares the comparison of the next result: with the drift options of its window, and with
    /// the present baseline.
    fn prepare_comparison(&mut self, drift: DriftOptions) {
        if drift != self.drift {
            // The history is compared again with the same baseline and the new drift options.
            self.drift = drift;
            self.baseline.report_again();
        }
        self.poll_baseline();
    }

    fn follow_line(&mut self, line: &HistoryLine) {
        if let Some(tracker) = &mut self.tracker {
            for (parameter, event) in tracker.handle_line(line) {
                match event {
                    AlarmEvent::Raised => log_alarm(tracker, &parameter),
                    AlarmEvent::Cleared => {
                        tracing::info!("drift: {parameter} is back in its band");
                    }
                }
            }
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
        self.prepare_comparison(options.drift);
        let against = self.model_difference(record);
        let attachments = Attachments { against, ..auxiliary.clone() };
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
        self.follow_line(&stored.line);
        if let Err(problem) = self.summarise_days(time) {
            tracing::warn!("the oldest part of the history stays as it is: {problem}");
        }
        Ok(stored)
    }
}

/// Returns the drift of a stored result from the baseline, judged with the results before it.
/// `None` without a baseline, for the baseline itself, and for results before it.
///
/// # Errors
/// The history or the baseline cannot be read.
pub fn drift_of_result(
    folder: &Path,
    line: &HistoryLine,
    options: DriftOptions,
) -> Result<Option<DriftStatus>, ChooseError> {
    let Some(baseline) = Baseline::read(folder)? else { return Ok(None) };
    let mut tracker = Tracker::new(baseline, options);
    if !tracker.is_after_baseline(line) {
        return Ok(None);
    }
    let mut is_over = false;
    for_each_line(folder, |earlier| {
        if !is_over {
            tracker.handle_line(&earlier);
        }
        is_over |= (earlier.result, earlier.time) == (line.result, line.time);
    })?;
    Ok(Some(tracker.status()))
}

fn log_alarm(tracker: &Tracker, parameter: &str) {
    tracing::warn!(
        "drift: {}",
        tracker.sentence(parameter).unwrap_or_else(|| parameter.to_owned())
    );
}

#[cfg(test)]
mod crashes;
#[cfg(test)]
mod tests;
