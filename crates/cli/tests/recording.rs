//! The real recording of a TX40 through the program: from CSV, and from frames.

use std::fs;
use std::path::{Path, PathBuf};

use crate::program::recording::{EXPECTED, datasets, rounding, write_csv};
use crate::program::{Installation, json, parameters, results, succeed};
use serde_json::Value;

const CELL: &str = "tx40-recording";
const DEAD_BAND: &str = "sign = { model = \"dead-band\", threshold_rad_s = 0.01 }";
const TANH: &str = "sign = { model = \"tanh\", width_rad_s = 0.05 }";

/// What is known of the recording under one sign model, to the digits given.
struct Figures {
    condition_number: f64,
    relative_error_percent: f64,
    per_joint_percent: [f64; 6],
    durbin_watson: [f64; 6],
}

fn close(actual: &Value, expected: f64, tolerance: f64, what: &str) {
    let actual = actual.as_f64().unwrap();
    assert!((actual - expected).abs() <= tolerance, "{what}: {actual} instead of {expected}");
}

/// `didim identify` on the CSV file and the log of a cell.
fn identify(cell: &Path, input: &Path) -> Value {
    let csv = input.extension().is_some_and(|extension| extension == "csv");
    let rate: &[&dyn AsRef<std::ffi::OsStr>] = if csv { &[&"--sample-rate", &"5000"] } else { &[] };
    let arguments: &[&dyn AsRef<std::ffi::OsStr>] =
        &[&"identify", &"--json", &"--cell", &cell, &"--input", &input];
    json(&succeed(&[arguments, rate].concat()))
}

fn check(estimate: &Value, value: impl Fn(usize) -> f64, figures: &Figures) {
    assert_eq!((&estimate["samples"], &estimate["rows"]), (&45_000.into(), &2232.into()));
    let estimated = parameters(estimate);
    assert_eq!(estimated.len(), EXPECTED.len());
    for (index, (name, found)) in estimated.iter().enumerate() {
        assert_eq!(name, EXPECTED[index].0);
        let expected = value(index);
        assert!((found / expected - 1.0).abs() <= 1e-4, "{name}: {found} instead of {expected}");
    }
    // Half a unit of the last digit known, in percent where the figure is.
    close(&estimate["condition_number"], figures.condition_number, 0.051, "condition number");
    let error = figures.relative_error_percent;
    close(&estimate["relative_error"], error / 100.0, 5.1e-7, "relative error");
    for joint in 0..6 {
        let error = figures.per_joint_percent[joint] / 100.0;
        close(&estimate["relative_error_per_joint"][joint], error, 5.1e-5, "error of a joint");
        let durbin_watson = figures.durbin_watson[joint];
        close(&estimate["durbin_watson_per_joint"][joint], durbin_watson, 5.1e-3, "Durbin–Watson");
    }
    // Good for watching the arm and for its torque; Coulomb friction depends on the sign model by 5
    // %.
    let verdict = &estimate["verdict"];
    assert_eq!(verdict["applicable"], true, "{verdict}");
    let error = verdict["uses"]["prediction"]["figure"].as_f64().unwrap();
    assert!((0.03..0.06).contains(&error), "{error}");
    assert_eq!(verdict["uses"]["physical-values"]["applicable"], false, "{verdict}");
}

#[test]
#[ignore = "needs the recording in DIDIM_DATASETS: tests/run"]
fn from_csv_with_a_dead_band_as_the_independent_implementation() {
    let datasets = datasets();
    let cell = Installation::from_cell(CELL, &[(DEAD_BAND, DEAD_BAND)]);
    write_csv(&datasets, &cell.path("tx40.csv"));
    let figures = Figures {
        condition_number: 234.6,
        relative_error_percent: 5.5800,
        per_joint_percent: [4.83, 4.86, 8.35, 8.25, 11.21, 9.56],
        durbin_watson: [0.78, 0.84, 0.69, 0.87, 0.76, 0.74],
    };
    check(&identify(&cell.cell(), &cell.path("tx40.csv")), |index| EXPECTED[index].1, &figures);
}

#[test]
#[ignore = "needs the recording in DIDIM_DATASETS: tests/run"]
fn from_csv_with_tanh_as_the_independent_implementation() {
    let datasets = datasets();
    let cell = Installation::from_cell(CELL, &[(DEAD_BAND, TANH)]);
    write_csv(&datasets, &cell.path("tx40.csv"));
    let figures = Figures {
        condition_number: 236.6,
        relative_error_percent: 5.3488,
        per_joint_percent: [4.58, 4.63, 7.90, 8.34, 11.25, 9.26],
        durbin_watson: [0.76, 0.79, 0.59, 0.90, 0.78, 0.72],
    };
    check(&identify(&cell.cell(), &cell.path("tx40.csv")), |index| EXPECTED[index].3, &figures);
}

/// The recording as a candump log of the cell's bus.
fn log(cell: &Installation, datasets: &Path) -> PathBuf {
    let (csv, log) = (cell.path("tx40.csv"), cell.path("tx40.log"));
    write_csv(datasets, &csv);
    let rate = [&"--sample-rate" as &dyn AsRef<_>, &"5000"];
    succeed(&[&"convert", &"--cell", &cell.cell(), &csv, &log, rate[0], rate[1]]);
    log
}

