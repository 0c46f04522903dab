//! The client side of the two sockets, for the command line.

use core::time::Duration;
use std::io::{self, Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use super::request::Request;
use super::snapshot::{SCHEMA, Snapshot};

/// Maximum response time of the service.
const TIMEOUT: Duration = Duration::from_secs(5);
/// Maximum length of an answer \[bytes\].
const MAX_ANSWER: u64 = 1 << 20;

/// Reason why the service could not be queried.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// No service listens at this path. Start the service, or name the folder of its sockets.
    #[error(
        "no service at {}: {cause}; start `didim run`, or give the folder of its sockets with \
        --runtime",
        path.display()
    )]
    NoService {
        /// The path.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
    /// The user has no permission to connect. If the group of the socket has permission, add the
    /// user to this group.
    #[error("not allowed to use {}: {remedy}", path.display())]
    NotAllowed {
        /// The path.
        path: PathBuf,
        /// The remedy.
        remedy: &'static str,
    },
    /// The service did not answer in time. Its process may be stopped, or the machine overloaded.
    #[error(
        "no answer at {} within {} s; look whether its process is stopped or the machine busy. A \
         command may still be carried out: look at `didim status` before you send it again",
        path.display(),
        TIMEOUT.as_secs()
    )]
    NoAnswer {
        /// The path.
        path: PathBuf,
    },
    /// The connection failed.
    #[error("asking at {} failed: {cause}", path.display())]
    Io {
        /// The path.
        path: PathBuf,
        /// The system's error.
        cause: io::Error,
    },
    /// The service is busy with other clients. Try again.
    #[error("the service at {} is busy with other clients: try again", path.display())]
    Busy {
        /// The path.
        path: PathBuf,
    },
    /// The answer is not a status. Another program may be listening at this path.
    #[error("the answer of {} is not a status: {cause}", path.display())]
    NotAStatus {
        /// The path.
        path: PathBuf,
        /// Error of the JSON parser.
        cause: serde_json::Error,
    },
    /// The service has another version. Use the program of that version.
    #[error("the service speaks version {theirs} of the status, this program {SCHEMA}")]
    OtherSchema {
        /// Version of the service's status.
        theirs: u32,
    },
    /// The service refused the command.
    #[error("the service refused: {why}")]
    Refused {
        /// Reason of the refusal.
        why: String,
    },
}

/// Queries the status.
///
/// # Errors
/// [`ClientError`].
pub fn fetch_status(path: &Path) -> Result<Snapshot, ClientError> {
    let answer = read(connect(path)?, path)?;
    let not_a_status = |cause| ClientError::NotAStatus { path: path.to_owned(), cause };
    let json: serde_json::Value = serde_json::from_str(&answer).map_err(not_a_status)?;
    match json.get("schema").and_then(serde_json::Value::as_u64).map(u32::try_from) {
        Some(Ok(theirs)) if theirs != SCHEMA => Err(ClientError::OtherSchema { theirs }),
        _ => serde_json::from_value(json).map_err(not_a_status),
    }
}

/// Sends a command, and returns the answer of the service: one line, or nothing.
///
/// # Errors
/// [`ClientError`].
pub fn send_request(path: &Path, request: &Request) -> Result<String, ClientError> {
    let mut stream = connect(path)?;
    stream.write_all(format!("{request}\n").as_bytes()).map_err(|cause| failed(path, cause))?;
    let answer = read(stream, path)?;
    let answer = answer.trim_end();
    match answer.strip_prefix("ok: ") {
        Some(done) => Ok(done.to_owned()),
        None if answer == "ok" => Ok(String::new()),
        None => {
            let why = answer.strip_prefix("error: ").unwrap_or(answer).to_owned();
            Err(ClientError::Refused { why })
        }
    }
}

fn connect(path: &Path) -> Result<UnixStream, ClientError> {
    let connected = UnixStream::connect(path).and_then(|stream| {
        stream.set_read_timeout(Some(TIMEOUT))?;
        stream.set_write_timeout(Some(TIMEOUT))?;
        Ok(stream)
    });
    connected.map_err(|cause| match cause.kind() {
        io::ErrorKind::PermissionDenied => {
            let mode = path.metadata().ok().map(|socket| socket.permissions().mode());
            ClientError::NotAllowed { path: path.to_owned(), remedy: to_be_allowed(mode) }
        }
        _ => ClientError::NoService { path: path.to_owned(), cause },
    })
}

/// Returns the remedy for a missing permission. A client needs write access to the socket. If the
/// group of the socket has write access, the user can become a member of the group.
fn to_be_allowed(mode: Option<u32>) -> &'static str {
    match mode {
        Some(mode) if mode & 0o020 != 0 => "become a member of its group",
        _ => {
            "only the service's user may (runuser -u didim -- didim …), or the group that the cell \
             names: service.command_group, service.status_group"
        }
    }
}

fn read(stream: UnixStream, path: &Path) -> Result<String, ClientError> {
    let mut answer = String::new();
    let read = stream.take(MAX_ANSWER).read_to_string(&mut answer);
    match read {
        Ok(0) => Err(ClientError::Busy { path: path.to_owned() }),
        Ok(_) => Ok(answer),
        Err(cause) => Err(failed(path, cause)),
    }
}

/// Returns the error of a connection that failed.
fn failed(path: &Path, cause: io::Error) -> ClientError {
    let path = path.to_owned();
    match cause.kind() {
        io::ErrorKind::ConnectionReset => ClientError::Busy { path },
        // The end of a socket's timeout.
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => ClientError::NoAnswer { path },
        _ => ClientError::Io { path, cause },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_a_remedy_only_where_it_may_connect() {
        for (mode, group) in [(0o100_660, true), (0o100_620, true), (0o100_600, false)] {
            let remedy = to_be_allowed(Some(mode));
            assert_eq!(remedy == "become a member of its group", group, "{mode:o}");
        }
        assert!(to_be_allowed(None).contains("service.command_group"));
    }
}
