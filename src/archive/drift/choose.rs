//! Selection of the result that becomes the baseline.

use std::path::Path;

use super::{Baseline, BaselineError};
use crate::archive::store::{HistoryError, HistoryLine, read_history, read_known};

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
    let (lines, _) = read_history(folder)?;
    let available = match (lines.first(), lines.last()) {
        (Some(first), Some(last)) => format!("it has results {} to {}", first.result, last.result),
        _ => "it is empty".to_owned(),
    };
    // An emptied folder counts from 0 again, so a number may repeat. The last result with the
    // number is used.
    let mut newest_first = lines.into_iter().rev();
    let Some(result) = number else {
        let good = newest_first.find(HistoryLine::is_good_for_monitoring);
        return good.ok_or(ChooseError::NoneGood { available });
    };
    match newest_first.find(|line| line.result == result) {
        Some(line) if line.is_good_for_monitoring() => Ok(line),
        Some(_) => Err(ChooseError::NotGood { result }),
        None => Err(ChooseError::Unknown { result, available }),
    }
}
