//! Every number of the results of the shipped cells and of `tests/data`, compared with version
//! 0.1.0.
//!
//! A golden file has the parameters, errors and figures of one run, and a digest of all its numbers
//! in their order. On the instruction set that it names the digest must be equal: not one bit of a
//! result has changed. On another one the listed numbers may differ by 1e-9, relative. Words are
//! not compared.
//!
//! `DIDIM_WRITE_GOLDEN=1` writes the files. A change of them is a change of results: say in the
//! commit which numbers change, and why.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::program::{json, repository, succeed};

/// Largest relative difference between two instruction sets; a promise of `docs/development`.
const OTHER_INSTRUCTIONS: f64 = 1e-9;

/// Lists of an estimate whose numbers are written out.
const LISTED: [&str; 6] = [
    "parameters",
    "relative_error",
    "relative_error_per_joint",
    "rms_error_per_joint_nm",
    "condition_number",
    "uses",
];

fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        return "x86_64 with AVX2";
    }
    std::env::consts::ARCH
}

/// Every number below a value, with its path; run times are not part of a result.
fn numbers(value: &Value, path: &str, numbers_of: &mut Vec<(String, f64)>) {
    match value {
        Value::Object(entries) => {
            // In the order of the golden files, whatever order the output has.
            let entries: BTreeMap<_, _> = entries.iter().collect();
            // The findings repeat figures of the rest; frames are counted for the reader of a log.
            let is_result = |key: &str| !["elapsed_ms", "findings", "unused_frames"].contains(&key);
            for (key, entry) in entries.into_iter().filter(|(key, _)| is_result(key)) {
                numbers(entry, &format!("{path}.{key}"), numbers_of);
            }
        }
        Value::Array(entries) => {
            for (index, entry) in entries.iter().enumerate() {
                numbers(entry, &format!("{path}.{index}"), numbers_of);
            }
        }
        Value::Number(number) => numbers_of.push((path.to_owned(), number.as_f64().unwrap())),
        _ => {}
    }
}

/// Compares the numbers of a run with its golden file.
#[track_caller]
fn compare(name: &str, output: &Value) {
    let mut all_numbers = Vec::new();
    numbers(output, "", &mut all_numbers);
    assert!(all_numbers.len() > 20, "{name}: {}", all_numbers.len());
    let mut digest = Sha256::new();
    let mut text = String::new();
    for (path, number) in &all_numbers {
        digest.update(number.to_bits().to_le_bytes());
        if path.split('.').any(|part| LISTED.contains(&part)) {
            writeln!(text, "{path} {number:?}").unwrap();
        }
    }
    let digest: String = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    let head = format!("{}\n{} {digest}\n", instruction_set(), all_numbers.len());
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name);
    let path = path.with_extension("txt");
    if std::env::var_os("DIDIM_WRITE_GOLDEN").is_some() {
        fs::write(&path, format!("{head}{text}")).unwrap();
    }
    let golden = fs::read_to_string(&path).unwrap();
    let (golden_set, rest) = golden.split_once('\n').unwrap();
    let (golden_digest, golden_numbers) = rest.split_once('\n').unwrap();
    let tolerance = if golden_set == instruction_set() { 0.0 } else { OTHER_INSTRUCTIONS };
    let lines = golden_numbers.lines().zip(text.lines());
    for (expected, line) in lines {
        let (expected_path, expected_number) = expected.rsplit_once(' ').unwrap();
        let (line_path, number) = line.rsplit_once(' ').unwrap();
        assert_eq!(expected_path, line_path, "{name}");
        let (expected, number): (f64, f64) =
            (expected_number.parse().unwrap(), number.parse().unwrap());
        let difference = (number - expected).abs();
        assert!(difference <= tolerance * expected.abs(), "{name} {line}, expected {expected}");
    }
    assert_eq!(golden_numbers.lines().count(), text.lines().count(), "{name}");
    if tolerance == 0.0 {
        assert_eq!(head.lines().nth(1).unwrap(), golden_digest, "{name}: a number changed");
    }
}

fn cell_file(cell: &str) -> PathBuf {
    repository(&format!("config/cells/{cell}.toml"))
}

