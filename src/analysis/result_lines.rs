//! Results from files, as lines of a history.

use std::fs;
use std::path::Path;

use super::stored_model::{ResultError, parse_result};
use crate::archive::store::{Attachments, HistoryLine, Recordings, ResultRecord, Timestamp};

/// Reads a result that the service stored, or the output of `didim identify`, as the line that a
/// history would have under this number.
///
/// # Errors
/// [`ResultError`].
pub fn read_result_line(file: &Path, number: u64) -> Result<HistoryLine, ResultError> {
    let wrong = |source| ResultError::Read { file: file.to_path_buf(), source };
    let text = fs::read(file).map_err(wrong)?;
    let (configuration, estimate) =
        parse_result(&text).map_err(|problem| ResultError::no_result(file, &text, &problem))?;
    let configuration = configuration.unwrap_or_default();
    let record =
        ResultRecord::from_recordings("", &configuration, &Recordings::default(), estimate);
    let time = Timestamp::of_file(file).map_err(wrong)?;
    Ok(HistoryLine::new(number, &record, &Attachments::default(), time))
}
