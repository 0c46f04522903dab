//! The requests that set and clear the baseline.

use core::fmt;
use core::str::FromStr;

use super::error::RequestError;
use crate::archive::drift::{Baseline, ChooseError, set_baseline};
use crate::archive::store::HistoryLine;
use crate::live::worker::Commands;

/// Commands for the baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BaselineRequest {
    /// `baseline set` or `baseline set N`: uses the last result that is usable for monitoring, or
    /// the result with this number.
    Set(Option<u64>),
    /// `baseline clear`: removes the baseline.
    Clear,
}

/// Reason why a baseline command failed.
#[derive(Debug, thiserror::Error)]
pub enum BaselineCommandError {
    /// The service stores no results.
    #[error("this service stores no results")]
    NoResults,
    /// The baseline cannot be read or set.
    #[error(transparent)]
    Choose(#[from] ChooseError),
    /// There is no baseline to clear.
    #[error("there is no baseline")]
    None,
}

impl FromStr for BaselineRequest {
    type Err = RequestError;

    fn from_str(line: &str) -> Result<Self, Self::Err> {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["baseline", "set"] => Ok(Self::Set(None)),
            ["baseline", "set", number] => number
                .parse()
                .map(|number| Self::Set(Some(number)))
                .map_err(|_| RequestError::Unknown),
            ["baseline", "clear"] => Ok(Self::Clear),
            _ => Err(RequestError::Unknown),
        }
    }
}

impl fmt::Display for BaselineRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Set(None) => f.write_str("baseline set"),
            Self::Set(Some(number)) => write!(f, "baseline set {number}"),
            Self::Clear => f.write_str("baseline clear"),
        }
    }
}

impl BaselineRequest {
    /// Executes the command in the folder of the worker's results. The worker notices the change in
    /// the same way as a change by another process.
    ///
    /// # Errors
    /// [`BaselineCommandError`].
    pub fn submit(self, commands: &Commands) -> Result<String, BaselineCommandError> {
        let folder = commands.folder().ok_or(BaselineCommandError::NoResults)?;
        match self {
            Self::Set(number) => {
                let HistoryLine { result, time, .. } = set_baseline(folder, number)?.result;
                Ok(format!("result {result} of {time} is the baseline"))
            }
            Self::Clear => match Baseline::remove(folder).map_err(ChooseError::from)? {
                true => Ok("the baseline is cleared".to_owned()),
                false => Err(BaselineCommandError::None),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_nothing_else() {
        let requests =
            [BaselineRequest::Set(None), BaselineRequest::Set(Some(7)), BaselineRequest::Clear];
        for request in requests {
            assert_eq!(request.to_string().parse(), Ok(request));
        }
        for line in [
            "baseline",
            "baseline set x",
            "baseline set -1",
            "baseline set 1 2",
            "baseline clear 1",
        ] {
            assert_eq!(line.parse::<BaselineRequest>(), Err(RequestError::Unknown), "{line}");
        }
    }
}
