//! Errors of a study.

use std::path::{Path, PathBuf};

use super::shard::Shard;
use didim::cell::CellError;
use didim::files::TextError;

/// Reason why a plan cannot be carried out. Every variant names the file.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// A file cannot be read. Check its path and permissions, and that it is a text file.
    #[error("{}: {source}", file.display())]
    Read {
        /// Path of the file.
        file: PathBuf,
        /// Reason why the file cannot be read.
        source: TextError,
    },
    /// The file is not TOML, or a key is missing, unknown or of the wrong type.
    #[error("{}: {source}", file.display())]
    Format {
        /// Path of the file.
        file: PathBuf,
        /// The parser's message, with line and key.
        source: Box<toml::de::Error>,
    },
    /// A value is invalid or does not fit the arm.
    #[error("{}: `{key}`: {problem}", file.display())]
    Value {
        /// Path of the file.
        file: PathBuf,
        /// Key of the value.
        key: String,
        /// Problem of the value, and the allowed values.
        problem: String,
    },
    /// The cell that the plan names is invalid.
    #[error("{}: `cell`: {source}", file.display())]
    Cell {
        /// Path of the plan.
        file: PathBuf,
        /// Error of the cell file.
        source: Box<CellError>,
    },
}

impl PlanError {
    pub(super) fn value(file: &Path, key: impl Into<String>, problem: impl ToString) -> Self {
        Self::Value { file: file.to_path_buf(), key: key.into(), problem: problem.to_string() }
    }
}

/// Reason why a study or a merge failed. The folder of a study keeps the runs that were completed
/// before.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A file of the study cannot be read or written. Check its path, its permissions and the free
    /// disk space.
    #[error("{}: {source}; name a folder that can be written", file.display())]
    File {
        /// Path of the file.
        file: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The runs of one part of the study cannot be read. Check the folder of the part.
    #[error("{}: {source}; name a folder that `didim study --shard` has written", file.display())]
    Part {
        /// Path of the file.
        file: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// Another process writes to the same folder.
    #[error(
        "{}: another study writes to it; wait for its end, or choose another folder",
        file.display()
    )]
    Busy {
        /// Path of the file.
        file: PathBuf,
    },
    /// The folder holds the runs of another study.
    #[error(
        "{}: holds the runs of another study, {what} differs (there {there:?}, here {here:?}); \
         choose another folder, or remove it",
        file.display()
    )]
    OtherStudy {
        /// Path of the file.
        file: PathBuf,
        /// Name of the header's first entry that differs.
        what: &'static str,
        /// Value in the existing file.
        there: String,
        /// Value of the requested study.
        here: String,
    },
    /// The first line of the file is not the header of a study.
    #[error(
        "{}: its first line is not that of a study; choose another folder, or remove it",
        file.display()
    )]
    NotAStudy {
        /// Path of the file.
        file: PathBuf,
    },
    /// A line of the file cannot be parsed as a run.
    #[error("{}: line {line}: {problem}; remove that line, or the file", file.display())]
    Line {
        /// Path of the file.
        file: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// Problem of the line.
        problem: String,
    },
    /// The folders belong to different divisions of the study, such as one into four parts and one
    /// into eight.
    #[error(
        "{}: is one of {parts} parts, the others of {others}; name folders of one division",
        folder.display()
    )]
    OtherDivision {
        /// Path of the folder.
        folder: PathBuf,
        /// Number of parts in the division of this folder.
        parts: u32,
        /// Number of parts in the division of the first folder.
        others: u32,
    },
    /// Two folders have different results of the same run: the processors had different vector
    /// instructions, or a folder was edited.
    #[error(
        "{}: {run}: differs from the same run in {}; run both parts on processors with the same \
         vector instructions, or leave one folder out",
        folder.display(), other.display()
    )]
    Differ {
        /// Path of the folder.
        folder: PathBuf,
        /// Path of the folder in which the run was found first.
        other: PathBuf,
        /// Method, seed and levels of the run.
        run: String,
    },
    /// Some parts of the study are incomplete.
    #[error(
        "nothing is merged, runs are missing: {}; run these parts, or name their folders too",
        parts
            .iter()
            .map(|(part, runs)| format!("{runs} of part {part}"))
            .collect::<Vec<_>>()
            .join(", ")
    )]
    Missing {
        /// Incomplete parts, each with its number of missing runs.
        parts: Vec<(Shard, usize)>,
    },
    /// A record of the study could not be written as JSON.
    #[error("a run could not be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
}
