//! What the program of November 2026 stored (tests/data/stored) is read by this one: a folder of
//! results with its history and baseline, a recording, and the cells with what they name.

use std::fs;
use std::path::{Path, PathBuf};

use crate::program::{json, repository, results, succeed};
use serde_json::Value;
use tempfile::TempDir;

const CELL: &str = "config/cells/tx40-cia402.toml";

fn stored(path: &str) -> PathBuf {
    repository("tests/data/stored").join(path)
}

/// A copy of the folder of results, to be written to.
fn copied() -> TempDir {
    fn copy(from: &Path, to: &Path) {
        for entry in fs::read_dir(from).unwrap() {
            let path = entry.unwrap().path();
            let target = to.join(path.file_name().unwrap());
            if path.is_dir() {
                fs::create_dir(&target).unwrap();
                copy(&path, &target);
            } else {
                fs::copy(&path, &target).unwrap();
            }
        }
    }
    let folder = tempfile::Builder::new().prefix("didim-").tempdir().unwrap();
    copy(&stored("state"), folder.path());
    folder
}

#[test]
fn the_history_and_its_baseline_are_read() {
    let state = copied();
    let history = json(&succeed(&[&"history", &"--json", &"--state", &state.path()]));
    let results = history["results"].as_array().unwrap();
    assert_eq!(results.len(), 1, "{history}");
    assert_eq!(results[0]["parameters"].as_array().unwrap().len(), 28);
    // It did not say when it was recorded.
    assert_eq!(results[0].get("recorded"), None);
    assert!(succeed(&[&"history", &"--state", &state.path()]).contains("not known"));
    let shown = succeed(&[&"baseline", &"show", &"--state", &state.path()]);
    assert!(shown.contains("zz1r"), "{shown}");
}

/// Next to the old result, which stays as it is; the numbers are the same but for rounding.
#[test]
fn the_recording_gives_its_result_again() {
    let state = copied();
    let before = fs::read(state.path().join("result-00000000.json")).unwrap();
    let (cell, recording) = (stored(CELL), stored("drive.mcap"));
    succeed(&[&"replay", &"--cell", &cell, &"--state", &state.path(), &recording]);
    assert_eq!(fs::read(state.path().join("result-00000000.json")).unwrap(), before);
    let reproduced: Vec<Value> = results(state.path()).iter().map(|text| json(text)).collect();
    assert_eq!(reproduced.len(), 2);
    let parameters = |result: &Value| result["estimate"]["parameters"].as_array().unwrap().clone();
    let (old, new) = (parameters(&reproduced[0]), parameters(&reproduced[1]));
    assert_eq!((old.len(), new.len()), (28, 28));
    for (old, new) in old.iter().zip(&new) {
        assert_eq!(old["name"], new["name"]);
        let number = |of: &Value, key: &str| of[key].as_f64().unwrap();
        let sigma = number(old, "standard_deviation");
        let difference = (number(new, "value") - number(old, "value")).abs() / sigma;
        assert!(difference < 1e-6, "{old} became {new}");
    }
    assert_eq!(reproduced[0]["configuration"], reproduced[1]["configuration"]);
    assert_eq!(reproduced[0]["input_sha256"], reproduced[1]["input_sha256"]);
    let compared = succeed(&[&"history", &"--compare", &"0", &"1", &"--state", &state.path()]);
    assert!(compared.contains("fc3"), "{compared}");
}

/// The report of a stored result has its curves while its recording is kept.
#[test]
fn a_report_is_drawn_from_the_kept_recording() {
    let state = TempDir::new().unwrap();
    let (cell, recording) = (stored(CELL), stored("drive.mcap"));
    succeed(&[&"replay", &"--cell", &cell, &"--state", &state.path(), &recording]);
    let page = state.path().join("page.html");
    let report = || {
        let state = state.path();
        let said =
            succeed(&[&"report", &"0", &"--cell", &cell, &"--state", &state, &"--out", &page]);
        let html = fs::read_to_string(&page).unwrap();
        (said.contains("without curves"), html.matches("<svg class=\"panel\"").count())
    };
    // The steps of the iteration are stored.
    assert_eq!(report(), (true, 1));
    let recordings = state.path().join("recordings/kept");
    fs::create_dir_all(&recordings).unwrap();
    fs::copy(&recording, recordings.join("result-00000000.mcap")).unwrap();
    assert_eq!(report(), (false, 19));
}

#[test]
fn the_cells_are_read() {
    let mut read = 0;
    for entry in fs::read_dir(stored("config/cells")).unwrap() {
        let path = entry.unwrap().path();
        succeed(&[&"check", &"--other-machine", &"--cell", &path]);
        read += 1;
    }
    assert_eq!(read, 5);
}
