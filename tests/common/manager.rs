//! The service manager's end of the notification socket, for processes that a test starts.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use super::Process;

/// Hears what one process tells, with the time at which it was read: on a thread of its own,
/// because the process waits while its messages are not read.
pub(crate) struct Manager {
    path: PathBuf,
    messages: Receiver<(Instant, String)>,
    heard: Vec<(Instant, String)>,
}

impl Manager {
    pub(crate) fn listen(folder: &Path, name: &str) -> Self {
        let path = folder.join(name);
        let socket = UnixDatagram::bind(&path).unwrap();
        // For processes of other users too.
        std::fs::set_permissions(&path, Permissions::from_mode(0o666)).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(1))).unwrap();
        let (sender, messages) = channel();
        let name = path.clone();
        std::thread::spawn(move || {
            let mut buffer = [0; 8192];
            // Until the test's folder is removed.
            while name.exists() {
                if let Ok(length) = socket.recv(&mut buffer) {
                    let message = String::from_utf8(buffer[..length].to_vec()).unwrap();
                    if sender.send((Instant::now(), message)).is_err() {
                        break;
                    }
                }
            }
        });
        Self { path, messages, heard: Vec::new() }
    }

    /// Has the process tell this manager; with a watchdog of so many microseconds.
    pub(crate) fn manages(&self, command: &mut Command, watchdog: Option<Duration>) {
        command.env("NOTIFY_SOCKET", &self.path).env_remove("WATCHDOG_PID");
        if let Some(watchdog) = watchdog {
            command.env("WATCHDOG_USEC", watchdog.as_micros().to_string());
        }
    }

    /// Listens for a while.
    pub(crate) fn hear(&mut self, during: Duration) {
        let start = Instant::now();
        while let Some(remaining) = during.checked_sub(start.elapsed()) {
            match self.messages.recv_timeout(remaining) {
                Ok(message) => self.heard.push(message),
                Err(_) => std::thread::sleep(during.saturating_sub(start.elapsed())),
            }
        }
    }

    /// Listens until a message since number `after` has the words; its number and the message.
    ///
    /// # Panics
    /// When none comes within two minutes.
    pub(crate) fn expect(&mut self, after: usize, words: &str) -> (usize, String) {
        let start = Instant::now();
        loop {
            let mut messages = self.heard.iter().enumerate().skip(after);
            if let Some((number, (_, message))) =
                messages.find(|(_, (_, said))| said.contains(words))
            {
                return (number, message.clone());
            }
            assert!(start.elapsed().as_secs() < 120, "no `{words}` in {:#?}", self.heard);
            self.hear(Duration::from_millis(20));
        }
    }

    /// Messages so far.
    pub(crate) fn count(&mut self) -> usize {
        self.heard.extend(self.messages.try_iter());
        self.heard.len()
    }

    /// When messages with the words were read.
    pub(crate) fn times(&self, words: &str) -> Vec<Instant> {
        let messages = self.heard.iter().filter(|(_, message)| message.contains(words));
        messages.map(|(at, _)| *at).collect()
    }
}

/// Sends a signal to a process that this test started.
pub(crate) fn send(process: &Process, signal: Signal) {
    let pid = Pid::from_raw(i32::try_from(process.0.id()).unwrap()).unwrap();
    kill_process(pid, signal).unwrap();
}

/// Asks a process to end; how it ended and how long that took.
pub(crate) fn terminate(process: &mut Process) -> (std::process::ExitStatus, Duration) {
    let start = Instant::now();
    send(process, Signal::TERM);
    (process.0.wait().unwrap(), start.elapsed())
}
