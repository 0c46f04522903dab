//! Full streams, and commands that are stopped.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::process::{Command, Stdio};
use std::time::Duration;

use super::support::{Folder, cia402_cell, data, didim, head, packed_cell, shipped};

/// A device that is always full.
fn full() -> Stdio {
    OpenOptions::new().write(true).open("/dev/full").unwrap().into()
}

fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_didim"));
    command.args(arguments).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// What is said on stderr decides nothing: the exit code and the files are those of any other run.
#[test]
fn a_full_stderr_changes_nothing() {
    let folder = Folder::new();
    let (cell, log) = (packed_cell(), &data().packed_log);
    let result = folder.file(
        "result.json",
        &didim(&["identify", "--cell", &cell, "--input", log, "--json"]).done(),
    );
    // Cut, so that there is a warning.
    let text = head(log, 20_000);
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    drop(lines.drain(10_000..10_005));
    let cut = folder.file("cut.log", &lines.concat());
    let table = folder.path("nowhere/out.csv");
    let cases: [(&[&str], i32); 5] = [
        (&["export", "--cell", &cell, "--result", &result, "--to", "json"], 1),
        (&["predict", "--cell", &cell, "--result", &result, "--input", &cut], 0),
        (&["convert", "--cell", &cell, &cut, &table], 1),
        (&["check", "--cell", &shipped("cells/nowhere.toml")], 78),
        (&["identfy"], 2),
    ];
    for (arguments, code) in cases {
        let ended = program(arguments).stderr(full()).output().unwrap();
        assert_eq!(ended.status.code(), Some(code), "{arguments:?}: {ended:?}");
        // As where nobody reads: the other end of the pipe is closed.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let ended = program(arguments).stderr(writer).output().unwrap();
        assert_eq!(ended.status.code(), Some(code), "{arguments:?}: {ended:?}");
    }
}

#[test]
fn a_full_stdout_is_a_failure_and_a_closed_pipe_none() {
    let robot = shipped("robots/tx40.toml");
    let ended = program(&["robot", &robot]).stdout(full()).output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(said.starts_with("didim: ") && said.contains("No space left"), "{said}");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut closed = program(&["robot", &robot, "--toml"]);
    let ended = closed.stdout(writer).stderr(Stdio::piped()).output().unwrap();
    assert_eq!((ended.status.code(), ended.stderr.len()), (Some(0), 0));
}

#[test]
fn help_that_nobody_can_read_is_a_failure() {
    for words in [&["--help"][..], &["identify", "--help"], &["--version"]] {
        let ended = program(words).stdout(full()).output().unwrap();
        let said = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), Some(1), "{words:?}: {said}");
        assert!(said.starts_with("didim: ") && said.contains("No space left"), "{said}");
    }
}

/// A log and a table through standard input and through a named pipe. The content identifies them.
#[test]
fn what_comes_as_a_stream_is_read_as_a_file_is() {
    let folder = Folder::new();
    let (cell, log, csv) = (cia402_cell(), &data().cia402_log, folder.path("drive.csv"));
    didim(&["convert", "--cell", &cell, log, &csv]).done();
    let (pipe, report) = (folder.path("fifo-of-drive"), folder.path("report.html"));
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let without_time = |text: String| -> String {
        text.split_inclusive(',').filter(|part| !part.contains("elapsed_ms")).collect()
    };
    let identify = ["identify", "--cell", &cell, "--method", "idim-ls", "--json", "--report"];
    let identify = [&identify[..], &[&report, "--input"]].concat();
    for file in [log, &csv] {
        let of_file = without_time(didim(&[&identify[..], &[file]].concat()).done());
        let reported = std::fs::read_to_string(&report).unwrap();
        let contents = std::fs::read(file).unwrap();
        for (input, name) in [("-", "standard input"), (pipe.as_str(), "fifo-of-drive")] {
            let mut command = program(&[&identify[..], &[input]].concat());
            let streams = command.stdin(Stdio::piped()).stdout(Stdio::piped());
            let mut child = streams.stderr(Stdio::piped()).spawn().unwrap();
            let mut stdin = child.stdin.take().unwrap();
            match input {
                "-" => stdin.write_all(&contents).unwrap(),
                pipe => std::fs::write(pipe, &contents).unwrap(),
            }
            drop(stdin);
            let ended = child.wait_with_output().unwrap();
            let said = String::from_utf8(ended.stderr).unwrap();
            assert_eq!(ended.status.code(), Some(0), "{said}");
            assert_eq!(without_time(String::from_utf8(ended.stdout).unwrap()), of_file);
            // The SHA-256 as well; its name is another.
            let report_text = std::fs::read_to_string(&report).unwrap();
            let file_name = std::path::Path::new(file).file_name().unwrap().to_str().unwrap();
            // The date of a stream is not known, and that of its file is.
            let [of_stream, of_file] =
                [&report_text.replace(name, file_name), &reported].map(|text| without_date(text));
            assert_eq!(of_stream, of_file);
        }
    }
    // What is wrong is said of the name that was given.
    let refused = didim(&["identify", "--cell", &cell, "--input", "-"])
        .refused(1, &["standard input is empty"]);
    assert!(refused.contains("standard input") && !refused.contains("/proc/"), "{refused}");
    let mut command = program(&["identify", "--cell", &cell, "--input", "-"]);
    let mut child =
        command.stdin(Stdio::piped()).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(b"time_s,nothing\n0,1\n1,2\n").unwrap();
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(said.starts_with("didim: standard input: "), "{said}");
}

