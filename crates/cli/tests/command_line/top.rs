//! `didim top` on a terminal: it shows what comes and goes, and leaves the terminal as it was.

use std::fs::File;
use std::io::{Read, Write};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use didim::live::acquire::SharedAcquisition;
use didim::live::stream::StreamOptions;
use didim::live::worker::SharedEstimation;
use didim::service::status::{Collector, Snapshot};
use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, Winsize, tcgetattr, tcsetwinsize};

use super::support::{Folder, didim};

const LEAVE_ALTERNATE_SCREEN: &str = "\x1b[?1049l";
const SHOW_CURSOR: &str = "\x1b[?25h";

/// A program on a terminal of 80 × 24 characters.
pub(super) struct Watched {
    child: Child,
    terminal: File,
    /// The other end, so that the settings outlast the program.
    slave: File,
    shown: Arc<Mutex<String>>,
}

impl Watched {
    fn start(runtime: &str, variables: &[(&str, &str)]) -> Self {
        Self::start_command(&["top", "--runtime", runtime], variables)
    }

    pub(super) fn start_command(arguments: &[&str], variables: &[(&str, &str)]) -> Self {
        let terminal = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&terminal).unwrap();
        unlockpt(&terminal).unwrap();
        let name = ptsname(&terminal, Vec::new()).unwrap().into_string().unwrap();
        let slave = File::options().read(true).write(true).open(name).unwrap();
        let size = Winsize { ws_row: 24, ws_col: 80, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&slave, size).unwrap();
        assert!(canonical(&slave));
        let end = || Stdio::from(slave.try_clone().unwrap());
        let child = Command::new(env!("CARGO_BIN_EXE_didim"))
            .args(arguments)
            .env("TERM", "xterm-256color")
            .env_remove("NO_COLOR")
            .envs(variables.iter().copied())
            .stdin(end())
            .stdout(end())
            .stderr(end())
            .spawn()
            .unwrap();
        let terminal = File::from(terminal);
        let shown = Arc::new(Mutex::new(String::new()));
        let (mut reader, text) = (terminal.try_clone().unwrap(), Arc::clone(&shown));
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(length @ 1..) = reader.read(&mut buffer) {
                text.lock().unwrap().push_str(&String::from_utf8_lossy(&buffer[..length]));
            }
        });
        Self { child, terminal, slave, shown }
    }

    #[track_caller]
    fn waits_for(&self, words: &str) {
        self.waits_for_count(words, 1);
    }

    /// Waits until the words have come so often.
    #[track_caller]
    pub(super) fn waits_for_count(&self, words: &str, count: usize) {
        let until = Instant::now() + Duration::from_secs(20);
        while self.shown.lock().unwrap().matches(words).count() < count {
            assert!(Instant::now() < until, "never {words:?}: {:?}", self.shown.lock().unwrap());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Ends it, and holds the terminal against what it was.
    #[track_caller]
    fn left_after(mut self, end: impl FnOnce(&mut Self)) -> (ExitStatus, String) {
        // Until the signals and the terminal are its own.
        self.waits_for("didim top");
        end(&mut self);
        let slave = self.slave.try_clone().unwrap();
        let ended = self.ended(&[LEAVE_ALTERNATE_SCREEN, SHOW_CURSOR]);
        assert!(canonical(&slave), "lines are read as before");
        ended
    }

    /// Waits for its end and for the last words that it shows, and returns all that it showed.
    #[track_caller]
    pub(super) fn ended(mut self, last: &[&str]) -> (ExitStatus, String) {
        let status = self.child.wait().unwrap();
        last.iter().for_each(|words| self.waits_for(words));
        let shown = self.shown.lock().unwrap().clone();
        (status, shown)
    }

    pub(super) fn key(&mut self, key: &str) {
        self.terminal.write_all(key.as_bytes()).unwrap();
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Whether lines are read whole and echoed, as a shell leaves it to programs.
fn canonical(terminal: &File) -> bool {
    tcgetattr(terminal).unwrap().local_modes.contains(LocalModes::ICANON | LocalModes::ECHO)
}

/// The status of a service that has just begun.
pub(super) fn first_snapshot() -> Snapshot {
    let options = StreamOptions::new("left-cell", (Path::new("/tmp/x"), "x"), 6, 500.0, 1.0);
    let (acquisition, estimation) = (SharedAcquisition::default(), SharedEstimation::default());
    let now = Instant::now();
    let mut collector =
        Collector::new(&options.unwrap(), Some(acquisition), Some(estimation), None, now);
    collector.snapshot(now)
}

/// Tells the status to all who ask, as long as the test runs.
pub(super) fn serve(socket: &Path, snapshot: &Snapshot) {
    let json = serde_json::to_vec(snapshot).unwrap();
    let listener = UnixListener::bind(socket).unwrap();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let _ = stream.unwrap().write_all(&json);
        }
    });
}

#[test]
fn it_waits_for_a_service_and_a_key_ends_it() {
    let folder = Folder::new();
    let runtime = folder.path("");
    let mut watched = Watched::start(&runtime, &[]);
    watched.waits_for("no answer yet, asking again every second");
    serve(&Path::new(&runtime).join("status.sock"), &first_snapshot());
    watched.waits_for("left-cell");
    // Only what differs from what is shown is written.
    watched.waits_for("0/s, 0 in all");
    watched.key("p");
    watched.waits_for("PAUSED");
    let (status, shown) = watched.left_after(|watched| watched.key("q"));
    assert_eq!(status.code(), Some(0), "{shown:?}");
    assert!(shown.contains("\x1b[38;5;") || shown.contains("\x1b[3"), "colours: {shown:?}");
}

#[test]
fn a_signal_ends_it_and_the_terminal_is_as_it_was() {
    let folder = Folder::new();
    for signal in [Signal::TERM, Signal::INT] {
        let watched = Watched::start(&folder.path(""), &[("NO_COLOR", "1")]);
        let (status, shown) = watched.left_after(|watched| {
            kill_process(Pid::from_child(&watched.child), signal).unwrap();
        });
        assert_eq!(status.code(), Some(0), "{shown:?}");
        assert!(!shown.contains("\x1b[31m") && !shown.contains("\x1b[38;5;"), "{shown:?}");
    }
}

#[test]
fn without_a_terminal_it_says_what_to_do() {
    didim(&["top"]).refused(2, &["needs a terminal", "`didim status`"]);
}
