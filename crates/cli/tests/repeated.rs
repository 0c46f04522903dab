//! More of the same data makes no result worse.

use std::fs;
use std::path::PathBuf;

use crate::program::{identify_arm, json, repository};
use serde_json::Value;
use tempfile::TempDir;

/// Largest rise of a figure when a recording is repeated, relative to it. It may fall: the spectrum
/// of the residuals is estimated more finely.
const RISE: f64 = 0.02;

/// Returns answer and figure of each use.
fn uses(result: &str) -> Vec<(String, Value, Option<f64>)> {
    let result = json(result);
    let of_use = |(name, of): (&String, &Value)| {
        (name.clone(), of["applicable"].clone(), of["figure"].as_f64())
    };
    result["verdict"]["uses"].as_object().unwrap().iter().map(of_use).collect()
}

/// Writes copies of a recording. Each is shorter by a row than the one before it, because equal
/// recordings count once.
fn copies_of(recording: &str, count: usize) -> (TempDir, Vec<PathBuf>) {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(repository("tests/data").join(recording)).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let write = |copy: usize| {
        let file = folder.path().join(format!("{copy}.csv"));
        fs::write(&file, lines[..lines.len() - copy].join("\n")).unwrap();
        file
    };
    let files = (0..count).map(write).collect();
    (folder, files)
}

/// Identifies so many copies of a recording of an arm, between two instants \[s\].
fn identify(arm: &str, recording: &str, count: usize, [from_s, to_s]: [&str; 2]) -> String {
    let (_folder, files) = copies_of(&format!("{arm}/{recording}"), count);
    identify_arm(arm, &files, from_s, to_s)
}

fn assert_equally_good(once: &str, repeated: &str, what: &str) {
    let (once, repeated) = (uses(once), uses(repeated));
    assert_eq!(once.len(), repeated.len());
    for ((name, before, figure), (_, after, of_repeated)) in once.into_iter().zip(repeated) {
        assert_eq!(before, after, "{what}: {name}");
        let (Some(figure), Some(of_repeated)) = (figure, of_repeated) else { continue };
        // This figure counts standard deviations, which fall.
        if name == "rigid-body" {
            continue;
        }
        assert!(of_repeated <= figure * (1.0 + RISE), "{what}: {name} {figure} to {of_repeated}");
    }
}

/// Files that are equal, and a file that has the same recording several times.
#[test]
fn equal_recordings_change_no_figure() {
    let folder = tempfile::tempdir().unwrap();
    for (arm, name, times) in [
        ("kr300", "a.csv", ["1.8", "8.196"]),
        ("kr300", "b.csv", ["1.8", "8.196"]),
        ("kr300", "c.csv", ["1.8", "8.196"]),
        ("tiago", "motion.csv", ["9.2", "45"]),
    ] {
        let recording = repository("tests/data").join(arm).join(name);
        let text = fs::read_to_string(&recording).unwrap();
        let (header, rows) = text.split_once('\n').unwrap();
        let in_one = folder.path().join(name);
        let of_one = |files: &[PathBuf]| uses(&identify_arm(arm, files, times[0], times[1]));
        let once = of_one(std::slice::from_ref(&recording));
        for count in [2, 4, 8] {
            fs::write(&in_one, format!("{header}\n{}", rows.repeat(count))).unwrap();
            assert_eq!(of_one(&vec![recording.clone(); count]), once, "{name}, {count} files");
            // More stamps give the sample rate more digits.
            let in_one = of_one(std::slice::from_ref(&in_one));
            for ((usage, answer, figure), (_, same, other)) in once.iter().zip(&in_one) {
                assert_eq!(answer, same, "{name}, {count} in one file: {usage}");
                let change = figure.unwrap() / other.unwrap() - 1.0;
                assert!(change.abs() < 1e-8, "{name}, {count} in one file: {usage} {change}");
            }
        }
    }
}

#[test]
fn a_repeated_motion_of_a_kr300_is_as_good_as_one() {
    let identified = |count| identify("kr300", "a.csv", count, ["1.8", "8.196"]);
    let once = identified(1);
    for count in [2, 4, 8] {
        assert_equally_good(&once, &identified(count), &format!("{count} times"));
    }
}

#[test]
fn a_repeated_motion_of_a_tiago_is_as_good_as_one() {
    let identified = |count| identify("tiago", "motion.csv", count, ["9.2", "45"]);
    let once = identified(1);
    for count in [2, 4] {
        assert_equally_good(&once, &identified(count), &format!("{count} times"));
    }
}
