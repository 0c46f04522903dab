//! Torques and parameters that a robot file states, on a real arm: the KR 300, whose counterbalance
//! its makers describe (tests/data/README.md).

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use crate::program::{json, repository, succeed};
use didim_formats::read_csv;
use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use tempfile::TempDir;

/// That of axis 2: F₀ = 1.01 · 296.8 · 328 · 0.159 / 9.6e-4 Pa on π (0.055² − 0.03²)/4 m², and
/// 9.6e-4 m³ of gas.
const COUNTERBALANCE: &str = "known_torque = { counterbalance = { base_radius_m = 0.8, \
     link_radius_m = 0.2, closest_deg = -5.0, pull_n = 27179.0, length_m = 0.6, \
     gas_length_m = 0.5752 } }\n";

/// The torque of that counterbalance on the joint \[N·m\], as the data's authors write it.
fn counterbalance(position_rad: f64) -> f64 {
    let (d, k, area) =
        (0.8_f64, 0.2_f64, std::f64::consts::PI * (0.055 * 0.055 - 0.03 * 0.03) / 4.0);
    let delta = position_rad + 5.0_f64.to_radians();
    let length = (d * d + k * k - 2.0 * d * k * delta.cos()).sqrt();
    let pressure = 1.01 * 296.8 * 328.0 * 0.159 / (9.6e-4 - (length - 0.6) * area);
    -delta.sin() * d * k / length * pressure * area
}

/// A folder with the arm's cell, and a robot file that was changed.
fn cell(robot: impl Fn(String) -> String, identification: &str) -> (TempDir, PathBuf) {
    let arm = repository("tests/data/kr300");
    let folder = tempfile::tempdir().unwrap();
    let read = |file: &str| fs::read_to_string(arm.join(file)).unwrap();
    fs::write(folder.path().join("robot.toml"), robot(read("robot.toml"))).unwrap();
    let config = repository("config");
    let text = read("cell.toml").replace("../../../config", config.to_str().unwrap());
    let text = text.replace("[identification]\n", &format!("[identification]\n{identification}"));
    let file = folder.path().join("cell.toml");
    fs::write(&file, text).unwrap();
    (folder, file)
}

fn with_counterbalance(robot: String) -> String {
    let limits = "position_max_deg = 85.0\n";
    assert_eq!(robot.matches(limits).count(), 1);
    robot.replace(limits, &format!("{limits}{COUNTERBALANCE}"))
}

/// Motions a and b, identified.
fn identify(cell: &Path) -> Value {
    let arm = repository("tests/data/kr300");
    let [a, b] = ["a.csv", "b.csv"].map(|file| arm.join(file));
    let arguments: [&dyn AsRef<OsStr>; 12] = [
        &"identify",
        &"--json",
        &"--cell",
        &cell,
        &"--input",
        &a,
        &"--input",
        &b,
        &"--from",
        &"1.8",
        &"--to",
        &"8.196",
    ];
    json(&succeed(&arguments))
}

/// Motion c, predicted.
fn predict(cell: &Path, found: &Value) -> Value {
    let input = repository("tests/data/kr300/c.csv");
    let result = tempfile::NamedTempFile::new().unwrap();
    fs::write(result.path(), found.to_string()).unwrap();
    let arguments: [&dyn AsRef<OsStr>; 12] = [
        &"predict",
        &"--json",
        &"--cell",
        &cell,
        &"--result",
        &result.path(),
        &"--input",
        &input,
        &"--from",
        &"1.8",
        &"--to",
        &"8.196",
    ];
    json(&succeed(&arguments))
}

fn parameter(found: &Value, name: &str) -> [f64; 2] {
    let parameters = found["parameters"].as_array().unwrap();
    let parameter = parameters.iter().find(|p| p["name"] == name).unwrap();
    ["value", "standard_deviation"].map(|key| parameter[key].as_f64().unwrap())
}

