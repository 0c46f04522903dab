//! The command socket. A client sends one line and gets one answer.

use core::convert::Infallible;
use core::time::Duration;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};

use didim_dynamics::robot::is_hidden;
use rustix::event::{PollFd, PollFlags, Timespec};
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::UnixStream;

use super::dispatch::Dispatcher;
use super::listen::Socket;
use super::request::{MAX_REQUEST, parse_request};
use super::serve::{Clients, accept};

/// Maximum number of simultaneous clients. The oldest one without a line gives its place to the
/// next.
const MAX_CLIENTS: usize = 4;
/// Maximum time for a client to send its line, and separately to read the answer.
const CLIENT_TIMEOUT: Duration = Duration::from_secs(2);
/// Maximum length of an answer in characters. An error may quote a file.
const MAX_ANSWER: usize = 2048;

/// Processes requests until the future is dropped. The answer is one line: `ok: ` with the action,
/// or `error: ` with the reason.
///
/// # Errors
/// Only at the start, if the runtime cannot use the socket.
pub async fn serve_commands(socket: &Socket, dispatcher: Dispatcher) -> io::Result<Infallible> {
    let listener = socket.to_tokio()?;
    let mut clients = Clients::new(MAX_CLIENTS);
    loop {
        let client = accept(&listener).await;
        let dispatcher = dispatcher.clone();
        clients.serve(async move |is_kept| {
            let _ = serve_client(client, dispatcher, &is_kept).await;
        });
    }
}

/// Serves one client. Its place is kept from its complete line until it has the answer.
async fn serve_client(
    client: UnixStream,
    dispatcher: Dispatcher,
    is_kept: &AtomicBool,
) -> io::Result<()> {
    let (read, mut write) = client.into_split();
    let mut line = Vec::with_capacity(MAX_REQUEST);
    // One byte more than the maximum length is read, which distinguishes a line that is too long
    // from a complete one.
    let mut read = BufReader::with_capacity(MAX_REQUEST, read.take(MAX_REQUEST as u64 + 1));
    tokio::time::timeout(CLIENT_TIMEOUT, read.read_until(b'\n', &mut line)).await??;
    is_kept.store(true, Ordering::Relaxed);
    // A process that was stopped reads a line late, and its client has given up meanwhile.
    if has_hung_up(write.as_ref()) {
        let command = one_line(&String::from_utf8_lossy(&line), MAX_REQUEST);
        tracing::warn!(command, "a command is not carried out, because its client is gone");
        return Ok(());
    }
    let answer = match parse_request(&line) {
        Err(error) => refusal_line(&error.to_string()),
        Ok(request) => match dispatcher.dispatch(request).await {
            Ok(done) => format!("ok: {}\n", one_line(&done, MAX_ANSWER)),
            Err(error) => refusal_line(&error.to_string()),
        },
    };
    tokio::time::timeout(CLIENT_TIMEOUT, write.write_all(answer.as_bytes())).await?
}

/// Returns true if the client has closed its end, so that nobody reads the answer. A client that
/// has only finished sending still waits for it.
fn has_hung_up(client: &UnixStream) -> bool {
    let mut polled = [PollFd::new(client, PollFlags::empty())];
    let found = rustix::event::poll(&mut polled, Some(&Timespec::default()));
    found.is_ok() && polled[0].revents().contains(PollFlags::HUP)
}

/// Formats a reason of a refusal as one line.
fn refusal_line(why: &str) -> String {
    format!("error: {}\n", one_line(why, MAX_ANSWER))
}

/// Formats a text as one line without control characters and with at most `limit` characters. The
/// text may quote a file, and a reader would take text after a line break as a separate line.
pub(crate) fn one_line(text: &str, limit: usize) -> String {
    let words = text.split(|each: char| each.is_whitespace() || is_hidden(each));
    let line = words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ");
    line.chars().take(limit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_is_one_bounded_line() {
        let quoted = "cell.toml: TOML parse error\n  |\n7 | x\u{1b}[2J = \n  | ^\n";
        assert_eq!(refusal_line(quoted), "error: cell.toml: TOML parse error | 7 | x [2J = | ^\n");
        assert_eq!(refusal_line(&"ä".repeat(5000)).chars().count(), MAX_ANSWER + 8);
    }
}
