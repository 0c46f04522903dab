//! The `didim` program as people run it: a cell with folders of its own, processes, results.

pub(crate) mod cell;
pub(crate) mod recording;

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use didim::service::status::{Snapshot, fetch_status};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use tempfile::TempDir;

use crate::common::Process;

/// A path in the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(path)
}

/// The program with arguments.
pub(crate) fn command(arguments: &[&dyn AsRef<OsStr>]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_didim"));
    command.args(arguments.iter().map(|argument| argument.as_ref())).stdin(Stdio::null());
    command
}

/// How many parameters an output has: whatever has a name and a value must have a unit.
#[track_caller]
pub(crate) fn parameters_with_units(output: &Value) -> usize {
    let inner: usize = match output {
        Value::Array(values) => values.iter().map(parameters_with_units).sum(),
        Value::Object(values) => values.values().map(parameters_with_units).sum(),
        _ => 0,
    };
    let is_parameter = output["name"].is_string()
        && ["value", "found", "standard_deviation"].iter().any(|key| !output[key].is_null());
    if is_parameter {
        assert!(output["unit"].as_str().is_some_and(|unit| !unit.is_empty()), "{output}");
    }
    inner + usize::from(is_parameter)
}

/// How a program ended.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Runs the program to its end.
pub(crate) fn didim(arguments: &[&dyn AsRef<OsStr>]) -> Finished {
    let output = command(arguments).output().unwrap();
    Finished {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// Runs the program, which must succeed; what it printed.
pub(crate) fn succeed(arguments: &[&dyn AsRef<OsStr>]) -> String {
    let finished = didim(arguments);
    assert_eq!(finished.code, Some(0), "{finished:?}");
    finished.stdout
}

/// What `didim identify` prints of recordings of an arm of `tests/data`, together, between two
/// instants \[s\]: one JSON object.
pub(crate) fn identify_arm(
    arm: &str,
    recordings: &[impl AsRef<Path>],
    from_s: &str,
    to_s: &str,
) -> String {
    let cell = repository("tests/data").join(arm).join("cell.toml");
    identify_arm_with(&cell, arm, recordings, from_s, to_s)
}

/// The same with another cell.
pub(crate) fn identify_arm_with(
    cell: &Path,
    arm: &str,
    recordings: &[impl AsRef<Path>],
    from_s: &str,
    to_s: &str,
) -> String {
    let folder = repository("tests/data").join(arm);
    let inputs: Vec<_> = recordings.iter().map(|recording| folder.join(recording)).collect();
    let mut arguments: Vec<&dyn AsRef<OsStr>> =
        vec![&"identify", &"--json", &"--cell", &cell, &"--from", &from_s, &"--to", &to_s];
    for input in &inputs {
        arguments.extend([&"--input" as &dyn AsRef<OsStr>, input]);
    }
    succeed(&arguments)
}

/// A text with each left part, which must be there, replaced by the right one.
pub(crate) fn changed(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "`{from}` is not in the file: {text}");
        text.replace(from, to)
    })
}

/// A shipped cell set up in a temporary folder.
#[derive(Debug)]
pub(crate) struct Installation {
    folder: TempDir,
}

impl Installation {
    /// The cell of that name, its file changed as [`changed`] does.
    pub(crate) fn from_cell(name: &str, changes: &[(&str, &str)]) -> Self {
        let folder = tempfile::Builder::new().prefix("didim-").tempdir().unwrap();
        let shipped = fs::read_to_string(repository(&format!("config/cells/{name}.toml"))).unwrap();
        let config = repository("config").display().to_string();
        let text = changed(&shipped, &[("\"../", &format!("\"{config}/"))]);
        fs::write(folder.path().join("cell.toml"), changed(&text, changes)).unwrap();
        fs::create_dir(folder.path().join("state")).unwrap();
        Self { folder }
    }

    /// A file of that name.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn cell(&self) -> PathBuf {
        self.path("cell.toml")
    }

    /// Where the daemon leaves its results.
    pub(crate) fn state(&self) -> PathBuf {
        self.path("state")
    }

    /// Where the daemon's sockets are.
    pub(crate) fn runtime(&self) -> PathBuf {
        self.path("run")
    }

    /// The shipped motion with other rests around it, as a file for `--scenario`.
    pub(crate) fn scenario(&self, changes: &[(&str, &str)]) -> PathBuf {
        let shipped = include_str!("../../../../sim-fixtures/scenarios/tx40-paper.toml");
        let path = self.path("scenario.toml");
        fs::write(&path, changed(shipped, changes)).unwrap();
        path
    }
}

