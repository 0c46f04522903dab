//! A bag in SQLite (tests/data/ur10): the figures of the independent implementation.

use std::fs;
use std::path::Path;

use flate2::read::GzDecoder;
use tempfile::TempDir;

use crate::program::{didim, repository};
#[cfg(feature = "sqlite")]
use crate::program::{json, succeed};

/// Relative difference to the independent figures. Its halves begin and end with other samples.
#[cfg(feature = "sqlite")]
const SAME_RECIPE: f64 = 0.03;

/// The bag and the cell in a folder.
pub(crate) fn bag() -> TempDir {
    let (folder, data) = (tempfile::tempdir().unwrap(), repository("tests/data/ur10"));
    for file in ["cell.toml", "robot.toml"] {
        fs::copy(data.join(file), folder.path().join(file)).unwrap();
    }
    let compressed = fs::File::open(data.join("motion.db3.gz")).unwrap();
    let mut bag = fs::File::create(folder.path().join("motion.db3")).unwrap();
    std::io::copy(&mut GzDecoder::new(compressed), &mut bag).unwrap();
    folder
}

#[cfg(feature = "sqlite")]
fn close(text: &str, expected: f64) {
    let found = json(text)["relative_error"].as_f64().unwrap();
    assert!((found / expected - 1.0).abs() < SAME_RECIPE, "{found} {expected}");
}

#[cfg(feature = "sqlite")]
#[test]
fn a_ur10_in_sqlite_as_the_independent_implementation() {
    let folder = bag();
    let path = |file: &str| folder.path().join(file);
    let (cell, input, result) = (path("cell.toml"), path("motion.db3"), path("half.json"));
    let figures = |command: &[&dyn AsRef<std::ffi::OsStr>]| {
        let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
            vec![&"--json", &"--cell", &cell, &"--input", &input];
        arguments.splice(0..0, command.iter().copied());
        succeed(&arguments)
    };
    let of_bag = figures(&[&"identify"]);
    close(&of_bag, 0.0522);
    assert_eq!(json(&of_bag)["parameters"].as_array().unwrap().len(), 58);
    for (from, other, own, predicted) in [
        (["--to", "13.752"], ["--from", "13.76"], 0.0486, 0.0635),
        (["--from", "13.76"], ["--to", "13.752"], 0.0461, 0.0675),
    ] {
        let half = figures(&[&"identify", &from[0], &from[1]]);
        close(&half, own);
        fs::write(&result, half).unwrap();
        close(&figures(&[&"predict", &"--result", &result, &other[0], &other[1]]), predicted);
    }
    // The folder of a bag, and one with damage.
    let bag = path("bag");
    fs::create_dir(&bag).unwrap();
    fs::copy(&input, bag.join("bag_0.db3")).unwrap();
    let of_folder = succeed(&[&"identify", &"--json", &"--cell", &cell, &"--input", &bag]);
    assert_eq!(json(&of_folder)["parameters"], json(&of_bag)["parameters"]);
    let mut bytes = fs::read(&input).unwrap();
    bytes.truncate(bytes.len() / 2);
    fs::write(&input, bytes).unwrap();
    refused(&cell, &input, "motion.db3: SQLite: ");
}

#[cfg(not(feature = "sqlite"))]
#[test]
fn without_the_feature_a_bag_in_sqlite_is_refused_with_what_to_do() {
    let folder = bag();
    let path = |file: &str| folder.path().join(file);
    refused(&path("cell.toml"), &path("motion.db3"), "cargo build --release --features sqlite");
}

fn refused(cell: &Path, input: &Path, expected: &str) {
    let finished = didim(&[&"identify", &"--cell", &cell, &"--input", &input]);
    assert_eq!(finished.code, Some(1), "{}", finished.stderr);
    assert!(finished.stderr.contains(expected), "{}", finished.stderr);
}
