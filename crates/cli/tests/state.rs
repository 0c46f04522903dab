//! The history of an arm that is identified from recordings.

use std::fs::{self, File};
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use serde_json::Value;
use tempfile::TempDir;

use crate::program::{didim, json, repository, succeed};

/// Files of a recording each, with the second in which they were written (UTC, 2024-03-01 and -02).
const WRITTEN: [(&str, u64); 2] = [("a.csv", 1_709_294_400), ("b.csv", 1_709_380_800)];

fn recordings() -> TempDir {
    let folder = TempDir::new().unwrap();
    for (file, written) in WRITTEN {
        let path = folder.path().join(file);
        fs::copy(repository("tests/data/kr300").join(file), &path).unwrap();
        let opened = File::options().append(true).open(path).unwrap();
        opened.set_modified(UNIX_EPOCH + Duration::from_secs(written)).unwrap();
    }
    folder
}

fn identify(recording: &Path, from_to: [&str; 2], option: &str, place: &Path) -> String {
    let cell = repository("tests/data/kr300/cell.toml");
    let [from, to] = from_to;
    let range: [&dyn AsRef<std::ffi::OsStr>; 4] = [&"--from", &from, &"--to", &to];
    let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
        vec![&"identify", &"--cell", &cell, &"--input", &recording, &option, &place];
    arguments.extend(range);
    succeed(&arguments)
}

fn history(arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> Value {
    let mut all: Vec<&dyn AsRef<std::ffi::OsStr>> = vec![&"history", &"--json"];
    all.extend_from_slice(arguments);
    json(&succeed(&all))
}

#[test]
fn recordings_have_a_history_a_baseline_and_drift_without_a_bus() {
    let folder = recordings();
    let [a, b, state] = ["a.csv", "b.csv", "results"].map(|name| folder.path().join(name));
    let first = identify(&a, ["1.8", "8.2"], "--state", &state);
    assert!(first.contains("stored as result 0 of 2024-03-01T12:00:00Z"), "{first}");
    assert!(first.contains("the file was written 2024-03-01 12:00 UTC"), "{first}");
    let again = identify(&a, ["1.8", "8.2"], "--state", &state);
    assert!(again.contains("already stored as result 0"), "{again}");
    succeed(&[&"baseline", &"set", &"--state", &state]);
    identify(&b, ["0.5", "8.5"], "--state", &state);

    let document = history(&[&"--state", &state]);
    let results = document["results"].as_array().unwrap();
    assert_eq!(results.len(), 2, "one each");
    assert_eq!(document["baseline"]["result"]["result"], 0);
    assert_eq!(results[1]["time"], "2024-03-02T12:00:00Z");
    assert_eq!(results[1]["compared"], true, "{}", results[1]["why_not"]);
    assert_eq!(document["alarms"].as_array().unwrap().len(), 0, "it is the same arm");
    // The model's errors are counted, as for results of a service.
    let deviations = results[1]["against"]["standard_deviations"].as_array().unwrap();
    assert_eq!(deviations.len(), results[1]["parameters"].as_array().unwrap().len());
    let kept = json(&fs::read_to_string(state.join("result-00000001.json")).unwrap());
    assert_eq!(kept["window"]["counted"], 2000, "7.5 s to 0.5 s at 250 Hz");
}

#[test]
fn two_result_files_are_compared_as_two_results_of_a_history() {
    let folder = recordings();
    let [a, b, state] = ["a.csv", "b.csv", "results"].map(|name| folder.path().join(name));
    let [first, second] = ["first.json", "second.json"].map(|name| folder.path().join(name));
    for (input, range, out) in [(&a, ["1.8", "8.2"], &first), (&b, ["0.5", "8.5"], &second)] {
        identify(input, range, "--out", out);
        identify(input, range, "--state", &state);
    }
    let of_files = history(&[&"--compare", &first, &second]);
    let of_numbers = history(&[&"--state", &state, &"--compare", &"0", &"1"]);
    let parameters = of_files["difference"]["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), 58);
    for (file, number) in
        parameters.iter().zip(of_numbers["difference"]["parameters"].as_array().unwrap())
    {
        assert_eq!(file["parameter"], number["parameter"]);
        let [one, other] =
            [file, number].map(|of| of["difference"].as_f64().unwrap());
        assert!((one - other).abs() <= 1e-12 * one.abs(), "{file} {number}");
    }
    let table = succeed(&[&"history", &"--compare", &first, &second]);
    assert!(table.contains(&format!("result 2: {}", second.display())), "{table}");
    let refused = didim(&[&"history", &"--compare", &first, &"nothere.json"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("nothere.json: ") && refused.stderr.contains("check its name"));
}
