//! Selection of the result that becomes the baseline.

use std::path::Path;

use super::{Baseline, BaselineError};
use crate::archive::store::{HistoryError, HistoryLine, for_each_line, read_known};

/// Reason why a result does not become the baseline.
#[derive(Debug, thiserror::Error)]
pub enum ChooseError {
    /// The history cannot be read.
    #[error(transparent)]
    History(#[from] HistoryError),
    /// The baseline cannot be written.
    #[error(transparent)]
    Baseline(#[from] BaselineError),
    /// No result is usable for monitoring. Wait for one that is, or read the reasons of the
    /// verdicts.
    #[error("no result in the history is usable for monitoring; {available}")]
    NoneGood {
        /// Description of the results in the history.
        available: String,
    },
    /// The result is not usable for monitoring. Choose another result.
    #[error(
        "result {result} is not usable for monitoring, so no result can be compared with it; \
            choose another, `didim history` lists them"
    )]
    NotGood {
        /// Number of the result.
        result: u64,
    },
    /// The history has no result with this number. Choose another number.
    #[error("result {result} is not in the history; {available}")]
    Unknown {
        /// Requested number.
        result: u64,
        /// Description of the results in the history.
        available: String,
    },
}

/// Makes a result of the folder's history its baseline. Takes the result with this number, or else
/// the last result that is usable for monitoring.
///
/// # Errors
/// [`ChooseError`]; the previous baseline stays.
pub fn set_baseline(folder: &Path, result: Option<u64>) -> Result<Baseline, ChooseError> {
    let result = choose_line(folder, result)?;
    let context = read_known(folder, result.result);
    let baseline = Baseline { available: context, ..Baseline::from_result(result) };
    baseline.write(folder)?;
    Ok(baseline)
}

fn choose_line(folder: &Path, number: Option<u64>) -> Result<HistoryLine, ChooseError> {
    let (mut range, mut found) = (None, None);
    // An emptied folder counts from 0 again, so a number may repeat. The last result with the
    // number is used. The row of a day is no result.
    for_each_line(folder, |line| {
        let (first, _) = range.unwrap_or((line.result, line.result));
        range = Some((first, line.result));
        let is_wanted = match number {
            Some(number) => line.result == number,
            None => line.is_good_for_monitoring(),
        };
        if is_wanted && line.day.is_none() {
            found = Some(line);
        }
    })?;
    let available = match range {
        Some((first, last)) => format!("it has results {first} to {last}"),
        None => "it is empty".to_owned(),
    };
    match (found, number) {
        (Some(line), _) if line.is_good_for_monitoring() => Ok(line),
        (Some(line), _) => Err(ChooseError::NotGood { result: line.result }),
        (None, Some(result)) => Err(ChooseError::Unknown { result, available }),
        (None, None) => Err(ChooseError::NoneGood { available }),
    }
}