/// The result files of a folder in their order, without the link to the latest.
pub(crate) fn results(folder: &Path) -> Vec<String> {
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| {
        let name = path.file_name().unwrap().to_string_lossy();
        name.starts_with("result-") && name.ends_with(".json")
    });
    paths.sort();
    paths.iter().map(|path| fs::read_to_string(path).unwrap()).collect()
}

pub(crate) fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

/// Name and value of each parameter of an estimate.
pub(crate) fn parameters(estimate: &Value) -> Vec<(String, f64)> {
    let parameters = estimate["parameters"].as_array().unwrap();
    let parse_parameter = |parameter: &Value| {
        (parameter["name"].as_str().unwrap().to_owned(), parameter["value"].as_f64().unwrap())
    };
    parameters.iter().map(parse_parameter).collect()
}

/// The largest relative difference between the 28 parameters of two estimates.
pub(crate) fn difference(one: &Value, other: &Value) -> f64 {
    let (one, other) = (parameters(one), parameters(other));
    assert_eq!((one.len(), other.len()), (28, 28));
    let relative = one.iter().zip(&other).map(|((name, a), (same, b))| {
        assert_eq!(name, same);
        ((a - b) / b).abs()
    });
    relative.fold(0.0, f64::max)
}

/// What makes 1000 samples a second of the packed cell's 5000: a guest spends most of its processor
/// on frames.
pub(crate) const AT_1_KHZ: [(&str, &str); 3] = [
    ("rate_hz = 5000.0", "rate_hz = 1000.0"),
    ("factor = 125", "factor = 25"),
    ("sample_period_s = 2e-4", "sample_period_s = 1e-3"),
];

/// `didim run` of an installation, or a part of it, started by another program with its arguments.
pub(crate) fn run_below(starter: &[&str], cell: &Installation, part: Option<&str>) -> Command {
    let program = [env!("CARGO_BIN_EXE_didim")];
    let mut words = starter.iter().chain(&program);
    let mut command = Command::new(words.next().unwrap());
    command.args(words).args(["run", "--cell"]).arg(cell.cell()).arg("--state").arg(cell.state());
    command.arg("--runtime").arg(cell.runtime()).stdin(Stdio::null());
    if let Some(part) = part {
        command.args(["--part", part]);
    }
    command
}

/// A running `didim run`.
pub(crate) struct Daemon {
    process: Process,
    socket: PathBuf,
    log: PathBuf,
}

impl Daemon {
    /// Starts the daemon, or a part of it, and waits until it tells its status.
    pub(crate) fn start(installation: &Installation, part: Option<&str>) -> Self {
        Self::start_below(&[], installation, part)
    }

    /// The same by another program, which becomes the daemon.
    pub(crate) fn start_below(
        starter: &[&str],
        installation: &Installation,
        part: Option<&str>,
    ) -> Self {
        let log = installation.path(&format!("{}.log", part.unwrap_or("both")));
        let file = fs::File::create(&log).unwrap();
        let mut command = run_below(starter, installation, part);
        let socket = match part {
            Some("acquisition") => "acquisition.sock",
            _ => "status.sock",
        };
        let process = command.stderr(file).spawn().map(Process).unwrap();
        let daemon = Self { process, socket: installation.runtime().join(socket), log };
        daemon.eventually("the daemon answers", |_| true);
        daemon
    }

    /// What the daemon itself, or this part of it, tells.
    pub(crate) fn status(&self) -> Option<Snapshot> {
        fetch_status(&self.socket).ok()
    }

    /// Waits until the status is so.
    ///
    /// # Panics
    /// When it is not so within a minute; with the last status and the log.
    pub(crate) fn eventually(&self, what: &str, condition: impl Fn(&Snapshot) -> bool) -> Snapshot {
        let start = Instant::now();
        loop {
            let status = self.status();
            if let Some(status) = status.as_ref().filter(|status| condition(status)) {
                return status.clone();
            }
            let waited = start.elapsed();
            assert!(waited.as_secs() < 120, "not {what}: {status:#?}, log:\n{}", self.log());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// What it logged.
    pub(crate) fn log(&self) -> String {
        fs::read_to_string(&self.log).unwrap()
    }

    /// Asks it to end; its exit code, and how long it took.
    pub(crate) fn terminate(&mut self) -> (Option<i32>, Duration) {
        let start = Instant::now();
        self.signal(Signal::TERM);
        let status = self.process.0.wait().unwrap();
        (status.code(), start.elapsed())
    }

    /// Ends it at once, as a crash would.
    pub(crate) fn kill(mut self) {
        self.signal(Signal::KILL);
        self.process.0.wait().unwrap();
    }

    fn signal(&self, signal: Signal) {
        let pid = i32::try_from(self.process.0.id()).ok().and_then(Pid::from_raw).unwrap();
        kill_process(pid, signal).unwrap();
    }
}
