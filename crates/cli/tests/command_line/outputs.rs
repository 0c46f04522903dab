//! Files that cannot be written, and files that were there before: exit code 1, nothing changed.

use super::support::{Folder, data, didim, head, packed_cell, shipped};
use crate::common::expectation::Expectation;

/// Every command that writes, with its output at `path`.
fn writers(path: &str) -> [Vec<String>; 4] {
    let data = data();
    let command = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect();
    let cell = packed_cell();
    [
        command(&["sim", "--cell", &cell, "--bus", &format!("log:{path}")]),
        command(&["convert", "--cell", &cell, &data.packed_csv, path]),
        command(&["convert", "--cell", &cell, &data.packed_log, &format!("{path}.csv")]),
        command(&[
            "identify",
            "--cell",
            &cell,
            "--input",
            &data.packed_log,
            "--json",
            "--figure",
            path,
        ]),
    ]
}

#[track_caller]
fn all_refused(path: &str, says: &[&str]) {
    for writer in writers(path) {
        let words: Vec<&str> = writer.iter().map(String::as_str).collect();
        let stderr = didim(&words).refused(1, says);
        assert!(!stderr.contains(".tmp"), "the name of a temporary file helps nobody: {stderr}");
    }
}

/// What is simulated for minutes is not lost for a folder that is not there.
#[test]
fn the_place_is_inspected_before_the_work() {
    let folder = Folder::new();
    // What comes first of the work is refused later.
    let bus = format!("log:{}", folder.path("nowhere/out.log"));
    let sim = ["sim", "--cell", &packed_cell(), "--bus", &bus, "--scenario", "no such scenario"];
    didim(&sim).refused(1, &["nowhere/out.log", "No such file"]);
    let plan = shipped("studies/starts.toml");
    std::fs::create_dir_all(folder.path("study/study.md")).unwrap();
    let study = ["study", "--plan", &plan, "--out", &folder.path("study")];
    didim(&study).refused(1, &["study.md", "not a regular file"]);
}

#[test]
fn a_folder_that_does_not_exist() {
    let folder = Folder::new();
    let path = folder.path("nowhere/out");
    all_refused(&path, &[&path, "No such file or directory", "folder"]);
    assert_eq!(folder.names(), [""; 0]);
}

#[test]
fn a_folder_that_cannot_be_written() {
    // Not even root writes there.
    all_refused("/proc/didim-test", &["/proc/didim-test", "folder"]);
    let folder = Folder::new();
    let file = folder.file("file", "not a folder");
    all_refused(&format!("{file}/out"), &["file/out", "Not a directory"]);
    assert_eq!(std::fs::read_to_string(file).unwrap(), "not a folder");
}

#[test]
fn what_is_no_file_is_not_replaced() {
    let folder = Folder::new();
    let [socket, tables] = [folder.path("socket"), folder.path("socket.csv")];
    let _listeners = [&socket, &tables].map(std::os::unix::net::UnixListener::bind);
    let [what, remedy]: [String; 2] = Expectation::of("link-in-the-way").get("says");
    all_refused(&socket, &["socket", &what, &remedy]);
    let folder_there = folder.path("there");
    std::fs::create_dir(&folder_there).unwrap();
    std::fs::create_dir(folder.path("there.csv")).unwrap();
    all_refused(&folder_there, &["there", &what]);
    assert_eq!(folder.names(), ["socket", "socket.csv", "there", "there.csv"]);
    use std::os::unix::fs::FileTypeExt;
    assert!(std::fs::metadata(socket).unwrap().file_type().is_socket());
}

/// By whatever name: its own, or that of a link.
#[test]
fn what_is_read_is_not_written() {
    let folder = Folder::new();
    let text = head(&data().packed_csv, 100);
    let [table, soft, hard] = ["a.csv", "soft.csv", "hard.csv"].map(|name| folder.path(name));
    std::fs::write(&table, &text).unwrap();
    std::os::unix::fs::symlink(&table, &soft).unwrap();
    std::fs::hard_link(&table, &hard).unwrap();
    let (cell, says) = (packed_cell(), ["is read by this command", "another file"]);
    for output in [&table, &soft, &hard] {
        didim(&["convert", "--cell", &cell, &table, output]).refused(1, &says);
        for option in ["--figure", "--report"] {
            didim(&["identify", "--cell", &cell, "--input", &table, option, output])
                .refused(1, &says);
        }
        didim(&[
            "predict", "--cell", &cell, "--result", &table, "--input", &soft, "--report", output,
        ])
        .refused(1, &says);
        didim(&["replay", "--cell", &cell, &table, "--report", output]).refused(1, &says);
        didim(&["compare", "--cell", &cell, "--input", &table, "--markdown", output])
            .refused(1, &says);
        didim(&["robot", &table, "--picture", output]).refused(1, &says);
    }
    assert_eq!(std::fs::read_to_string(&table).unwrap(), text);
    assert!(std::fs::symlink_metadata(&soft).unwrap().is_symlink());
}

