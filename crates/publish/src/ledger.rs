//! Ledger of a cabinet: the last acknowledged result, and the alarms that wait for the broker. It
//! is one file, and every change replaces the complete file.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use didim::archive::drift::AlarmStatus;
use didim::archive::store::{HistoryLine, HistoryMark};
use didim::files::{TextError, read_bytes, replace};
use serde::{Deserialize, Serialize};

use crate::message::{AlarmMessage, AlarmTurn, UnsentCounts};

/// Version of the layout of the ledger file.
const SCHEMA: u32 = 1;
/// Maximum number of alarms that wait while there is no connection to the broker. Beyond it the
/// oldest alarms are dropped.
const MAX_WAITING: usize = 256;

/// Reason why a ledger cannot be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LedgerError {
    /// The ledger file cannot be read.
    #[error("cannot read {}: {source}; check its permissions", path.display())]
    File {
        /// Path of the ledger file.
        path: PathBuf,
        /// Error of the read.
        source: TextError,
    },
    /// The ledger file is damaged, or a later version has written it.
    #[error(
        "{}: {problem}; remove it, and every result is sent again with the identity that it had",
        path.display()
    )]
    Format {
        /// Path of the ledger file.
        path: PathBuf,
        /// Damage, or the version of the file.
        problem: String,
    },
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LedgerContent {
    schema: u32,
    /// Last result that the broker acknowledged.
    acknowledged: Option<HistoryMark>,
    /// Alarms that were raised at the last call of [`Ledger::take_alarms`].
    raised: Vec<AlarmStatus>,
    /// Alarm messages that are still to be sent, the oldest first.
    waiting: VecDeque<AlarmMessage>,
    unsent: UnsentCounts,
}

/// Ledger of one cabinet, with its file.
#[derive(Debug)]
pub(crate) struct Ledger {
    cabinet: String,
    path: PathBuf,
    content: LedgerContent,
    /// True if the last write failed and the failure was logged.
    logged_failure: bool,
}

impl Ledger {
    /// Reads the ledger of a cabinet in a folder, or creates an empty ledger if there is no file.
    ///
    /// # Errors
    /// [`LedgerError`] if the file cannot be read or has another format.
    pub(crate) fn open(folder: &Path, cabinet: &str) -> Result<Self, LedgerError> {
        let path = folder.join(file_name(cabinet));
        let empty = LedgerContent {
            schema: SCHEMA,
            acknowledged: None,
            raised: Vec::new(),
            waiting: VecDeque::new(),
            unsent: UnsentCounts::default(),
        };
        let content = match read_bytes(&path) {
            Err(source) if source.is_missing() => empty,
            Err(source) => return Err(LedgerError::File { path, source }),
            Ok(bytes) => {
                let wrong = |problem| LedgerError::Format { path: path.clone(), problem };
                let read: LedgerContent =
                    serde_json::from_slice(&bytes).map_err(|error| wrong(error.to_string()))?;
                if read.schema != SCHEMA {
                    return Err(wrong(format!("it is of version {}", read.schema)));
                }
                read
            }
        };
        Ok(Self { cabinet: cabinet.to_owned(), path, content, logged_failure: false })
    }

    /// Returns the last result that the broker acknowledged.
    pub(crate) fn last_acknowledged(&self) -> Option<&HistoryMark> {
        self.content.acknowledged.as_ref()
    }

    /// Returns the numbers of results and alarms that will never be sent.
    pub(crate) fn unsent_counts(&self) -> UnsentCounts {
        self.content.unsent
    }

    /// Records the acknowledgement of a result. If its number does not follow the number of the
    /// previous result, the results between them have no readable line and count as unsent.
    pub(crate) fn acknowledge_result(&mut self, line: &HistoryLine) {
        let between = self
            .last_acknowledged()
            .map_or(0, |last| line.result.saturating_sub(last.result).saturating_sub(1));
        if between > 0 {
            tracing::warn!(
                "{}: results that the history does not have any more, or not readable, and that \
                are not sent: {between}",
                self.cabinet
            );
            self.content.unsent.results += between;
        }
        self.content.acknowledged = Some(HistoryMark::from_line(line));
        self.write();
    }

    /// Returns the next alarm message to send.
    pub(crate) fn next_alarm(&self) -> Option<&AlarmMessage> {
        self.content.waiting.front()
    }

    /// Records the acknowledgement of the alarm message that [`Self::next_alarm`] returns.
    pub(crate) fn acknowledge_alarm(&mut self) {
        self.content.waiting.pop_front();
        self.write();
    }

    /// Takes the alarms that are raised now, and queues a message for each difference from the
    /// previous alarms.
    pub(crate) fn take_alarms(&mut self, now: &[AlarmStatus]) {
        let is_in = |alarm: &AlarmStatus, others: &[AlarmStatus]| {
            let key = (&alarm.parameter, alarm.since);
            others.iter().any(|other| (&other.parameter, other.since) == key)
        };
        let before = &self.content.raised;
        let cleared = before.iter().filter(|alarm| !is_in(alarm, now));
        let raised = now.iter().filter(|alarm| !is_in(alarm, before));
        let message = |event, alarm| AlarmMessage::new(&self.cabinet, event, alarm);
        let turns: Vec<AlarmMessage> = cleared
            .map(|alarm| message(AlarmTurn::Cleared, alarm))
            .chain(raised.map(|alarm| message(AlarmTurn::Raised, alarm)))
            .collect();
        if turns.is_empty() {
            return;
        }
        self.content.waiting.extend(turns);
        let surplus = self.content.waiting.len().saturating_sub(MAX_WAITING);
        if surplus > 0 {
            self.content.waiting.drain(..surplus);
            self.content.unsent.alarms += surplus as u64;
            tracing::warn!(
                "{}: more than {MAX_WAITING} alarms wait for the broker, and the oldest are \
                dropped: {surplus}",
                self.cabinet
            );
        }
        self.content.raised = now.to_vec();
        self.write();
    }

