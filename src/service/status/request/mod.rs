//! Requests to the command socket. Each is one line of words.

mod baseline;
mod capture;
mod error;

use core::fmt;
use core::str::FromStr;

pub use baseline::{BaselineCommandError, BaselineRequest};
pub use capture::CaptureRequest;
pub use error::{MAX_REQUEST, RequestError};

use didim_dynamics::robot::is_hidden;

use crate::live::worker::Command;
use crate::window::Note;

/// Commands to a running service.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// `window begin`, `window end`, `window identify`.
    Window(Command),
    /// `capture start [NAME]`, `capture stop`.
    Capture(CaptureRequest),
    /// `reload`: reads the configuration again.
    Reload,
    /// `note {"payload_kg":2.5,"temperature_c":31,"text":"…"}`, with at least one of the keys. The
    /// note applies to the open window, or to the next one.
    Note(Note),
    /// `baseline set [N]`, `baseline clear`.
    Baseline(BaselineRequest),
}

impl FromStr for Request {
    type Err = RequestError;

    /// Parses the words of a line without its newline.
    fn from_str(line: &str) -> Result<Self, Self::Err> {
        if line.chars().any(is_hidden) {
            return Err(RequestError::NotText);
        }
        let (verb, rest) = line.split_once(' ').unwrap_or((line, ""));
        match (verb, rest) {
            ("window", "begin") => Ok(Self::Window(Command::Begin)),
            ("window", "end") => Ok(Self::Window(Command::End)),
            ("window", "identify") => Ok(Self::Window(Command::Identify)),
            ("capture", _) => line.parse().map(Self::Capture),
            ("note", json) => {
                let note: Note = serde_json::from_str(json).map_err(|_| RequestError::Unknown)?;
                Ok(Self::Note(note.validated()?))
            }
            ("baseline", _) => line.parse().map(Self::Baseline),
            ("reload", "") if line == verb => Ok(Self::Reload),
            _ => Err(RequestError::Unknown),
        }
    }
}

impl fmt::Display for Request {
    /// Writes the words that [`FromStr`] reads, without the newline.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Window(Command::Begin) => f.write_str("window begin"),
            Self::Window(Command::End) => f.write_str("window end"),
            Self::Window(Command::Identify) => f.write_str("window identify"),
            Self::Capture(request) => request.fmt(f),
            Self::Note(note) => {
                write!(f, "note {}", serde_json::to_string(note).map_err(|_| fmt::Error)?)
            }
            Self::Baseline(request) => request.fmt(f),
            Self::Reload => f.write_str("reload"),
        }
    }
}

/// Parses a received line, with its newline, as a request.
///
/// # Errors
/// [`RequestError`].
pub fn parse_request(line: &[u8]) -> Result<Request, RequestError> {
    if line.len() > MAX_REQUEST {
        return Err(RequestError::NoLine);
    }
    let line = line.strip_suffix(b"\n").ok_or(RequestError::NoLine)?;
    let line = line.strip_suffix(b"\r").unwrap_or(line);
    core::str::from_utf8(line).map_err(|_| RequestError::NotText)?.parse()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expectation::Expectation;

    #[test]
    fn what_is_written_is_read() {
        for request in [
            Request::Window(Command::Begin),
            Request::Window(Command::End),
            Request::Window(Command::Identify),
            Request::Capture(CaptureRequest::Start("a_1".to_owned())),
            Request::Capture(CaptureRequest::Stop),
            Request::Baseline(BaselineRequest::Set(Some(3))),
            Request::Reload,
        ] {
            for end in ["\n", "\r\n"] {
                let line = format!("{request}{end}");
                assert_eq!(parse_request(line.as_bytes()), Ok(request.clone()));
            }
        }
    }

    fn note(text: &str) -> Note {
        Note { payload_kg: Some(2.5), temperature_c: Some(-12.25), text: Some(text.into()) }
    }

    #[test]
    fn the_longest_note_has_room_in_a_line() {
        for text in ["gripper \"B\" \\ {}", &"\u{1f9be}".repeat(100), &"\"".repeat(100)] {
            let line = format!("{}\n", Request::Note(note(text)));
            assert!(line.len() <= MAX_REQUEST, "{}", line.len());
            assert_eq!(parse_request(line.as_bytes()), Ok(Request::Note(note(text))));
        }
    }

    #[test]
    fn what_cannot_be_noted_is_refused_in_words() {
        let error = parse_request(b"note {\"payload_kg\":-1}\n").unwrap_err();
        assert!(error.to_string().contains("a payload of -1 kg is impossible"), "{error}");
        assert_eq!(
            parse_request(b"note {}\n"),
            Err(RequestError::Note(crate::window::NoteError::Empty))
        );
        for line in [&b"note\n"[..], b"note 3 kg\n", b"note {\"payload\":1}\n"] {
            assert_eq!(parse_request(line), Err(RequestError::Unknown), "{line:?}");
        }
        let expected = Expectation::of("characters-in-a-note");
        for hidden in expected.get::<Vec<String>>("characters") {
            let line = format!("note {{\"text\":\"a{hidden}b\"}}\n");
            let refused = parse_request(line.as_bytes());
            assert_eq!(refused, Err(RequestError::NotText), "{hidden:?}");
        }
        let escaped = parse_request(b"note {\"text\":\"a\\u202eb\"}\n").unwrap_err();
        assert_eq!(escaped, RequestError::Note(crate::window::NoteError::Text));
        expected.assert_said(&escaped.to_string(), &[]);
    }

    #[test]
    fn anything_else_is_refused_with_what_there_is() {
        for line in
            ["\n", "window\n", "window begin now\n", "WINDOW BEGIN\n", "reload \n", " reload\n"]
        {
            let error = parse_request(line.as_bytes()).unwrap_err();
            assert_eq!(error, RequestError::Unknown, "{line:?}");
            assert!(error.to_string().contains("window begin|end|identify"));
        }
        for line in ["", "reload", "window begin"] {
            assert_eq!(parse_request(line.as_bytes()), Err(RequestError::NoLine), "{line:?}");
        }
        let long = format!("{}\n", "x".repeat(MAX_REQUEST));
        assert_eq!(parse_request(long.as_bytes()), Err(RequestError::NoLine));
        for line in [&b"reload\0\n"[..], b"\xff\xfe\n", b"reload\nreload\n", b"\x1b[2J\n"] {
            assert_eq!(parse_request(line), Err(RequestError::NotText), "{line:?}");
        }
    }
}
