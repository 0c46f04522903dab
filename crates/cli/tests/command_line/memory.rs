//! Commands that read a history take no more memory for a longer one.

use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use super::support::{Folder, cia402_cell, data, didim};

/// Results of a day.
const RESULTS_A_DAY: u64 = 2_500;
/// Peak of a long history over that of 1,000 results \[1\]: these are in memory as they are, and of
/// a longer history so are the results of the day that is being replaced by a row.
const LARGEST_RATIO: f64 = 1.5;

/// Writes a history of copies of a real line, with a baseline, into a new folder.
fn write_history(folder: &Folder, line: &serde_json::Value, results: u64) -> String {
    let state = folder.path(&results.to_string());
    std::fs::create_dir(&state).unwrap();
    let file = std::fs::File::create(Path::new(&state).join("history.jsonl")).unwrap();
    let mut file = BufWriter::new(file);
    let mut line = line.clone();
    let days = results / RESULTS_A_DAY + 1;
    for result in 0..results {
        let (day, second) = (result / RESULTS_A_DAY, result % RESULTS_A_DAY);
        let (month, of_month) = (1 + day / 28, 1 + day % 28);
        let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
        line["result"] = result.into();
        line["time"] =
            format!("2026-{month:02}-{of_month:02}T{hour:02}:{minute:02}:{second:02}Z").into();
        writeln!(file, "{line}").unwrap();
    }
    assert!(days < 12 * 28);
    file.flush().unwrap();
    didim(&["baseline", "set", "--state", &state, "0"]).done();
    state
}

/// Runs the program, which ends with this code, and returns the peak of its resident memory \[kB\].
fn peak_kb(arguments: &[&str], code: i32) -> f64 {
    let mut child = Command::new(env!("CARGO_BIN_EXE_didim"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let status_file = format!("/proc/{}/status", child.id());
    let mut peak = 0.0;
    let ended = loop {
        let status = std::fs::read_to_string(&status_file).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        if let Some(kb) = line.and_then(|line| line.trim().strip_suffix(" kB")) {
            peak = f64::max(peak, kb.parse().unwrap());
        }
        if let Some(ended) = child.try_wait().unwrap() {
            break ended;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    assert!(ended.code() == Some(code) && peak > 0.0, "{arguments:?}: {ended}");
    peak
}

/// Compares the peaks of each command on a short history and on a long one.
fn compare_peaks(results: u64) {
    let folder = Folder::new();
    let first = folder.path("first");
    let log = &data().cia402_log;
    didim(&["replay", "--cell", &cia402_cell(), log, "--state", &first]).done();
    let line = std::fs::read_to_string(Path::new(&first).join("history.jsonl")).unwrap();
    let line: serde_json::Value = serde_json::from_str(line.lines().next().unwrap()).unwrap();
    let states = [1_000, results].map(|results| write_history(&folder, &line, results));
    let [out, html] = ["csv", "html"].map(|kind| folder.path(&format!("out.{kind}")));
    let commands: [&[&str]; 4] = [
        &["history", "--parameter", "fc3"],
        &["history", "--json"],
        &["history", "--last", "10", "--out", &out, "--report", &html],
        &["baseline", "set"],
    ];
    let mut failures = Vec::new();
    let mut check = |name: String, [short, long]: [f64; 2]| {
        println!("{name}: {short} kB, {long} kB for {results} results");
        if long > LARGEST_RATIO * short {
            failures.push(name);
        }
    };
    for command in commands {
        let of_state = |state: &String| peak_kb(&[command, &["--state", state]].concat(), 0);
        check(command.join(" "), states.each_ref().map(of_state));
    }
    for format in ["csv", "parquet"] {
        let files = states.each_ref().map(|state| {
            let out = format!("{state}.{format}");
            let written = peak_kb(&["history", "--state", state, "--out", &out], 0);
            (out, written)
        });
        check(format!("history --out {format}"), files.each_ref().map(|(_, written)| *written));
        let read = files.each_ref().map(|(file, _)| {
            // One arm is no fleet, which is known after its file was read.
            peak_kb(&["fleet", file], 1)
        });
        check(format!("fleet {format}"), read);
    }
    assert!(failures.is_empty(), "{failures:?}");
}

#[test]
fn a_history_of_many_results_takes_the_memory_of_a_short_one() {
    compare_peaks(8_000);
}

/// By hand: `--ignored`, with 400 MB of disk.
#[test]
#[ignore = "by hand"]
fn a_history_of_a_hundred_thousand_results_takes_the_memory_of_a_short_one() {
    compare_peaks(100_000);
}
