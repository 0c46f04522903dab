//! Results that the service has acknowledged, and their state on disk.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::archive::store::{ConfigurationTexts, HistoryError, ResultRecord, Stored, read_history};
use crate::text::sha256;

/// Returns the hash and the texts of a configuration.
pub(super) fn configuration(name: &str) -> (String, ConfigurationTexts) {
    let texts = ConfigurationTexts {
        cell: format!("cell {name}").repeat(50),
        robot: format!("robot {name}").repeat(50),
        layout: vec![("layout.dbc".to_owned(), name.repeat(500))],
    };
    (sha256(&[name]), texts)
}

/// Returns the configuration with a hash.
pub(super) fn configuration_of(hash: &str) -> (String, ConfigurationTexts) {
    ["first", "second"].map(configuration).into_iter().find(|(own, _)| own == hash).unwrap()
}

/// Acknowledged results.
#[derive(Debug, Default)]
pub(super) struct Facts {
    stored: Vec<Stored>,
    /// Newest results whose lines are not in the history yet.
    pending: usize,
    /// Results that a crash took while nothing said whether they are on disk.
    uncertain: usize,
    /// Attempts that the disk refused.
    pub(super) refused: usize,
}

impl Facts {
    pub(super) fn add(&mut self, mut stored: Stored) {
        // As a reader has it: a number may differ in its last bit.
        let text = serde_json::to_string(&stored.line).unwrap();
        stored.line = serde_json::from_str(&text).unwrap();
        self.stored.push(stored);
    }

    pub(super) fn stored(&self) -> usize {
        self.stored.len()
    }

    pub(super) fn set_pending(&mut self, pending: usize) {
        self.pending = pending;
    }

    /// After the end of a process: it may have been storing a result, or have written lines that
    /// were pending.
    pub(super) fn forget_unacknowledged(&mut self) {
        self.uncertain += 1;
    }

    /// Returns what is missing or wrong in a folder.
    pub(super) fn problems(&self, folder: &Path) -> Vec<String> {
        let mut problems = Vec::new();
        let (lines, passed_over) = match read_history(folder) {
            Ok(read) => read,
            Err(HistoryError::None { .. }) => (Vec::new(), 0),
            Err(problem) => return vec![problem.to_string()],
        };
        if passed_over > 0 {
            problems.push(format!("{passed_over} lines of the history are torn"));
        }
        let mut by_number: BTreeMap<u64, usize> = BTreeMap::new();
        lines.iter().for_each(|line| *by_number.entry(line.result).or_default() += 1);
        problems.extend(
            by_number
                .iter()
                .filter(|(_, count)| **count > 1)
                .map(|(number, count)| format!("result {number} has {count} lines")),
        );
        let settled = self.stored.len() - self.pending.min(self.stored.len());
        for (at, own) in self.stored.iter().enumerate() {
            let line = lines.iter().find(|line| line.result == own.number);
            match line {
                Some(line) if *line != own.line => {
                    problems.push(format!("the line of result {} has changed", own.number));
                }
                None if at < settled => {
                    problems.push(format!("result {} has no line", own.number));
                }
                _ => {}
            }
            match fs::read(folder.join(own.path.file_name().unwrap())) {
                Ok(content) if content == own.json => {}
                Ok(_) => problems.push(format!("result {} has changed", own.number)),
                Err(problem) => problems.push(format!("result {}: {problem}", own.number)),
            }
        }
        if lines.len() > self.stored.len() + self.uncertain {
            problems.push(format!("{} lines of {} results", lines.len(), self.stored.len()));
        }
        if self.stored.windows(2).any(|two| two[1].number <= two[0].number) {
            problems.push("a number is used again".to_owned());
        }
        problems.extend(file_problems(folder));
        problems
    }
}

/// Returns files that are incomplete, or whose configuration is.
fn file_problems(folder: &Path) -> Vec<String> {
    let mut problems = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if name.ends_with(".tmp") {
            problems.push(format!("{name} is left"));
        }
        if !name.starts_with("result-") {
            continue;
        }
        let content = fs::read(folder.join(&name)).unwrap();
        let record: ResultRecord = match serde_json::from_slice(&content) {
            Ok(record) => record,
            Err(problem) => {
                problems.push(format!("{name}: {problem}"));
                continue;
            }
        };
        let (sha256, texts) = configuration_of(&record.configuration);
        let cell = folder.join("configurations").join(sha256).join("cell.toml");
        if fs::read_to_string(cell).ok() != Some(texts.cell) {
            problems.push(format!("{name}: its configuration is not complete"));
        }
    }
    problems
}
