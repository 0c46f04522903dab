//! What a file of `sim-fixtures/faults` says.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use didim_sim::fault_injection::InjectedFault;
use serde::Deserialize;

/// The project's folder.
pub(super) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// One way in which a bus, a machine or a person hurts the service.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FaultFile {
    /// The file, without its ending.
    #[serde(skip)]
    pub(super) name: String,
    pub(super) title: String,
    pub(super) family: String,
    /// Why the expectation was wrong, where it was.
    pub(super) corrected: Option<String>,
    /// What is executed here.
    pub(super) bus: Option<BusOf>,
    #[serde(default)]
    #[serde(rename = "damage")]
    pub(super) faults: Vec<InjectedFault>,
    pub(super) expected: Option<Expected>,
    /// Or another test that asserts it.
    pub(super) tested: Option<Tested>,
}

/// How the frames come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum BusOf {
    /// A SYNC, a frame of each drive, a target for each.
    Sync,
    /// One frame with a counter.
    Packed,
}

/// What must come of a fault that is executed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Expected {
    pub(super) detected_by: String,
    /// Where the assembler detects it: cycles from the first corrupted one to the one that counts
    /// it.
    pub(super) within_cycles: Option<usize>,
    /// Counts by cause. Causes of cycles that are not named have none.
    pub(super) counted: BTreeMap<String, Count>,
    /// What becomes of the windows of a replay, in order, the same in a row once: `yes` and `no` as
    /// the verdict for monitoring and prediction says, `safe` where either will do as long as
    /// nothing wrong is called good, otherwise the cause of a rejection.
    pub(super) replay: Vec<String>,
    /// The same of `didim identify`: `refused` where there is no result, `no-sample` where there is
    /// no sample.
    pub(super) identify: String,
    /// What the verdict for physical values says.
    pub(super) physical_values: Option<String>,
    /// What the reasons or refusals have to contain.
    pub(super) says: Option<String>,
    /// Parameters are wrong and nothing shows it: the tolerance that covers it, if it is stated.
    pub(super) undetectable: Option<Undetectable>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Count {
    Exactly(u64),
    Between([u64; 2]),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Undetectable {
    pub(super) tolerance: String,
    pub(super) value: f64,
}

/// A fault that another test puts on.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tested {
    pub(super) file: String,
    pub(super) test: String,
    pub(super) detected_by: String,
    pub(super) within: String,
    pub(super) counted: String,
    pub(super) outcome: String,
    /// What the test reads from here and asserts, by name: words of the program, and values.
    pub(super) expected: toml::Table,
}

impl Count {
    pub(super) fn has(&self, count: u64) -> bool {
        match self {
            Self::Exactly(own) => *own == count,
            Self::Between([least, most]) => (*least..=*most).contains(&count),
        }
    }

    pub(super) fn shown(&self) -> String {
        match self {
            Self::Exactly(count) => count.to_string(),
            Self::Between([least, most]) => format!("{least} to {most}"),
        }
    }
}

impl FaultFile {
    /// All of them, by name.
    pub(super) fn read_all() -> Vec<Self> {
        let folder = root().join("sim-fixtures/faults");
        let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
        let mut files: Vec<PathBuf> = files.filter(|path| path.is_file()).collect();
        files.sort();
        files.iter().map(|path| Self::read(path)).collect()
    }

    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let fail = |error| panic!("{}: {error}", path.display());
        let file: Self = toml::from_str(&text).unwrap_or_else(fail);
        let executed = file.bus.is_some() && file.expected.is_some() && !file.faults.is_empty();
        assert_ne!(executed, file.tested.is_some(), "{}: one of the two", path.display());
        Self { name: path.file_stem().unwrap().to_str().unwrap().to_owned(), ..file }
    }
}
