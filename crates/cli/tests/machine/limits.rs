//! A service that the system gives too little, or interrupts.

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use didim::live::acquire::BusState;
use didim::service::limits::NEEDS;
use didim::service::status::fetch_status;

use super::{in_own_network, ip};
use crate::common::Process;
use crate::common::expectation::Expectation;
use crate::common::manager::terminate;
use crate::program::{Daemon, Installation, run_below};

/// Maximum time for a start that is refused.
const REFUSED_WITHIN: Duration = Duration::from_secs(5);

/// A cell on an interface that does not exist, for which the service waits.
fn waiting_cell() -> Installation {
    Installation::from_cell("tx40-ethercat", &[("pcap:tx40.pcapng", "ethercat:didim-none")])
}

/// Starts the service below a limit of `prlimit`. Returns its message if it is refused, and `None`
/// if it works.
///
/// # Panics
/// If the start neither works nor is refused as it should be.
fn start_below(cell: &Installation, limit: &str) -> Option<String> {
    let mut command = run_below(&["prlimit", limit], cell, None);
    let start = Instant::now();
    let mut process = Process(command.stderr(Stdio::piped()).spawn().unwrap());
    let code = loop {
        if let Some(status) = process.0.try_wait().unwrap() {
            break status.code();
        }
        if fetch_status(&cell.runtime().join("status.sock")).is_ok() {
            let (status, _) = terminate(&mut process);
            assert_eq!(status.code(), Some(0), "{limit}");
            return None;
        }
        assert!(start.elapsed() < REFUSED_WITHIN, "{limit}: neither works nor is refused");
        std::thread::sleep(Duration::from_millis(2));
    };
    let words = std::io::read_to_string(process.0.stderr.take().unwrap()).unwrap();
    assert_eq!(code, Some(1), "{limit}: {words}");
    assert_eq!(words.lines().count(), 1, "{limit}: {words}");
    // Nothing was begun.
    assert!(!cell.runtime().exists(), "{limit}");
    assert_eq!(fs::read_dir(cell.state()).unwrap().count(), 0, "{limit}");
    Some(words)
}

/// Checks that `didim check` refuses the cell below a limit of `prlimit`, with the sentence of the
/// refused start.
fn check_below(cell: &Installation, limit: &str, of_start: &str) {
    let mut command = Command::new("prlimit");
    command.args([limit, env!("CARGO_BIN_EXE_didim"), "check", "--json", "--cell"]);
    let done = command.arg(cell.cell()).output().unwrap();
    assert_eq!(done.status.code(), Some(78), "{done:?}");
    let found: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    let errors =
        found["findings"].as_array().unwrap().iter().filter(|of| of["severity"] == "error");
    let said: Vec<String> = errors
        .map(|of| format!("{}: {}", of["what"].as_str().unwrap(), of["remedy"].as_str().unwrap()))
        .collect();
    assert!(said.iter().any(|said| of_start.contains(said)), "{said:?}: {of_start}");
}

#[test]
fn a_start_with_few_open_files_names_the_limit() {
    let cell = waiting_cell();
    let expected = Expectation::of("open-files-limited");
    let needed = NEEDS[0].needed();
    // With three, the system cannot load the program.
    for files in 4..needed {
        let words = start_below(&cell, &format!("--nofile={files}:{files}")).unwrap();
        expected.assert_said(&words, &[("files", &files), ("needed", &needed)]);
        if files % 40 == 0 {
            check_below(&cell, &format!("--nofile={files}:{files}"), &words);
        }
    }
    assert_eq!(start_below(&cell, &format!("--nofile={needed}:{needed}")), None);
    // A soft limit is raised.
    assert_eq!(start_below(&cell, &format!("--nofile=16:{needed}")), None);
}

#[test]
fn a_start_with_little_memory_names_the_limit() {
    let program = fs::metadata(env!("CARGO_BIN_EXE_didim")).unwrap().len();
    let expected = Expectation::of("memory-limited");
    for (need, option, setting) in [(&NEEDS[1], "as", "LimitAS"), (&NEEDS[2], "data", "LimitDATA")]
    {
        let cell = waiting_cell();
        let needed = need.needed();
        // The system cannot load a program into less than its size.
        let first = if option == "as" { program + (16 << 20) } else { 4 << 20 };
        for bytes in (first..needed).step_by(16 << 20) {
            let words = start_below(&cell, &format!("--{option}={bytes}:{bytes}")).unwrap();
            let placeholders: [(&str, &dyn ToString); 3] =
                [("bytes", &bytes), ("setting", &setting), ("needed", &needed)];
            expected.assert_said(&words, &placeholders);
            if bytes + (16 << 20) >= needed {
                check_below(&cell, &format!("--{option}={bytes}:{bytes}"), &words);
            }
        }
        assert_eq!(start_below(&cell, &format!("--{option}={needed}:{needed}")), None);
    }
}

/// System calls that wait, and whose interruption the kernel reports. It restarts a futex.
const WAITS: [&str; 3] =
    ["poll,ppoll,epoll_wait,epoll_pwait", "nanosleep,clock_nanosleep", "recvmmsg,accept4,connect"];

#[test]
#[ignore = "needs strace and a network of its own: tests/run"]
fn a_service_whose_waits_are_interrupted_goes_on() {
    in_own_network("machine::limits::a_service_whose_waits_are_interrupted_goes_on", || {
        ip("link add name tap0 type veth peer name tap1");
        ip("link set tap0 up");
        ip("link set tap1 up");
        for calls in WAITS {
            interrupt(calls);
        }
    });
}

/// Has every second one of the system calls of each thread fail with EINTR.
fn interrupt(calls: &str) {
    let cell = Installation::from_cell("tx40-ethercat", &[("pcap:tx40.pcapng", "ethercat:tap0")]);
    let (trace, inject) = (cell.path("trace"), format!("inject={calls}:error=EINTR:when=1+2"));
    let calls = format!("trace={calls}");
    // With `-D` the service itself is the child of this process.
    let output = trace.display().to_string();
    let strace = ["strace", "-D", "-f", "-qq", "-o", &output, "-e", &calls, "-e", &inject];
    let mut daemon = Daemon::start_below(&strace, &cell, None);
    let started = Instant::now();
    daemon.eventually("it runs for three seconds", |status| {
        assert_eq!(status.acquisition.as_ref().unwrap().bus, BusState::Waiting);
        started.elapsed() > Duration::from_secs(3)
    });
    let (code, _) = daemon.terminate();
    let log = daemon.log();
    let expected = Expectation::of("waits-interrupted");
    assert_eq!(code, Some(expected.get("exit_code")), "{log}");
    for words in expected.get::<Vec<String>>("never_says") {
        assert!(!log.contains(&words), "{log}");
    }
    let injected = fs::read_to_string(&trace).unwrap().matches("(INJECTED)").count();
    assert!(injected > 0, "{calls}");
}