/// Both ends of the standard streams closed, as under some supervisors.
#[test]
fn closed_streams_are_no_panic() {
    for (command, code) in [("robot", 0), ("robot --nonsense", 2)] {
        let line = format!("exec \"$0\" {command} \"$1\" <&- >&- 2>&-");
        let robot = shipped("robots/tx40.toml");
        let words = ["-c", &line, env!("CARGO_BIN_EXE_didim"), &robot];
        let status = Command::new("sh").args(words).status().unwrap();
        assert_eq!(status.code(), Some(code), "{line}");
    }
}

/// Every command that works on files is stopped while it waits for one.
#[test]
fn commands_on_files_end_with_130_and_leave_nothing() {
    let folder = Folder::new();
    let (cell, log) = (packed_cell(), &data().packed_log);
    let result = folder.file(
        "result.json",
        &didim(&["identify", "--cell", &cell, "--input", log, "--json"]).done(),
    );
    let (pipe, out) = (folder.path("pipe.log"), folder.path("out.csv"));
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let temporary = folder.path("tmp");
    std::fs::create_dir(&temporary).unwrap();
    let with_result = ["--cell", &cell, "--result", &result, "--input", &pipe];
    let cases: [Vec<&str>; 5] = [
        [&["predict"], &with_result[..]].concat(),
        [&["payload"], &with_result[..]].concat(),
        vec!["identify", "--cell", &cell, "--input", &pipe],
        vec!["compare", "--cell", &cell, "--input", &pipe, "--report", &out],
        vec!["convert", "--cell", &cell, &pipe, &out],
    ];
    for (arguments, signal) in cases.iter().zip(["-INT", "-TERM"].into_iter().cycle()) {
        let mut command = program(arguments);
        let mut child = command.env("TMPDIR", &temporary).stderr(Stdio::null()).spawn().unwrap();
        // It opens without waiting as soon as the program reads.
        let nonblocking = i32::try_from(rustix::fs::OFlags::NONBLOCK.bits()).unwrap();
        let writer = loop {
            let opened = OpenOptions::new().write(true).custom_flags(nonblocking).open(&pipe);
            if let Ok(writer) = opened {
                break writer;
            }
            assert_eq!(child.try_wait().unwrap(), None, "it ended by itself: {arguments:?}");
            std::thread::sleep(Duration::from_millis(5));
        };
        let pid = child.id().to_string();
        assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130), "{arguments:?}");
        drop(writer);
    }
    assert_eq!(folder.names(), ["pipe.log", "result.json", "tmp"]);
    assert_eq!(std::fs::read_dir(temporary).unwrap().count(), 0);
}

/// A report without the date of the recording.
fn without_date(report: &str) -> String {
    let dates = [("<p>Recorded: ", "</p>"), ("<dt>Recorded</dt>", "</dd>")];
    dates.into_iter().fold(report.to_owned(), |report, (begin, end)| {
        let (before, date) = report.split_once(begin).unwrap();
        before.to_owned() + date.split_once(end).unwrap().1
    })
}
