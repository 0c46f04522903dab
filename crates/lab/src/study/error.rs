//! Errors of a study.

use std::path::{Path, PathBuf};

use super::shard::Shard;
use didim::cell::CellError;
use didim::files::TextError;

/// Reason why a plan cannot be carried out. Every variant names the file.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// A file cannot be read: check path and permissions, and that it is text.
    #[error("{}: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: TextError,
    },
    /// Not TOML, or a key is missing, unknown or of the wrong type.
    #[error("{}: {source}", file.display())]
    Format {
        /// The file.
        file: PathBuf,
        /// The parser's message, with line and key.
        source: Box<toml::de::Error>,
    },
    /// A value that makes no sense, or that does not fit the arm.
    #[error("{}: `{key}`: {problem}", file.display())]
    Value {
        /// The file.
        file: PathBuf,
        /// The key.
        key: String,
        /// The problem, and the allowed values.
        problem: String,
    },
    /// The cell that the plan names is invalid.
    #[error("{}: `cell`: {source}", file.display())]
    Cell {
        /// The plan.
        file: PathBuf,
        /// The problem of the cell.
        source: Box<CellError>,
    },
}

impl PlanError {
    pub(super) fn value(file: &Path, key: impl Into<String>, problem: impl ToString) -> Self {
        Self::Value { file: file.to_path_buf(), key: key.into(), problem: problem.to_string() }
    }
}

/// Reason why a study stopped. Its folder has the runs that were done before.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A file of the study cannot be read or written: check path, permissions and space.
    #[error("{}: {source}; name a folder that can be written", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A part of the study cannot be read: check its folder.
    #[error("{}: {source}; name a folder that `didim study --shard` has written", file.display())]
    Part {
        /// The file.
        file: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// Another process writes to the same folder.
    #[error(
        "{}: another study writes to it; wait for its end, or choose another folder",
        file.display()
    )]
    Busy {
        /// The file.
        file: PathBuf,
    },
    /// The folder holds the runs of another study.
    #[error(
        "{}: holds the runs of another study, {what} differs (there {there:?}, here {here:?}); \
         choose another folder, or remove it",
        file.display()
    )]
    OtherStudy {
        /// The file.
        file: PathBuf,
        /// The part that differs.
        what: &'static str,
        /// Value in the file.
        there: String,
        /// Requested value.
        here: String,
    },
    /// The first line of the file is not that of a study.
    #[error(
        "{}: its first line is not that of a study; choose another folder, or remove it",
        file.display()
    )]
    NotAStudy {
        /// The file.
        file: PathBuf,
    },
    /// A line does not belong to a study.
    #[error("{}: line {line}: {problem}; remove that line, or the file", file.display())]
    Line {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Problem of the line.
        problem: String,
    },
    /// The folders belong to different divisions of the study.
    #[error(
        "{}: is one of {parts} parts, the others of {others}; name folders of one division",
        folder.display()
    )]
    OtherDivision {
        /// The folder.
        folder: PathBuf,
        /// Number of parts in its division.
        parts: u32,
        /// Number of parts in the division of the first folder.
        others: u32,
    },
    /// Two results of one run differ: the processors had different vector instructions, or a folder
    /// was edited.
    #[error(
        "{}: {run}: differs from the same run in {}; run both parts on processors with the same \
         vector instructions, or leave one folder out",
        folder.display(), other.display()
    )]
    Differ {
        /// The folder.
        folder: PathBuf,
        /// The folder that had the run first.
        other: PathBuf,
        /// The run: method, seed, levels.
        run: String,
    },
    /// Parts that are incomplete, each with its number of missing runs.
    #[error(
        "nothing is merged, runs are missing: {}; run these parts, or name their folders too",
        parts
            .iter()
            .map(|(part, runs)| format!("{runs} of part {part}"))
            .collect::<Vec<_>>()
            .join(", ")
    )]
    Missing {
        /// The parts.
        parts: Vec<(Shard, usize)>,
    },
    /// A record of the study could not be written as JSON.
    #[error("a run could not be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
}
