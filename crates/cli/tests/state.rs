//! The history of an arm that is identified from recordings.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use serde_json::Value;
use tempfile::TempDir;

use crate::program::{didim, json, repository, succeed};

/// Identifies a recording of the KUKA KR 300.
fn identify(recording: &str, option: &str, place: &Path) -> String {
    let data = repository("tests/data/kr300");
    let (cell, input) = (data.join("cell.toml"), data.join(recording));
    let range: [&dyn AsRef<OsStr>; 4] = [&"--from", &"1.8", &"--to", &"8.2"];
    let mut arguments: Vec<&dyn AsRef<OsStr>> =
        vec![&"identify", &"--cell", &cell, &"--input", &input, &option, &place];
    arguments.extend(range);
    succeed(&arguments)
}

fn history(arguments: &[&dyn AsRef<OsStr>]) -> Value {
    let mut all: Vec<&dyn AsRef<OsStr>> = vec![&"history", &"--json"];
    all.extend_from_slice(arguments);
    json(&succeed(&all))
}

#[test]
fn recordings_have_a_history_a_baseline_and_drift_without_a_bus() {
    let (folder, cell) = (TempDir::new().unwrap(), repository("config/cells/tx40-packed-fd.toml"));
    let state = folder.path().join("results");
    // The logs have no date. They were written on 1 and 2 March 2024, UTC.
    let recorded = [("1", 1_709_294_400), ("2", 1_709_380_800)].map(|(seed, written)| {
        let log = folder.path().join(format!("{seed}.log"));
        let bus = format!("log:{}", log.display());
        succeed(&[&"sim", &"--cell", &cell, &"--bus", &bus, &"--fast", &"--seed", &seed]);
        let opened = File::options().append(true).open(&log).unwrap();
        opened.set_modified(UNIX_EPOCH + Duration::from_secs(written)).unwrap();
        log
    });
    let store = |log: &Path| {
        succeed(&[&"identify", &"--cell", &cell, &"--input", &log, &"--state", &state])
    };
    let first = store(&recorded[0]);
    assert!(first.contains("stored as result 0 of 2024-03-01T12:00:00Z"), "{first}");
    assert!(first.contains("the file was written 2024-03-01 12:00 UTC"), "{first}");
    let again = store(&recorded[0]);
    assert!(again.contains("already stored as result 0"), "{again}");
    succeed(&[&"baseline", &"set", &"--state", &state]);
    store(&recorded[1]);

    let document = history(&[&"--state", &state]);
    let results = document["results"].as_array().unwrap();
    assert_eq!(results.len(), 2, "one for each log");
    assert_eq!(document["baseline"]["result"]["result"], 0);
    assert_eq!(results[1]["time"], "2024-03-02T12:00:00Z");
    assert_eq!(results[1]["compared"], true, "{}", results[1]["why_not"]);
    assert_eq!(document["alarms"].as_array().unwrap().len(), 0, "it is the same arm");
    // Model errors count, as for the results of a service.
    let deviations = results[1]["against"]["standard_deviations"].as_array().unwrap();
    assert_eq!(deviations.len(), results[1]["parameters"].as_array().unwrap().len());
    let second = json(&fs::read_to_string(state.join("result-00000001.json")).unwrap());
    let other = json(&fs::read_to_string(state.join("result-00000000.json")).unwrap());
    assert_ne!(second["input_sha256"], other["input_sha256"]);
    assert!(second["window"]["counted"].as_u64().unwrap() > 1000);
    // Flash memory: what is written for a result, with its line before and after it.
    let file = fs::metadata(state.join("result-00000001.json")).unwrap().len();
    let lines = fs::read_to_string(state.join("history.jsonl")).unwrap();
    let written = file + 2 * lines.lines().nth(1).unwrap().len() as u64;
    assert!(written <= 100_000, "{written} bytes are written for a result");
    check_for_the_previous_version(&state, &document);
}

/// Writes the folder for 0.2, which reads results and baselines of schema 1 with the covariance of
/// the model errors, and one file for the history. This version reads the folder as before.
fn check_for_the_previous_version(state: &Path, before: &Value) {
    let read = |name: &str| json(&fs::read_to_string(state.join(name)).unwrap());
    let keys = |of: &Value| of.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    let result = read("result-00000001.json");
    assert_eq!((&result["schema"], &result["estimate"]["schema"]), (&2.into(), &2.into()));
    let said = succeed(&[&"state", &"--for", &"0.2", &"--state", &state]);
    assert!(said.contains("3 files rewritten"), "{said}");
    for name in ["result-00000000.json", "result-00000001.json"] {
        let result = read(name);
        assert_eq!((&result["schema"], &result["estimate"]["schema"]), (&1.into(), &1.into()));
        let uncertainty = &result["estimate"]["model_uncertainty"];
        assert!(keys(uncertainty).contains(&"covariance".to_owned()), "{:?}", keys(uncertainty));
    }
    assert!(keys(&read("baseline.json")["model_uncertainty"]).contains(&"covariance".to_owned()));
    let names = fs::read_dir(state).unwrap().map(|file| file.unwrap().file_name());
    let names: Vec<_> = names.filter(|name| name.to_string_lossy().contains("history")).collect();
    assert_eq!(names, ["history.jsonl"]);
    let after = history(&[&"--state", &state]);
    assert_eq!(after["results"], before["results"]);
    assert_eq!(after["baseline"]["result"], before["baseline"]["result"]);
    let refused = didim(&[&"state", &"--for", &"0.1", &"--state", &state]);
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
}

#[test]
fn two_result_files_are_compared_as_two_results_of_a_history() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let (first, second, state) = (path("first.json"), path("second.json"), path("results"));
    for (recording, out) in [("a.csv", &first), ("b.csv", &second)] {
        identify(recording, "--out", out);
        identify(recording, "--state", &state);
    }
    let of_files = history(&[&"--compare", &first, &second]);
    let of_numbers = history(&[&"--state", &state, &"--compare", &"0", &"1"]);
    let parameters = |of: &Value| of["difference"]["parameters"].as_array().unwrap().clone();
    assert_eq!(parameters(&of_files).len(), 58);
    for (file, number) in parameters(&of_files).iter().zip(parameters(&of_numbers)) {
        assert_eq!(file["parameter"], number["parameter"]);
        let [one, other] = [file, &number].map(|of| of["difference"].as_f64().unwrap());
        assert!((one - other).abs() <= 1e-12 * one.abs(), "{file} {number}");
    }
    let table = succeed(&[&"history", &"--compare", &first, &second]);
    assert!(table.contains(&format!("result 2: {}", second.display())), "{table}");
    let refused = didim(&[&"history", &"--compare", &first, &"nothere.json"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("nothere.json: "), "{}", refused.stderr);
}