/// The log of a shipped cell with its simulated arm in a scenario, in a folder of its own.
fn simulated_log(cell: &str, scenario: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("drive.log");
    let shipped = repository(&format!("sim-fixtures/scenarios/{scenario}.toml"));
    let bus = format!("log:{}", log.display());
    succeed(&[&"sim", &"--cell", &cell_file(cell), &"--scenario", &shipped, &"--bus", &bus]);
    (folder, log)
}

fn identify(cell: &Path, input: &Path, options: &[&str]) -> Value {
    let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
        vec![&"identify", &"--json", &"--cell", &cell, &"--input", &input];
    arguments.extend(options.iter().map(|option| option as &dyn AsRef<std::ffi::OsStr>));
    json(&succeed(&arguments))
}

/// Each shipped cell with the scenario of its robot.
const CELLS: [(&str, &str); 8] = [
    ("openarm", "openarm"),
    ("piper", "piper"),
    ("tx40-cia402", "tx40-paper"),
    ("tx40-cia402-eds", "tx40-paper"),
    ("tx40-ethercat", "tx40-paper"),
    ("tx40-packed-fd", "tx40-paper"),
    ("tx40-paper", "tx40-paper-errors"),
    ("tx40-recording", "tx40-paper"),
];

#[test]
fn shipped_cells_give_the_numbers_of_the_last_version() {
    let shipped = fs::read_dir(repository("config/cells")).unwrap().count();
    assert_eq!(shipped, CELLS.len(), "every shipped cell is on the list");
    for (cell, scenario) in CELLS {
        let (_folder, log) = simulated_log(cell, scenario);
        compare(&format!("cell-{cell}"), &identify(&cell_file(cell), &log, &[]));
    }
}

#[test]
fn every_method_gives_the_numbers_of_the_last_version() {
    let (_folder, log) = simulated_log("tx40-paper", "tx40-paper-errors");
    for method in ["idim-ls", "idim-iv", "didim", "clie", "cloe"] {
        let estimate = identify(&cell_file("tx40-paper"), &log, &["--method", method]);
        compare(&format!("method-{method}"), &estimate);
    }
}

/// Recordings of real arms, and what is derived from their results: prediction and payload.
#[test]
fn recordings_of_real_arms_give_the_numbers_of_the_last_version() {
    let folder = tempfile::tempdir().unwrap();
    let kr300 = repository("tests/data/kr300");
    let (cell, between) = (kr300.join("cell.toml"), ["--from", "1.8", "--to", "8.196"]);
    for recording in ["a", "b", "c"] {
        let input = kr300.join(recording).with_extension("csv");
        compare(&format!("kr300-{recording}"), &identify(&cell, &input, &between));
    }
    let (first, second) = (kr300.join("a.csv"), kr300.join("b.csv"));
    let together = [&between[..], &["--input", second.to_str().unwrap()]].concat();
    compare("kr300-a-b", &identify(&cell, &first, &together));
    let didim = [&between[..], &["--method", "didim"]].concat();
    compare("kr300-didim", &identify(&cell, &first, &didim));

    let result = folder.path().join("result.json");
    fs::write(&result, identify(&cell, &first, &between).to_string()).unwrap();
    for command in ["predict", "payload"] {
        let output = succeed(&[
            &command,
            &"--json",
            &"--cell",
            &cell,
            &"--result",
            &result,
            &"--input",
            &second,
        ]);
        compare(&format!("kr300-{command}"), &json(&output));
    }

    let tiago = repository("tests/data/tiago");
    let between = ["--from", "9.2", "--to", "67.89"];
    compare("tiago", &identify(&tiago.join("cell.toml"), &tiago.join("motion.csv"), &between));
}

/// The pipeline of the service gives the numbers of the last version: every result of a replayed
/// log.
#[test]
fn replays_give_the_numbers_of_the_last_version() {
    for (cell, scenario) in [("tx40-packed-fd", "tx40-paper"), ("piper", "piper")] {
        let (folder, log) = simulated_log(cell, scenario);
        let state = folder.path().join("state");
        fs::create_dir(&state).unwrap();
        succeed(&[&"replay", &"--cell", &cell_file(cell), &log, &"--state", &state]);
        let results = crate::program::results(&state);
        assert!(!results.is_empty(), "{cell}");
        for (number, result) in results.iter().enumerate() {
            compare(&format!("replay-{cell}-{number}"), &json(result));
        }
    }
}
