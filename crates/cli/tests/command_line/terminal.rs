//! What is shown on a terminal: lines of its width, colours, that work goes on.

use std::fs::File;
use std::io::Read as _;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

use super::support::{Folder, cia402_cell, data};

/// A terminal of so many columns, and what was written to it.
struct Terminal {
    end: File,
    shown: Arc<Mutex<String>>,
}

impl Terminal {
    fn new(columns: u16) -> Self {
        let pty = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&pty).unwrap();
        unlockpt(&pty).unwrap();
        let name = ptsname(&pty, Vec::new()).unwrap().into_string().unwrap();
        let end = File::options().read(true).write(true).open(name).unwrap();
        let size = Winsize { ws_row: 24, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&end, size).unwrap();
        let shown = Arc::new(Mutex::new(String::new()));
        let (mut own, text) = (File::from(pty), Arc::clone(&shown));
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(length @ 1..) = own.read(&mut buffer) {
                text.lock().unwrap().push_str(&String::from_utf8_lossy(&buffer[..length]));
            }
        });
        Self { end, shown }
    }

    fn stream(&self) -> Stdio {
        self.end.try_clone().unwrap().into()
    }

    /// Once it has these words.
    fn text_with(&self, words: &str) -> String {
        loop {
            let text = self.shown.lock().unwrap().clone();
            if text.contains(words) {
                return text;
            }
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
    }
}

fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_didim"));
    command.args(arguments).env_remove("RUST_LOG").env_remove("NO_COLOR").stdin(Stdio::null());
    command.env("TERM", "xterm");
    command
}

/// Without what colours it.
fn plain(text: &str) -> String {
    let mut parts = text.split('\x1b');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |plain, part| plain + part.split_once('m').map_or("", |(_, rest)| rest))
}

#[test]
fn lines_have_the_width_of_the_terminal_and_verdicts_a_colour() {
    let cell = cia402_cell();
    let check: &[&str] = &["check", "--cell", &cell, "--other-machine"];
    let identify = ["identify", "--cell", &cell, "--input", &data().cia402_log];
    // What each ends with.
    for (arguments, last) in [(check, "CAN FD frames or more"), (&identify, "margin for the")] {
        for columns in [40, 60, 100] {
            let terminal = Terminal::new(columns);
            let status = program(arguments).stdout(terminal.stream()).status().unwrap();
            assert!(status.success());
            let words: Vec<&str> = last.split(' ').collect();
            let text = plain(&terminal.text_with(words[words.len() - 1]));
            for line in text.lines() {
                let length = line.trim_end_matches('\r').chars().count();
                assert!(length <= usize::from(columns), "{columns}: {line:?}");
            }
        }
    }
    let coloured = |variables: &[(&str, &str)]| {
        let terminal = Terminal::new(100);
        let mut command = program(check);
        let status = command.envs(variables.iter().copied()).stdout(terminal.stream()).status();
        assert!(status.unwrap().success());
        terminal.text_with("more buses").contains("\x1b[")
    };
    assert!(coloured(&[]) && coloured(&[("NO_COLOR", "")]));
    assert!(!coloured(&[("NO_COLOR", "1")]) && !coloured(&[("TERM", "dumb")]));
}

/// On the terminal of standard error, and in no pipe.
#[test]
fn long_work_shows_that_it_goes_on() {
    let folder = Folder::new();
    let pipe = folder.path("slow");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let cell = cia402_cell();
    let start = |stderr: Stdio| {
        let mut command = program(&["identify", "--cell", &cell, "--input", &pipe]);
        command.stdout(Stdio::null()).stderr(stderr).spawn().unwrap()
    };
    let terminal = Terminal::new(80);
    let mut child = start(terminal.stream());
    let writer = File::options().write(true).open(&pipe).unwrap();
    terminal.text_with("copying ");
    drop(writer);
    assert_eq!(child.wait().unwrap().code(), Some(1));
    terminal.text_with("standard input is empty");

    let child = start(Stdio::piped());
    drop(File::options().write(true).open(&pipe).unwrap());
    let said = String::from_utf8(child.wait_with_output().unwrap().stderr).unwrap();
    assert!(!said.contains("copying ") && said.contains("standard input is empty"), "{said}");
}
