//! The requests that begin and end a capture of the bus.

use core::fmt;
use core::str::FromStr;

use super::error::RequestError;
use crate::live::recording::CaptureError;
use crate::live::worker::Commands;

/// Default name of a capture.
const DEFAULT_NAME: &str = "bus";

/// Commands for captures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CaptureRequest {
    /// `capture start NAME`: starts a capture.
    Start(String),
    /// `capture stop`: ends the capture.
    Stop,
}

impl FromStr for CaptureRequest {
    type Err = RequestError;

    fn from_str(line: &str) -> Result<Self, Self::Err> {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["capture", "start"] => Ok(Self::Start(DEFAULT_NAME.to_owned())),
            ["capture", "start", name] => Ok(Self::Start(name.to_owned())),
            ["capture", "stop"] => Ok(Self::Stop),
            ["capture", "start", ..] => Err(RequestError::Capture(CaptureError::Name)),
            _ => Err(RequestError::Unknown),
        }
    }
}

impl fmt::Display for CaptureRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start(name) => write!(f, "capture start {name}"),
            Self::Stop => f.write_str("capture stop"),
        }
    }
}

impl CaptureRequest {
    /// Executes the command, and waits at most one second for the answer.
    ///
    /// # Errors
    /// [`CaptureError`].
    pub fn submit(&self, commands: &Commands) -> Result<String, CaptureError> {
        let nothing = "the cell file has no [service.recordings], or its bus is a log";
        let archiver =
            commands.archiver().ok_or_else(|| CaptureError::NothingRecorded(nothing.to_owned()))?;
        match self {
            Self::Start(name) => {
                archiver.start_capture(name)?;
                Ok(format!("the capture `{name}` has begun"))
            }
            Self::Stop => {
                archiver.stop_capture()?;
                Ok("the capture has ended; its recording is stored in a few seconds".to_owned())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_nothing_else() {
        for request in [CaptureRequest::Start("a_1".into()), CaptureRequest::Stop] {
            assert_eq!(request.to_string().parse(), Ok(request));
        }
        assert_eq!("capture start".parse(), Ok(CaptureRequest::Start("bus".into())));
        // A name of several words is distinguished from an unknown command.
        let refused = "capture start a b".parse::<CaptureRequest>().unwrap_err();
        assert_eq!(refused, RequestError::Capture(CaptureError::Name));
        for line in ["capture", "capture begin", "capture stop now", ""] {
            assert_eq!(line.parse::<CaptureRequest>(), Err(RequestError::Unknown), "{line}");
        }
    }
}
