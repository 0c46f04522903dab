//! Other readings of a recording: named where they are true, and not on recordings that are right.

use std::fmt::Write as _;
use std::fs;

use crate::new::{RAD, folder, motion_of};
use crate::program::{identify_arm, json, repository, succeed};
use crate::settings::{self, two_link_cell};
use didim_dynamics::dynamics::Model;
use didim_dynamics::robot::Robot;
use serde_json::Value;

/// Codes of other readings of the signals and of the arm.
const READINGS: [&str; 9] = [
    "gravity-direction",
    "gravity-removed",
    "late-signal",
    "low-passed",
    "opposite-signal",
    "position-scale",
    "swapped-motors",
    "torque-gain",
    "wrong-signs-of-joint",
];

/// The findings that name another reading.
fn readings(result: &Value) -> Vec<Value> {
    let findings = result["verdict"]["findings"].as_array().unwrap().iter();
    let is_reading = |of: &&Value| READINGS.iter().any(|code| of["code"] == *code);
    findings.filter(is_reading).cloned().collect()
}

fn assert_silent(result: &str, what: &str) {
    let found = readings(&json(result));
    assert!(found.is_empty(), "{what}: {found:#?}");
}

fn identify_tiago(joints: &str, [from_s, to_s]: [&str; 2]) -> String {
    let [cell, input] =
        ["cell.toml", "motion.csv"].map(|file| repository("tests/data/tiago").join(file));
    succeed(&[
        &"identify",
        &"--json",
        &"--cell",
        &cell,
        &"--input",
        &input,
        &"--joints",
        &joints,
        &"--from",
        &from_s,
        &"--to",
        &to_s,
    ])
}

#[test]
fn right_recordings_of_a_kr300_are_read_as_they_are() {
    for motions in ["a", "b", "c", "ab", "ac", "bc"] {
        let files: Vec<String> = motions.chars().map(|of| format!("{of}.csv")).collect();
        assert_silent(&identify_arm("kr300", &files, "1.8", "8.196"), motions);
    }
}

/// The torque of motor 2 comes 15 samples of 4 ms late. What a smaller lag of other motors explains
/// at their joints is no rival.
#[test]
fn a_late_torque_of_a_kr300_is_named_with_its_delay() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["a.csv", "b.csv"].map(|name| {
        let text = fs::read_to_string(repository("tests/data/kr300").join(name)).unwrap();
        let mut rows: Vec<Vec<String>> =
            text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
        let column = rows[0].iter().position(|of| of == "motor_torque_nm_2").unwrap();
        for row in (1 + 15..rows.len()).rev() {
            rows[row][column] = rows[row - 15][column].clone();
        }
        let path = folder.path().join(name);
        let lines = rows.iter().map(|row| row.join(",") + "\n");
        fs::write(&path, lines.collect::<String>()).unwrap();
        path.display().to_string()
    });
    let found = readings(&json(&identify_arm("kr300", &files, "1.8", "8.196")));
    let [found] = &found[..] else { panic!("{found:#?}") };
    assert_eq!((&found["code"], &found["subject"]["motors"]), (&"late-signal".into(), &[2].into()));
    // The right recording has a lag of its own, which is too small to be named.
    let delay_s = found["figure"].as_f64().unwrap();
    assert!((0.06..0.08).contains(&delay_s), "{found}");
}

/// The rows of the joints whose torques were measured, over the whole motion and parts of it.
#[test]
fn right_rows_of_a_tiago_are_read_as_they_are() {
    for times_s in [["9.2", "67.9"], ["9.2", "45"], ["45", "67.9"], ["20", "60"]] {
        assert_silent(&identify_tiago("2,3,4,5", times_s), times_s[0]);
    }
}

/// The effort of the torso is in an unknown unit: it cannot carry the arm in newtons.
#[test]
fn the_force_of_a_torso_in_another_unit_is_found() {
    let found = readings(&json(&identify_tiago("1,2,3,4,5", ["9.2", "45"])));
    let [found] = &found[..] else { panic!("{found:#?}") };
    assert_eq!((&found["code"], &found["subject"]["motors"]), (&"torque-gain".into(), &[1].into()));
    assert!(found["figure"].as_f64().unwrap() > 4.0, "{found}");
}

#[cfg(feature = "sqlite")]
#[test]
fn a_right_recording_of_a_ur10_is_read_as_it_is() {
    let folder = crate::sqlite_bag::bag();
    let [cell, input] = ["cell.toml", "motion.db3"].map(|file| folder.path().join(file));
    let parts: [&[&str]; 3] = [&[], &["--to", "13.752"], &["--from", "13.76"]];
    for part in parts {
        let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
            vec![&"identify", &"--json", &"--cell", &cell, &"--input", &input];
        part.iter().for_each(|argument| arguments.push(argument));
        assert_silent(&succeed(&arguments), &part.join(" "));
    }
}

/// A controller that subtracts gravity from the torques that it reports: what the finding says is
/// written into the cell, and the data fit.
#[test]
fn torques_without_gravity_are_named_with_the_key_that_declares_them() {
    let folder = folder(["t", "q1", "q2", "f1", "f2"], RAD);
    let [cell, log, arm] = ["cell.toml", "log.csv", "arm.urdf"].map(|of| folder.path().join(of));
    let robot = Robot::from_toml(&succeed(&[&"robot", &arm, &"--toml"])).unwrap();
    let mut table = "t,q1,q2,f1,f2\n".to_owned();
    for row in motion_of(&robot, &Model::new(&robot).with_gravity([0.0; 3])) {
        writeln!(table, "{}", row.map(|value| format!("{value:.7}")).join(",")).unwrap();
    }
    fs::write(&log, table).unwrap();
    let identify = |excludes: &str| -> Value {
        fs::write(&cell, two_link_cell("", excludes)).unwrap();
        settings::identify(&cell, &log)
    };
    let wrong = identify("");
    let found = readings(&wrong);
    let [found] = &found[..] else { panic!("{found:#?}") };
    assert_eq!(found["code"], "gravity-removed");
    assert_eq!(
        (&found["set"]["file"], &found["set"]["key"]),
        (&"cell.toml".into(), &"data.excludes".into())
    );
    let right = identify(&format!("excludes = {}\n", found["set"]["value"]));
    assert!(readings(&right).is_empty(), "{right}");
    let error = |of: &Value| of["relative_error"].as_f64().unwrap();
    assert!(error(&right) < 0.01 && error(&wrong) > 0.1, "{} {}", error(&right), error(&wrong));
}
