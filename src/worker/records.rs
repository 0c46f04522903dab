//! What is kept of each result: its file, its line in the history, its configuration.

use std::path::Path;

use super::run::{RecordOptions, WorkerOptions};
use crate::store::{
    HISTORY_SCHEMA, HistoryLine, ParameterValue, ResultRecord, Store, StoreError, Timestamp,
};

/// The folder of the results as the thread that identifies sees it.
#[derive(Debug)]
pub(super) struct Records {
    store: Store,
    options: RecordOptions,
}

impl Records {
    pub(super) fn open(folder: &Path, options: &WorkerOptions) -> Result<Self, StoreError> {
        let (store, _recent) = Store::open_with_history(folder, options.keep)?;
        Ok(Self { store, options: options.records.clone() })
    }

    /// Stores a result and gives its content. Only that may fail: what belongs to the result and
    /// could not be kept is logged, for the result is there.
    pub(super) fn take(
        &mut self,
        record: &ResultRecord<'_>,
        report: Option<&str>,
    ) -> Result<Vec<u8>, StoreError> {
        // Before the result that refers to it.
        let configured = self.store.keep_configuration(record.configuration, &self.options.texts);
        let stored = self.store.write(record, report)?;
        let line = self.line(stored.number, record);
        for problem in [configured.err(), self.store.remember(&line).err()].into_iter().flatten() {
            tracing::warn!("{} is stored, but: {problem}", stored.path.display());
        }
        Ok(stored.json)
    }

    fn line(&self, result: u64, record: &ResultRecord<'_>) -> HistoryLine {
        let estimate = record.estimate;
        HistoryLine {
            schema: HISTORY_SCHEMA,
            time: Timestamp::now(),
            result,
            robot: estimate.robot.clone(),
            configuration: record.configuration.to_owned(),
            regrouping: self.options.regrouping.clone(),
            method: estimate.method.clone(),
            applicable: estimate.verdict.applicable,
            relative_error: Some(estimate.relative_error).filter(|error| error.is_finite()),
            note: None,
            parameters: ParameterValue::of(estimate),
        }
    }
}
