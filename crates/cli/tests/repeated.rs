//! More of the same data makes no result worse.

use std::fs;

use crate::program::{identify_arm, json, repository};
use serde_json::Value;

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
fn copies(recording: &str, count: usize) -> Vec<String> {
    let name = recording.replace(['/', '.'], "-");
    let folder = repository("target/tests").join(format!("copies-{count}-{name}"));
    fs::create_dir_all(&folder).unwrap();
    let text = fs::read_to_string(repository("tests/data").join(recording)).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let write = |copy: usize| {
        let file = folder.join(format!("{copy}.csv"));
        fs::write(&file, lines[..lines.len() - copy].join("\n")).unwrap();
        file.to_str().unwrap().to_owned()
    };
    (0..count).map(write).collect()
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

#[test]
fn a_repeated_motion_of_a_kr300_is_as_good_as_one() {
    let once = identify_arm("kr300", &copies("kr300/a.csv", 1), "1.8", "8.196");
    for count in [2, 4, 8] {
        let repeated = identify_arm("kr300", &copies("kr300/a.csv", count), "1.8", "8.196");
        assert_equally_good(&once, &repeated, &format!("{count} times"));
    }
}

#[test]
fn a_repeated_motion_of_a_tiago_is_as_good_as_one() {
    let identify =
        |count: usize| identify_arm("tiago", &copies("tiago/motion.csv", count), "9.2", "45");
    let once = identify(1);
    for count in [2, 4] {
        assert_equally_good(&once, &identify(count), &format!("{count} times"));
    }
}