/// As readable as any other file that the user makes: umask(2).
#[test]
fn files_honour_the_umask() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = Folder::new();
    for (mask, mode) in [("022", 0o644), ("077", 0o600), ("002", 0o664)] {
        let picture = folder.path(&format!("{mask}.svg"));
        let line = format!("umask {mask}; exec \"$0\" robot \"$1\" --picture \"$2\"");
        let robot = shipped("robots/tx40.toml");
        let words = ["-c", &line, env!("CARGO_BIN_EXE_didim"), &robot, &picture];
        let ended = std::process::Command::new("sh").args(words).output().unwrap();
        assert!(ended.status.success(), "{ended:?}");
        assert_eq!(std::fs::metadata(&picture).unwrap().permissions().mode() & 0o777, mode);
    }
}

#[test]
fn a_refusal_leaves_the_file_of_before() {
    let folder = Folder::new();
    let old = "of the time before\n";
    let [log, csv, figure] = ["out.log", "out.csv", "out.svg"].map(|name| folder.file(name, old));
    let damaged = folder.file("damaged.log", "(0.0) can0 100##1\nhello\n");
    let cell = packed_cell();
    let identify =
        ["identify", "--cell", &cell, "--input", &damaged, "--json", "--figure", &figure];
    didim(&identify).refused(1, &["damaged.log:2:"]);
    didim(&["convert", "--cell", &cell, &damaged, &csv]).refused(1, &["damaged.log:2:"]);
    didim(&["convert", "--cell", &cell, &damaged, &log]).refused(1, &["damaged.log:2:"]);
    let bus = format!("log:{log}");
    didim(&["sim", "--cell", &cell, "--bus", &bus, "--scenario", "tx41"]).refused(2, &["tx41"]);
    didim(&["sim", "--cell", &cell, "--bus", &bus, "--repeat"]).refused(2, &["--repeat"]);
    for file in [log, csv, figure] {
        assert_eq!(std::fs::read_to_string(file).unwrap(), old);
    }
    assert_eq!(folder.names(), ["damaged.log", "out.csv", "out.log", "out.svg"]);
}

#[test]
fn an_interrupted_simulation_leaves_no_log() {
    let folder = Folder::new();
    // The scenario takes minutes: it ends by the signal only.
    let scenario = include_str!("../../../../sim-fixtures/scenarios/tx40-paper.toml")
        .replace("cycles = 1", "cycles = 1000");
    let scenario = folder.file("long.toml", &scenario);
    let log = folder.path("out.log");
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_didim"))
        .args(["sim", "--cell", &packed_cell(), "--scenario", &scenario])
        .arg(format!("--bus=log:{log}"))
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // Its temporary file shows that it plays.
    while folder.names().len() < 2 {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let pid = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), output.stdout.len()), (Some(130), 0), "{stderr}");
    assert!(stderr.contains("interrupted") && stderr.contains("out.log"), "{stderr}");
    assert_eq!(folder.names(), ["long.toml"]);
}

#[test]
fn inputs_that_do_not_exist() {
    let folder = Folder::new();
    let cell = packed_cell();
    let output = folder.path("out.csv");
    for name in ["nowhere.log", "nowhere.csv"] {
        let input = folder.path(name);
        let says = [input.as_str(), "No such file", "check the path"];
        didim(&["identify", "--cell", &cell, "--input", &input, "--json"]).refused(1, &says);
        didim(&["convert", "--cell", &cell, &input, &output]).refused(1, &says);
    }
    // A folder is no recording.
    didim(&["identify", "--cell", &cell, "--input", &folder.path("")])
        .refused(1, &["the folder has no recordings"]);
    assert_eq!(folder.names(), [""; 0]);
}
