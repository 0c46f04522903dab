//! The baseline in `baseline.json` of the state folder: the result that later results are compared
//! with.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use didim_identification::identification::ModelUncertainty;
use serde::{Deserialize, Serialize};

use crate::archive::store::{
    HISTORY_SCHEMA, HistoryLine, ModelContext, ModelDifference, Timestamp,
};
use crate::files::{TextError, file_number, read_bytes, replace, with_disk};

/// Version of the file layout.
pub const BASELINE_SCHEMA: u32 = 1;

const FILE_NAME: &str = "baseline.json";

/// A complete result that later results are compared with. It may be older than every result in the
/// folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// [`BASELINE_SCHEMA`].
    pub schema: u32,
    /// Time at which it was made the baseline.
    pub set: Timestamp,
    /// History line of the result.
    pub result: HistoryLine,
    /// Additional data that were read from the result file.
    #[serde(flatten)]
    pub available: ModelContext,
}

/// Returns the remedy for an error of the file system.
fn remedy(cause: &io::Error) -> &'static str {
    match cause.kind() {
        io::ErrorKind::PermissionDenied => "run the command as the service's user",
        _ => "the folder needs free space, and a disk that works",
    }
}

/// Error when reading or setting a baseline.
#[derive(Debug, thiserror::Error)]
pub enum BaselineError {
    /// The file system refused access. Check the permissions of the folder, which the service's
    /// user owns.
    #[error("cannot {action} {}: {cause}; {}", path.display(), remedy(cause))]
    Io {
        /// The attempted operation.
        action: &'static str,
        /// Path that the operation used.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
    /// The file cannot be read. Check its permissions, or set the baseline again.
    #[error(
        "cannot read {}: {cause}; check its permissions, or set one with `didim baseline set`",
        path.display()
    )]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
    /// The file was not written by this program. Set the baseline again.
    #[error(
        "{} is no baseline of this program: {problem}; set one with `didim baseline set`",
        path.display()
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
}

impl Baseline {
    /// Returns true for the name of the file.
    pub fn is_file_name(name: &str) -> bool {
        name == FILE_NAME
    }

    /// Creates a baseline from a result, with the current time.
    pub fn from_result(result: HistoryLine) -> Self {
        Self {
            schema: BASELINE_SCHEMA,
            set: Timestamp::now(),
            result,
            available: ModelContext::default(),
        }
    }

    /// Returns how far model errors alone may shift a later result from the baseline. `None` if one
    /// of the two results does not report its model errors.
    pub fn compare_uncertainty(&self, later: &ModelUncertainty) -> Option<ModelDifference> {
        let deviations = later.difference_deviations(self.available.model_uncertainty.as_ref()?)?;
        #[expect(clippy::cast_possible_truncation, reason = "to single precision")]
        let standard_deviations = deviations.iter().map(|deviation| *deviation as f32).collect();
        let HistoryLine { result, time, .. } = self.result;
        Some(ModelDifference { result, time, standard_deviations })
    }

    /// Reads the baseline of a results folder, if there is one.
    ///
    /// # Errors
    /// [`BaselineError`].
    pub fn read(folder: &Path) -> Result<Option<Self>, BaselineError> {
        let path = folder.join(FILE_NAME);
        let wrong = |problem: String| BaselineError::Format { path: path.clone(), problem };
        let content = match read_bytes(&path) {
            Err(cause) if cause.is_missing() => return Ok(None),
            Err(TextError::Io(cause)) => {
                return Err(BaselineError::Read { path: path.clone(), cause });
            }
            Err(other) => return Err(wrong(other.to_string())),
            Ok(content) => content,
        };
        let baseline: Self =
            serde_json::from_slice(&content).map_err(|error| wrong(error.to_string()))?;
        if baseline.schema != BASELINE_SCHEMA {
            return Err(wrong(format!("its layout is version {}", baseline.schema)));
        }
        if baseline.result.schema != HISTORY_SCHEMA {
            let problem = format!("the layout of its result is version {}", baseline.result.schema);
            return Err(wrong(problem));
        }
        Ok(Some(baseline))
    }

    /// Writes the baseline of a folder.
    ///
    /// # Errors
    /// [`BaselineError::Io`]; the previous baseline is unchanged.
    pub fn write(&self, folder: &Path) -> Result<(), BaselineError> {
        let path = folder.join(FILE_NAME);
        let io_error = |action, cause| BaselineError::Io { action, path: path.clone(), cause };
        let mut json =
            serde_json::to_vec_pretty(self).map_err(|error| io_error("write", error.into()))?;
        json.push(b'\n');
        replace(&path, |out| out.write_all(&json)).map_err(|cause| io_error("write", cause))
    }

    /// Removes the baseline of a folder. Returns false if there is none.
    ///
    /// # Errors
    /// [`BaselineError::Io`].
    pub fn remove(folder: &Path) -> Result<bool, BaselineError> {
        let path = folder.join(FILE_NAME);
        match with_disk(|disk| disk.remove(&path)) {
            Ok(()) => match with_disk(|disk| disk.sync_folder(folder)) {
                Ok(()) => Ok(true),
                Err(cause) => Err(BaselineError::Io { action: "sync the folder of", path, cause }),
            },
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(cause) => Err(BaselineError::Io { action: "remove", path, cause }),
        }
    }
}

/// Detects that another process has set or cleared the baseline of a folder.
#[derive(Debug)]
pub struct BaselineWatch {
    folder: PathBuf,
    /// Inode, modification time and size of the baseline file at the last check. `None` before the
    /// first check. The inner `None` means that there was no file.
    file_properties: Option<Option<(u64, Option<SystemTime>, u64)>>,
}

impl BaselineWatch {
    /// Watches a folder. The first check reports a change.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), file_properties: None }
    }

    /// Makes the next check report a change.
    pub fn report_again(&mut self) {
        self.file_properties = None;
    }

    /// Returns the baseline if it was replaced or removed since the last check.
    ///
    /// # Errors
    /// [`BaselineError`], once per change.
    pub fn poll(&mut self) -> Option<Result<Option<Baseline>, BaselineError>> {
        let now = fs::metadata(self.folder.join(FILE_NAME))
            .ok()
            .map(|data| (file_number(&data), data.modified().ok(), data.len()));
        if self.file_properties == Some(now) {
            return None;
        }
        self.file_properties = Some(now);
        Some(Baseline::read(&self.folder))
    }
}
