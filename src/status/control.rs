//! The control socket: one line, one answer.

use core::convert::Infallible;
use core::time::Duration;
use std::io;
use std::sync::Arc;

use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::UnixStream;
use tokio::sync::Semaphore;

use super::capture::CaptureRequest;
use super::listen::Socket;
use super::serve::accept;
use crate::worker::{Command, Commands};

/// Clients at a time.
const CLIENTS: usize = 4;
/// How long a client may take for its line and for reading the answer.
const CLIENT_TIMEOUT: Duration = Duration::from_secs(2);
/// How long the worker may take.
const WORKER_TIMEOUT: Duration = Duration::from_secs(1);
/// The longest line \[bytes\].
const MAX_LINE: u64 = 64;

/// A line that is no command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "not a command: write `window begin`, `window end`, `capture start NAME` or `capture stop`, and a newline"
)]
pub struct CommandLineError;

/// Reads a command.
///
/// # Errors
/// [`CommandLineError`].
pub fn parse_command(line: &str) -> Result<Command, CommandLineError> {
    match line.trim_end_matches(['\r', '\n']) {
        "window begin" => Ok(Command::Begin),
        "window end" => Ok(Command::End),
        _ => Err(CommandLineError),
    }
}

/// The line of a command.
pub(super) fn line(command: Command) -> &'static str {
    match command {
        Command::Begin => "window begin\n",
        Command::End => "window end\n",
    }
}

/// Takes commands until it is dropped. The answer is `ok` or `error: ` and the reason.
///
/// # Errors
/// Only at the start, when the runtime cannot take the socket.
pub async fn serve_commands(socket: &Socket, commands: Commands) -> io::Result<Infallible> {
    let listener = socket.tokio()?;
    let places = Arc::new(Semaphore::new(CLIENTS));
    loop {
        let (client, place) = accept(&listener, &places).await;
        let commands = commands.clone();
        tokio::spawn(async move {
            let _place = place;
            let _ = converse(client, commands).await;
        });
    }
}

async fn converse(client: UnixStream, commands: Commands) -> io::Result<()> {
    let (read, mut write) = client.into_split();
    let mut line = String::new();
    let mut read = BufReader::new(read.take(MAX_LINE));
    tokio::time::timeout(CLIENT_TIMEOUT, read.read_line(&mut line)).await??;
    let capture = line.trim_end_matches(['\r', '\n']).parse::<CaptureRequest>();
    let answer = match (parse_command(&line), capture) {
        (_, Ok(request)) => {
            let submitted = tokio::task::spawn_blocking(move || request.submit(&commands));
            match submitted.await.map_err(io::Error::other)? {
                Ok(()) => "ok\n".to_owned(),
                Err(error) => format!("error: {error}\n"),
            }
        }
        (Err(error), _) => format!("error: {error}\n"),
        (Ok(command), _) => {
            // The worker answers between two batches.
            let submitted =
                tokio::task::spawn_blocking(move || commands.submit(command, WORKER_TIMEOUT));
            match submitted.await.map_err(io::Error::other)? {
                Ok(()) => "ok\n".to_owned(),
                Err(error) => format!("error: {error}\n"),
            }
        }
    };
    tokio::time::timeout(CLIENT_TIMEOUT, write.write_all(answer.as_bytes())).await?
}