/// The one result file of a replay.
fn replay(cell: &Installation, log: &Path, state: &str) -> String {
    let state = cell.path(state);
    succeed(&[&"replay", &"--cell", &cell.cell(), &log, &"--state", &state]);
    let mut results = results(&state);
    assert_eq!(results.len(), 1, "the whole recording is one window");
    results.remove(0)
}

/// Deviations in standard deviations, the largest of them.
fn largest_deviation(estimate: &Value) -> f64 {
    let deviations = parameters(estimate).into_iter().zip(EXPECTED);
    deviations
        .map(|((_, found), (_, value, sigma, ..))| ((found - value) / sigma).abs())
        .fold(0.0, f64::max)
}

#[test]
#[ignore = "needs the recording in DIDIM_DATASETS: tests/run"]
fn through_frames_the_values_move_by_no_more_than_the_rounding_to_counts() {
    let datasets = datasets();
    let cell = Installation::from_cell(CELL, &[]);
    let log = log(&cell, &datasets);
    let offline = identify(&cell.cell(), &log);
    let replayed = json(&replay(&cell, &log, "replayed"));
    let rms: Vec<f64> = offline["rms_error_per_joint_nm"]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect();
    let bound = rounding(&rms);
    for estimate in [&offline, &replayed["estimate"]] {
        let deviation = largest_deviation(estimate);
        println!("largest deviation {deviation:.1e} σ, bound {bound:.1e} σ");
        assert!(deviation <= bound, "{deviation} σ, bound {bound} σ");
    }
    // The window is the whole log, so that both filter the same samples.
    assert_eq!(parameters(&offline), parameters(&replayed["estimate"]));
    assert_eq!(replayed["window"]["counted"], 37_101);
}

#[test]
#[ignore = "needs the recording in DIDIM_DATASETS: tests/run"]
fn the_same_frames_give_the_same_bytes_whatever_the_digits_of_their_stamps() {
    let datasets = datasets();
    let cell = Installation::from_cell(CELL, &[]);
    let log = log(&cell, &datasets);
    let first = replay(&cell, &log, "first");
    assert_eq!(first, replay(&cell, &log, "second"));
    // Stamps as the kernel gives them, to the nanosecond, and the same as candump writes them
    // without -N: (0000000000.000200417) and (0000000000.000200).
    let text = fs::read_to_string(&log).unwrap();
    fn log_with(
        name: &str,
        digits: &dyn Fn(usize) -> String,
        cell: &Installation,
        text: &str,
    ) -> String {
        fs::write(
            cell.path(name),
            text.lines()
                .enumerate()
                .map(|(k, line): (usize, &str)| {
                    let (stamp, rest) = line.split_once(')').unwrap();
                    format!("{}{}){rest}\n", &stamp[..stamp.len() - 3], digits(k))
                })
                .collect::<String>(),
        )
        .unwrap();
        replay(cell, &cell.path(name), &format!("of-{name}"))
    }
    assert_eq!(
        first,
        log_with("nanoseconds.log", &|k| format!("{:03}", k * 417 % 1000), &cell, &text)
    );
    assert_eq!(first, log_with("microseconds.log", &|_| String::new(), &cell, &text));
}

/// Every method on the recording: they say the same, but for CLOE, which does not converge along a
/// reference and under a controller that are not the cabinet's.
#[test]
#[ignore = "needs the recording in DIDIM_DATASETS: tests/run"]
fn the_methods_agree_and_predict_what_they_have_not_seen() {
    let datasets = datasets();
    let cell = Installation::from_cell(CELL, &[]);
    write_csv(&datasets, &cell.path("recording.csv"));
    let (file, input) = (cell.cell(), cell.path("recording.csv"));
    let arguments: &[&dyn AsRef<std::ffi::OsStr>] = &[
        &"compare",
        &"--json",
        &"--cell",
        &file,
        &"--input",
        &input,
        &"--sample-rate",
        &"5000",
        &"--methods",
        &"idim-iv,didim,clie",
        &"--folds",
        &"5",
    ];
    let comparison = json(&succeed(arguments));
    assert_eq!(comparison["methods"].as_array().unwrap().len(), 4);
    for pair in comparison["agreement"].as_array().unwrap() {
        let inside = pair["inside"].as_u64().unwrap();
        println!("{} in {}: {inside} of 28", pair["estimates"], pair["intervals"]);
        assert_eq!(inside, 28, "{pair}");
    }
    let held_out = comparison["held_out"].as_array().unwrap();
    assert_eq!(held_out.len(), 4);
    for of in held_out {
        let error = |which: &str| of[which]["relative_error"].as_f64().unwrap();
        let (seen, unseen) = (error("in_sample"), error("held_out"));
        println!("{}: {seen:.4} in sample, {unseen:.4} held out", of["method"]);
        // 28 parameters of some 430 independent rows make 1.08 of it, the model's errors the rest.
        assert!(seen < unseen && unseen < 1.2 * seen && seen < 0.06, "{of}");
        assert!(
            (unseen / held_out[0]["held_out"]["relative_error"].as_f64().unwrap() - 1.0).abs()
                < 0.02
        );
    }
}
