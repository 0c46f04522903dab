//! Runs of a study on disk, in a file with one JSON line per run. A continued study does not repeat
//! the stored runs.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Grid, Run, Shard, StudyError};
use didim::text::sha256;

/// Version of the file's layout.
const SCHEMA: u32 = 1;

/// First line of the file, which identifies the study. Hashes are SHA-256.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Version of the layout.
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// Name of the study.
    pub study: String,
    /// Hash of the plan without its numbers of seeds, because a study may be continued with more
    /// seeds.
    pub plan_sha256: String,
    /// Hash of the cell's files.
    pub cell_sha256: String,
    /// Hash of the simulated arms and of the controllers that the identification assumes.
    pub scenario_sha256: String,
    /// Part of the study to which the runs belong.
    #[serde(default = "Header::complete_shard", skip_serializing_if = "Shard::is_whole")]
    pub shard: Shard,
}

impl Header {
    /// Creates the header for the study of a grid.
    pub fn from_grid(grid: &Grid) -> Self {
        Self {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            study: grid.plan.name.clone(),
            plan_sha256: sha256(&[&grid.plan.identity()]),
            cell_sha256: grid.cell_sha256.clone(),
            scenario_sha256: grid.scenario_sha256.clone(),
            shard: Shard::COMPLETE,
        }
    }

    fn complete_shard() -> Shard {
        Shard::COMPLETE
    }

    /// Returns the first entry that differs from `here`: its name, the value of `self`, and the
    /// value of `here`.
    fn first_difference(&self, here: &Self) -> Option<(&'static str, String, String)> {
        let (schema, own_schema) = (self.schema.to_string(), here.schema.to_string());
        let (shard, own_shard) = (self.shard.to_string(), here.shard.to_string());
        [
            ("the layout", &schema, &own_schema),
            ("the program's version", &self.version, &here.version),
            ("the name", &self.study, &here.study),
            ("the plan", &self.plan_sha256, &here.plan_sha256),
            ("the cell", &self.cell_sha256, &here.cell_sha256),
            ("what is simulated", &self.scenario_sha256, &here.scenario_sha256),
            ("the part", &shard, &own_shard),
        ]
        .into_iter()
        .find(|(_, there, here)| there != here)
        .map(|(what, there, here)| (what, there.clone(), here.clone()))
    }
}

/// File `runs.jsonl` in the folder of a study, opened and locked.
#[derive(Debug)]
pub struct Store {
    file: File,
    path: PathBuf,
}

impl Store {
    /// Opens the file of runs in a folder, and returns it with the existing runs. A missing folder
    /// is created. An incomplete last line is removed.
    ///
    /// # Errors
    /// [`StudyError`]: the folder cannot be used, belongs to another study, or is damaged.
    pub fn open(folder: &Path, header: &Header) -> Result<(Self, Vec<Run>), StudyError> {
        let path = folder.join("runs.jsonl");
        let failed = |source| StudyError::File { file: path.clone(), source };
        std::fs::create_dir_all(folder).map_err(failed)?;
        let options = OpenOptions::new().read(true).append(true).create(true).to_owned();
        let mut file = options.open(&path).map_err(failed)?;
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => StudyError::Busy { file: path.clone() },
            TryLockError::Error(source) => failed(source),
        })?;
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(0)).map_err(failed)?;
        file.read_to_end(&mut bytes).map_err(failed)?;
        let length = whole_lines(&bytes);
        let (lines, torn) = bytes.split_at(length);
        let mut store = Self { file, path };
        if lines.is_empty() {
            let first = line_of(header)?;
            if !first.as_bytes().starts_with(torn) {
                return Err(StudyError::NotAStudy { file: store.path });
            }
            store.truncate(0)?;
            store.append(header)?;
            return Ok((store, Vec::new()));
        }
        let runs = read_lines(&store.path, lines, header)?;
        // The file is truncated only after the check that it belongs to this study.
        store.truncate(length as u64)?;
        Ok((store, runs))
    }

    /// Reads the runs of a folder without adding any. Returns the part of the study that the folder
    /// contains, and each run with its line. Any part of the study is accepted. An incomplete last
    /// line is skipped.
    ///
    /// # Errors
    /// [`StudyError`]: the folder cannot be read, belongs to another study, or is damaged.
    pub(super) fn read(
        folder: &Path,
        header: &Header,
    ) -> Result<(Shard, Vec<(Run, String)>), StudyError> {
        let path = folder.join("runs.jsonl");
        let mut bytes = std::fs::read(&path)
            .map_err(|source| StudyError::Part { file: path.clone(), source })?;
        bytes.truncate(whole_lines(&bytes));
        let mut lines = bytes.split(|byte| *byte == b'\n');
        let first = lines.next().unwrap_or_default();
        let shard = serde_json::from_slice(first).map_or(Shard::COMPLETE, |own: Header| own.shard);
        let runs = read_lines(&path, &bytes, &Header { shard, ..header.clone() })?;
        let lines = lines.map(|line| String::from_utf8_lossy(line).into_owned() + "\n");
        Ok((shard, runs.into_iter().zip(lines).collect()))
    }

    /// Adds a run.
    ///
    /// # Errors
    /// [`StudyError::File`].
    pub fn add(&mut self, run: &Run) -> Result<(), StudyError> {
        self.append(run)
    }

    /// Adds the line of a run without a change. Numbers that are parsed and formatted again may
    /// differ in the last digit.
    pub(super) fn add_line(&mut self, line: &str) -> Result<(), StudyError> {
        let written = self.file.write_all(line.as_bytes());
        written.map_err(|source| StudyError::File { file: self.path.clone(), source })
    }

    /// Truncates the file to `length` bytes.
    fn truncate(&mut self, length: u64) -> Result<(), StudyError> {
        let cut = self.file.set_len(length);
        cut.map_err(|source| StudyError::File { file: self.path.clone(), source })
    }

    fn append(&mut self, record: &impl Serialize) -> Result<(), StudyError> {
        self.add_line(&line_of(record)?)
    }
}

/// Returns the number of bytes up to the end of the last complete line. An incomplete line may end
/// within a multi-byte character.
fn whole_lines(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1)
}

fn line_of(record: &impl Serialize) -> Result<String, StudyError> {
    Ok(serde_json::to_string(record)? + "\n")
}

/// Parses complete lines: the first line as the header, the others as runs.
fn read_lines(path: &Path, bytes: &[u8], header: &Header) -> Result<Vec<Run>, StudyError> {
    let wrong = |line: usize, error: serde_json::Error| StudyError::Line {
        file: path.to_path_buf(),
        line,
        problem: error.to_string(),
    };
    let mut lines = bytes.strip_suffix(b"\n").unwrap_or(bytes).split(|byte| *byte == b'\n');
    let stored_header: Header = serde_json::from_slice(lines.next().unwrap_or_default())
        .map_err(|_| StudyError::NotAStudy { file: path.to_path_buf() })?;
    if let Some((what, there, here)) = stored_header.first_difference(header) {
        return Err(StudyError::OtherStudy { file: path.to_path_buf(), what, there, here });
    }
    let run = |(line, text)| serde_json::from_slice(text).map_err(|error| wrong(line, error));
    (2..).zip(lines).map(run).collect()
}