    /// Writes the ledger; a failure is only logged. After a restart, messages may then be sent
    /// twice, with the same identities.
    fn write(&mut self) {
        let written = serde_json::to_vec(&self.content)
            .map_err(std::io::Error::from)
            .and_then(|json| replace(&self.path, |out| out.write_all(&json)));
        match (written, self.logged_failure) {
            (Err(cause), false) => {
                tracing::warn!(
                    "cannot write {}: {cause}; free room on the disk, or else messages are sent \
                    again after a restart",
                    self.path.display()
                );
                self.logged_failure = true;
            }
            (Ok(()), true) => {
                tracing::info!("{} is written again", self.path.display());
                self.logged_failure = false;
            }
            (Err(_), true) | (Ok(()), false) => {}
        }
    }
}

/// Returns the name of a cabinet's ledger file.
fn file_name(cabinet: &str) -> String {
    format!("{cabinet}.json")
}

#[cfg(test)]
mod tests {
    use didim::archive::store::Timestamp;

    use super::*;

    fn alarm(parameter: usize, since: u64) -> AlarmStatus {
        AlarmStatus {
            description: None,
            parameter: format!("p{parameter}"),
            relative_change: Some(0.3),
            deviation_sigma: None,
            slope_per_day: None,
            slope_sd: None,
            since: Timestamp::from_unix_s(since),
            text: "grown".into(),
        }
    }

    fn turns(ledger: &mut Ledger) -> Vec<(AlarmTurn, String)> {
        let mut turns = Vec::new();
        while let Some(AlarmMessage { event, alarm, .. }) = ledger.next_alarm() {
            turns.push((*event, format!("{} {}", alarm.parameter, alarm.since.unix_s())));
            ledger.acknowledge_alarm();
        }
        turns
    }

    #[test]
    fn alarms_are_reported_when_they_turn_over_restarts_as_well() {
        use AlarmTurn::{Cleared, Raised};
        let folder = tempfile::tempdir().unwrap();
        let open_ledger = || Ledger::open(folder.path(), "c").unwrap();
        let mut ledger = open_ledger();
        ledger.take_alarms(&[alarm(1, 10), alarm(2, 10)]);
        ledger.take_alarms(&[alarm(1, 10), alarm(2, 10)]);
        let mut ledger = open_ledger();
        assert_eq!(turns(&mut ledger), [(Raised, "p1 10".into()), (Raised, "p2 10".into())]);
        let mut ledger = open_ledger();
        ledger.take_alarms(&[alarm(1, 20)]);
        let expected =
            [(Cleared, "p1 10".into()), (Cleared, "p2 10".into()), (Raised, "p1 20".into())];
        assert_eq!(turns(&mut ledger), expected);
        assert_eq!(turns(&mut open_ledger()), []);
    }

    #[test]
    fn a_bounded_number_of_alarms_waits() {
        let folder = tempfile::tempdir().unwrap();
        let mut ledger = Ledger::open(folder.path(), "c").unwrap();
        let alarms: Vec<_> = (0..300).map(|parameter| alarm(parameter, 10)).collect();
        ledger.take_alarms(&alarms);
        let ledger = Ledger::open(folder.path(), "c").unwrap();
        assert_eq!((ledger.unsent_counts().alarms, ledger.content.waiting.len()), (300 - 256, 256));
        assert_eq!(ledger.next_alarm().unwrap().alarm.parameter, "p44", "the oldest are dropped");
    }

    #[test]
    fn results_that_are_gone_are_counted() {
        let folder = tempfile::tempdir().unwrap();
        let mut ledger = Ledger::open(folder.path(), "c").unwrap();
        let line = |result: u64| {
            let line = serde_json::json!({
                "schema": 1, "time": "2026-11-22T07:17:29Z", "result": result, "robot": "tx40",
                "method": "didim",
                "configuration": "c", "applicable": true, "relative_error": null, "parameters": [],
            });
            serde_json::from_value::<HistoryLine>(line).unwrap()
        };
        // Results before the first one do not count as unsent. After the folder is emptied,
        // counting restarts at 0.
        for (result, unsent) in [(7, 0), (8, 0), (12, 3), (0, 3), (2, 4)] {
            ledger.acknowledge_result(&line(result));
            assert_eq!(ledger.unsent_counts().results, unsent, "{result}");
        }
        assert_eq!(
            Ledger::open(folder.path(), "c").unwrap().last_acknowledged().unwrap().result,
            2
        );
    }

    #[test]
    fn a_damaged_ledger_is_refused_with_a_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let empty = "\"acknowledged\":null,\"raised\":[],\"waiting\":[],\
                     \"unsent\":{\"results\":0,\"alarms\":0}}";
        let later = format!("{{\"schema\":2,{empty}");
        for text in ["{", "{\"schema\":1}", &later] {
            std::fs::write(folder.path().join("c.json"), text).unwrap();
            let error = Ledger::open(folder.path(), "c").unwrap_err().to_string();
            assert!(error.contains("c.json") && error.contains("remove it"), "{error}");
        }
        std::fs::write(folder.path().join("c.json"), format!("{{\"schema\":1,{empty}")).unwrap();
        Ledger::open(folder.path(), "c").unwrap();
    }
}