fn error(found: &Value) -> f64 {
    found["relative_error"].as_f64().unwrap()
}

/// Without it the first moments of link 2 stand for link and counterbalance; with it for the link
/// alone. The difference is what sin q₂ and cos q₂ make of its torque along the motion.
#[test]
fn the_counterbalance_of_a_kr300_is_no_part_of_its_first_moments() {
    let (_folder, plain) = cell(|robot| robot, "");
    let (_folder, configured) = cell(with_counterbalance, "");
    let [without, with] = [&plain, &configured].map(|cell| identify(cell));
    assert!(
        (error(&with) - error(&without)).abs() < 0.0005,
        "{} {}",
        error(&with),
        error(&without)
    );

    let mut positions = Vec::new();
    for motion in ["a.csv", "b.csv"] {
        let recorded = read_csv(&repository("tests/data/kr300").join(motion), None).unwrap();
        // Motor 2 turns 1872/7 times as far as its joint.
        let joint_positions = recorded.signals.position_rad[1][450..2050].iter();
        positions.extend(joint_positions.map(|motor| motor * 7.0 / 1872.0));
    }
    let columns = DMatrix::from_fn(positions.len(), 2, |k, column| {
        if column == 0 { positions[k].sin() } else { positions[k].cos() }
    });
    let torque =
        DVector::from_iterator(positions.len(), positions.iter().map(|q| counterbalance(*q)));
    let harmonic = columns.clone().svd(true, true).solve(&torque, 0.0).unwrap();
    assert!((&torque - columns * &harmonic).norm() < 0.005 * torque.norm());
    // Upright at q₂ = 0, x of the link points up: gravity takes −g (mx₂ sin q₂ + my₂ cos q₂).
    for (name, harmonic) in [("mx2r", harmonic[0]), ("my2", harmonic[1])] {
        let [[before, _], [after, _]] = [&without, &with].map(|found| parameter(found, name));
        let change = 9.81 * (before - after).abs();
        assert!(
            (change - harmonic.abs()).abs() < 0.05 * torque.amax(),
            "{name}: {change} {harmonic}"
        );
    }
    let [before, after] =
        [(&plain, &without), (&configured, &with)].map(|(cell, of)| predict(cell, of));
    assert!((error(&before) - error(&after)).abs() < 0.001, "{} {}", error(&before), error(&after));
    // Its size is one of the things that may be otherwise.
    let nuisance_parameters = with["freedoms"].as_array().unwrap();
    assert!(nuisance_parameters.iter().any(|of| of["freedom"] == "known torque on joint 2"));
}

/// Parameters that are kept at what was identified leave the others where they were, and the
/// prediction.
#[test]
fn parameters_that_are_kept_leave_the_others_where_they_were() {
    let (_folder, all) = cell(|robot| robot, "");
    let complete = identify(&all);
    let fixed = ["zz5r", "mx6", "ia6"];
    let values = fixed.map(|name| format!("{name} = {:?}\n", parameter(&complete, name)[0]));
    let names: Vec<&str> = complete["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["name"].as_str().unwrap())
        .collect();
    let others: Vec<&&str> = names.iter().filter(|name| !fixed.contains(name)).collect();
    let identification = format!("keep_nominal = {fixed:?}\nparameters = {others:?}\n");
    let (_folder, keeping) =
        cell(|robot| format!("{robot}\n[nominal]\n{}", values.concat()), &identification);
    let identified = identify(&keeping);
    assert_eq!(identified["kept"].as_array().unwrap().len(), fixed.len());
    for name in others {
        let [[before, sigma], [after, _]] =
            [&complete, &identified].map(|found| parameter(found, name));
        assert!((before - after).abs() < 0.2 * sigma, "{name}: {before} {after} {sigma}");
    }
    let [before, after] =
        [(&all, &complete), (&keeping, &identified)].map(|(cell, of)| error(&predict(cell, of)));
    assert!((before - after).abs() < 1e-3, "{before} {after}");
}
