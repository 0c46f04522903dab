//! Recordings of real arms of other makers (tests/data/README.md), held to what an independent
//! implementation of the same recipe, in Python on another model of the arms' dynamics, makes of
//! them.
//!
//! Figures only: the verdicts are no part of the reference.

use core::ops::Range;
use std::ffi::{OsStr, OsString};
use std::path::Path;

use crate::program::{changed, didim, identify_arm, identify_arm_with, json, repository, succeed};
use didim::cell::{Cell, JointReference};
use didim_formats::{Side, read_csv};
use didim_identification::identification::{
    Experiment, Selection, filtered_motion, observation_matrix,
};
use nalgebra::{DMatrix, DVector};
use serde_json::Value;

/// How far figures of the same recipe may be apart, relative to themselves: the digits of the
/// files.
const SAME_RECIPE: f64 = 1e-6;
/// The same of a recording whose digits were reduced: 1e-7 rad and 1e-4 N·m.
const ROUNDED: f64 = 1e-4;

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    let difference = (found / expected - 1.0).abs();
    assert!(
        difference <= tolerance,
        "{what}: {found} instead of {expected}, {difference:.1e} apart"
    );
}

/// `didim identify` on one recording, between two instants \[s\].
fn identify(arm: &str, recording: &str, from_s: &str, to_s: &str) -> Value {
    identify_all(arm, &[recording.to_owned()], from_s, to_s)
}

/// The same on several, together.
fn identify_all(arm: &str, recordings: &[String], from_s: &str, to_s: &str) -> Value {
    json(&identify_arm(arm, recordings, from_s, to_s))
}

/// What the independent implementation makes of one recording.
struct Figures {
    recording: &'static str,
    condition_number: f64,
    unweighted_condition_number: f64,
    relative_error: f64,
    per_joint: [f64; 6],
}

/// The KR 300 between 1.8 s and 8.2 s, where it moves.
const KR300: [Figures; 3] = [
    Figures {
        recording: "a.csv",
        condition_number: 13833.614386645644,
        unweighted_condition_number: 8242.754643668304,
        relative_error: 0.037150413387027466,
        per_joint: [
            0.06488314919857485,
            0.03847767796033876,
            0.01817424183210496,
            0.26773966848849656,
            0.025370748191436483,
            0.18777016266714072,
        ],
    },
    Figures {
        recording: "b.csv",
        condition_number: 18651.694771601615,
        unweighted_condition_number: 10141.181191723053,
        relative_error: 0.0338558254222531,
        per_joint: [
            0.04832411578937478,
            0.03190608078951618,
            0.03334380841819353,
            0.10595023042323541,
            0.022005841007233948,
            0.05836042837874262,
        ],
    },
    Figures {
        recording: "c.csv",
        condition_number: 8569.054645094242,
        unweighted_condition_number: 5235.795884696841,
        relative_error: 0.031146300024082765,
        per_joint: [
            0.04672438070771528,
            0.03140320305861702,
            0.017656206686178892,
            0.3197447080700259,
            0.025400939897812662,
            0.17446646406428584,
        ],
    },
];

#[test]
fn each_motion_of_a_kr300_as_the_independent_implementation() {
    for of in KR300 {
        let estimate = identify("kr300", of.recording, "1.8", "8.196");
        let figure = |name: &str| estimate[name].as_f64().unwrap();
        assert_eq!(estimate["parameters"].as_array().unwrap().len(), 58);
        assert_eq!((&estimate["samples"], &estimate["rows"]), (&2501.into(), &960.into()));
        for (name, expected) in [
            ("condition_number", of.condition_number),
            ("unweighted_condition_number", of.unweighted_condition_number),
            ("relative_error", of.relative_error),
        ] {
            close(figure(name), expected, SAME_RECIPE, &format!("{} {name}", of.recording));
        }
        for (joint, expected) in of.per_joint.into_iter().enumerate() {
            let error = estimate["relative_error_per_joint"][joint].as_f64().unwrap();
            close(error, expected, SAME_RECIPE, &format!("{} joint {joint}", of.recording));
        }
    }
}

/// All eight torques of a TIAGo, of which three are not measured (zero in nine samples of ten) and
/// one has an unknown unit: 73 parameters, and errors that show which joints are no joints of the
/// model.
#[test]
fn a_tiago_with_its_dead_torques_shows_which_they_are() {
    let estimate = identify("tiago", "motion.csv", "9.2", "67.89");
    assert_eq!(estimate["parameters"].as_array().unwrap().len(), 73);
    assert_eq!((&estimate["samples"], &estimate["rows"]), (&8022.into(), &(587 * 8).into()));
    let errors = estimate["relative_error_per_joint"].as_array().unwrap();
    let errors: Vec<f64> = errors.iter().map(|error| error.as_f64().unwrap()).collect();
    // Torso, arm_1 to arm_4, and arm_5 to arm_7, the dead ones.
    assert!(errors[1..5].iter().all(|error| *error < 0.2), "{errors:?}");
    assert!(errors[5..].iter().all(|error| *error > 0.5), "{errors:?}");
}

/// The same without the torques that are not measured: the torso's unit and the dead sensors of the
/// wrist cost the others nothing.
#[test]
fn a_tiago_without_its_dead_torques_as_the_rows_of_the_others() {
    let folder = repository("tests/data/tiago");
    let (cell_file, input) = (folder.join("cell.toml"), folder.join("motion.csv"));
    let counted: [&dyn AsRef<OsStr>; 8] =
        [&"--cell", &cell_file, &"--input", &input, &"--from", &"9.2", &"--to", &"67.89"];
    let run = |joints: &str, more: &[&dyn AsRef<OsStr>]| {
        didim(&[&[&"identify" as _], &counted[..], &[&"--joints", &joints], more].concat())
    };
    let estimate = json(&run("2,3,4,5", &[&"--json"]).stdout);
    let joints: Vec<JointReference> = (2..=5).map(JointReference::Number).collect();
    let cell = Cell::read(&cell_file).unwrap().with_torque_joints(&joints).unwrap();
    let (matrix, torque) = equation(&cell, &input, 920..6790, 1..5);
    let rows = torque.len() / 4;
    let (parameters, [unweighted, weighted]) = solve_weighted(&matrix, &torque, |row| row / rows);
    close(figure(&estimate, "unweighted_condition_number"), unweighted, SAME_RECIPE, "unweighted");
    close(figure(&estimate, "condition_number"), weighted, SAME_RECIPE, "weighted");
    let error = relative_error(&matrix, &torque, &parameters);
    close(figure(&estimate, "relative_error"), error, SAME_RECIPE, "error");
    let found = estimate["parameters"].as_array().unwrap();
    assert_eq!(found.len(), parameters.len());
    for (found, expected) in found.iter().zip(&parameters) {
        let deviation = figure(found, "standard_deviation");
        assert!((figure(found, "value") - expected).abs() < 1e-6 * deviation, "{found}");
    }
    assert_eq!(estimate["rows"].as_u64(), Some(587 * 4));
    for joint in [0, 5, 6, 7] {
        assert!(estimate["relative_error_per_joint"][joint].is_null());
        assert!(estimate["rms_error_per_joint_nm"][joint].is_null());
    }
    // The others are predicted as the joints of a result of all torques are.
    let result = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(result.path(), estimate.to_string()).unwrap();
    let predict: [&dyn AsRef<OsStr>; 6] =
        [&"predict", &"--json", &"--result", &result.path(), &"--joints", &"2,3,4,5"];
    let predicted = json(&succeed(&[&predict[..], &counted].concat()));
    close(figure(&predicted, "relative_error"), error, SAME_RECIPE, "predicted");
    assert!(predicted["rms_error_per_joint_nm"][7].is_null());
    // Its own joints are the default.
    let by_default = json(&succeed(&[&predict[..4], &counted].concat()));
    assert_eq!(by_default["relative_error_per_joint"], predicted["relative_error_per_joint"]);
    let notes = by_default["notes"].to_string();
    assert!(notes.contains("without the torque of joint 1, 6, 7, 8"), "{notes}");
    // What needs every joint says so.
    let refused = run("2,3,4,5", &[&"--method", &"didim"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("no torque is recorded of joint 1, 6, 7, 8"), "{refused:?}");
    let refused = run("2,9", &[]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("--joints: `9` is no joint of the arm"), "{refused:?}");
}

/// A result of all torques predicts each joint as well without the others.
#[test]
fn some_joints_of_a_kr300_are_predicted_as_all_are() {
    let result = stored("ab", |_| ());
    let all = json(&predict_by(&result, "c", &[&"--json"]));
    let some = json(&predict_by(&result, "c", &[&"--json", &"--joints", &"1,2,3"]));
    for joint in 0..6 {
        let [all, some] = [&all, &some].map(|of| &of["relative_error_per_joint"][joint]);
        match joint {
            0..3 => assert_eq!(all, some),
            _ => assert!(all.is_number() && some.is_null()),
        }
    }
}

/// The equation of some joints along one recording: observation matrix and torques, the rows of
/// each joint together.
fn equation(
    cell: &Cell,
    recording: &Path,
    counted: Range<usize>,
    joints: Range<usize>,
) -> (DMatrix<f64>, DVector<f64>) {
    let recording = read_csv(recording, None).unwrap();
    let experiment = match recording.side {
        Side::Motor => Experiment::motor_side(&recording.signals, cell.robot.transmission()),
        Side::Joint => Experiment::joint_side(&recording.signals),
    };
    let experiment = experiment.unwrap().with_counted(counted.clone()).unwrap();
    let decimation = cell.options.decimation_filter.design().unwrap();
    let motion = filtered_motion(&cell.robot, &experiment, &cell.options.position_filter).unwrap();
    let torque = decimation.decimate_columns(experiment.torque_nm(), counted.clone()).unwrap();
    let torque = DVector::from_column_slice(torque.as_slice());
    let selection = Selection::new(&cell.robot, &cell.base, None).unwrap();
    let matrix =
        observation_matrix(&cell.model, &selection, &motion, &decimation, counted).unwrap();
    let rows = torque.len() / cell.robot.joints();
    let (first, count) = (joints.start * rows, joints.len() * rows);
    (matrix.rows(first, count).into_owned(), torque.rows(first, count).into_owned())
}

/// Least squares, and the condition number of the matrix.
fn solve(matrix: &DMatrix<f64>, torque: &DVector<f64>) -> (DVector<f64>, f64) {
    let svd = matrix.clone().svd(true, true);
    let condition_number = svd.singular_values.max() / svd.singular_values.min();
    (svd.solve(torque, 0.0).unwrap(), condition_number)
}

fn relative_error(matrix: &DMatrix<f64>, torque: &DVector<f64>, parameters: &DVector<f64>) -> f64 {
    (torque - matrix * parameters).norm() / torque.norm()
}

/// Weighted least squares, each joint by the noise that least squares leaves on it; with the
/// condition numbers without and with weights.
fn solve_weighted(
    matrix: &DMatrix<f64>,
    torque: &DVector<f64>,
    joint_of_row: impl Fn(usize) -> usize,
) -> (DVector<f64>, [f64; 2]) {
    let (parameters, unweighted) = solve(matrix, torque);
    let residuals = torque - matrix * parameters;
    let mut squares = [(0.0, 0.0); 8];
    for (row, residual) in residuals.iter().enumerate() {
        let (sum, count) = &mut squares[joint_of_row(row)];
        *sum += residual * residual;
        *count += 1.0;
    }
    let weights = DVector::from_fn(torque.len(), |row, _| {
        let (sum, count): (f64, f64) = squares[joint_of_row(row)];
        (count / sum).sqrt()
    });
    let mut weighted = matrix.clone();
    weighted.row_iter_mut().zip(&weights).for_each(|(mut row, weight)| row *= *weight);
    let (parameters, condition_number) = solve(&weighted, &torque.component_mul(&weights));
    (parameters, [unweighted, condition_number])
}

/// One equation of the three motions determines what one motion alone does not.
#[test]
fn three_motions_of_a_kr300_together_as_the_independent_implementation() {
    // What the first motion says of the others is 28 and 46 % wrong, and of itself 3.7 %.
    let expected = [0.037150413387027466, 0.2823167092290713, 0.4598306399376123];
    for (motion, expected) in ["a", "b", "c"].into_iter().zip(expected) {
        let prediction = predict("a", motion);
        close(figure(&prediction, "relative_error"), expected, SAME_RECIPE, motion);
    }
    let result = identify_all("kr300", &motions_of("abc"), "1.8", "8.196");
    close(figure(&result, "unweighted_condition_number"), 1024.5736053596063, SAME_RECIPE, "all");
    close(figure(&result, "condition_number"), 1822.4174320007983, SAME_RECIPE, "weighted");
    let expected = [0.04112012775676659, 0.04359909989802661, 0.03291329826809333];
    let errors = result["relative_error_per_recording"].as_array().unwrap();
    assert_eq!(errors.len(), expected.len());
    for (error, expected) in errors.iter().zip(expected) {
        close(error.as_f64().unwrap(), expected, SAME_RECIPE, "of all three");
    }
}

/// `didim predict` of one motion of the KR 300 with the result of others.
fn predict(identified: &str, motion: &str) -> Value {
    json(&predict_by(&stored(identified, |_| ()), motion, &[&"--json"]))
}

/// A file with the result of these motions of the KR 300, after a change.
fn stored(identified: &str, change: impl FnOnce(&mut Value)) -> tempfile::NamedTempFile {
    let mut result = identify_all("kr300", &motions_of(identified), "1.8", "8.196");
    change(&mut result);
    let stored = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(stored.path(), result.to_string()).unwrap();
    stored
}

fn predict_by(
    stored: &tempfile::NamedTempFile,
    motion: &str,
    further: &[&dyn AsRef<OsStr>],
) -> String {
    let command = predict_command(stored, motion);
    let mut arguments: Vec<&dyn AsRef<OsStr>> = command.iter().map(|of| of as _).collect();
    arguments.extend(further);
    succeed(&arguments)
}

fn predict_command(stored: &tempfile::NamedTempFile, motion: &str) -> Vec<OsString> {
    let folder = repository("tests/data/kr300");
    let (cell, input) = (folder.join("cell.toml"), folder.join(format!("{motion}.csv")));
    let mut command: Vec<OsString> = vec!["predict".into(), "--cell".into(), cell.into()];
    command.extend(["--result".into(), stored.path().into(), "--input".into(), input.into()]);
    command.extend(["--from", "1.8", "--to", "8.196"].map(OsString::from));
    command
}

/// `a.csv` and so on.
fn motions_of(letters: &str) -> Vec<String> {
    letters.chars().map(|letter| format!("{letter}.csv")).collect()
}

fn figure(estimate: &Value, name: &str) -> f64 {
    estimate[name].as_f64().unwrap()
}

/// Folds and margins are times: the cross-validation error, relative to the fit, does not depend on
/// the decimation, and neither does a verdict.
#[test]
fn the_cross_validation_of_real_arms_does_not_depend_on_the_decimation() {
    let bag = crate::sqlite_bag::bag();
    let ur10 = bag.path().join("motion.db3").display().to_string();
    let mut arms = vec![
        ("kr300", motions_of("abc"), ["1.8", "8.2"]),
        ("tiago", vec!["motion.csv".to_owned()], ["9.2", "67.9"]),
    ];
    if cfg!(feature = "sqlite") {
        arms.push(("ur10", vec![ur10], ["0.1", "27.4"]));
    }
    for (arm, recordings, [from_s, to_s]) in arms {
        let recordings = recordings.as_slice();
        let found = [5, 10, 20].map(|factor| {
            let (_place, cell) =
                copied_cell(arm, &[("factor = 10", &format!("factor = {factor}"))]);
            json(&identify_arm_with(&cell, arm, recordings, from_s, to_s))
        });
        let ratios = found.each_ref().map(|of| {
            of["held_out"]["relative_error"].as_f64().unwrap() / figure(of, "relative_error")
        });
        let [least, most] = [f64::min, f64::max].map(|of| ratios.into_iter().reduce(of).unwrap());
        assert!(most / least < 4.0 / 3.0, "{arm}: {ratios:?}");
        for usage in ["monitoring", "prediction", "physical-values"] {
            let answers = found.each_ref().map(|of| &of["verdict"]["uses"][usage]["applicable"]);
            assert!(answers[0].is_boolean(), "{arm}, {usage}");
            assert!(answers.iter().all(|of| *of == answers[0]), "{arm}, {usage}: {answers:?}");
        }
    }
}

/// The uncertainty of a joint's torque is a share of its root mean square torque, or of its floor:
/// that of the torque limit of 10 kN·m.
#[test]
fn the_torque_floor_is_an_option() {
    const LIMIT: f64 = 10_000.0;
    for floor in [0.001, 0.05, 0.3] {
        let line = format!("limits = {{ torque_floor = {floor} }}\n");
        let (_place, cell) = changed_cell(&line);
        let motions = motions_of("ab");
        let result = json(&identify_arm_with(&cell, "kr300", &motions, "1.8", "8.196"));
        let of_joints = |name: &str| -> Vec<f64> {
            result[name].as_array().unwrap().iter().map(|of| of.as_f64().unwrap()).collect()
        };
        let errors = of_joints("relative_error_per_joint");
        let torques = of_joints("rms_error_per_joint_nm").into_iter().zip(errors);
        let torques = torques.map(|(error, relative)| error / relative);
        let shares = of_joints("relative_prediction_deviation_per_joint");
        let figures =
            shares.iter().zip(torques).map(|(share, rms)| share * rms / rms.max(floor * LIMIT));
        let expected = figures.fold(0.0, f64::max);
        let found = figure(&result["verdict"]["uses"]["monitoring"], "figure");
        assert!((found / expected - 1.0).abs() < 1e-9, "{floor}: {found}, not {expected}");
    }
}

/// Two motions predict the third with an error of 3.5 to 5.5 %, and their results expect that
/// error. One motion alone reports that it knows little.
#[test]
fn what_a_result_of_a_kr300_says_of_another_motion_is_predicted() {
    for (identified, motion, expected) in
        [("ab", "c", 0.035), ("ac", "b", 0.048), ("bc", "a", 0.055)]
    {
        let prediction = predict(identified, motion);
        let error = figure(&prediction, "relative_error");
        assert!((error - expected).abs() < 0.002, "{identified} of {motion}: {error}");
        let predicted = figure(&prediction["foretold"], "relative_error");
        assert!((0.5..2.0).contains(&(predicted / error)), "{identified} of {motion}: {predicted}");
        for (joint, quantiles) in
            prediction["quantiles_per_joint"].as_array().unwrap().iter().enumerate()
        {
            let rms = prediction["rms_error_per_joint_nm"][joint].as_f64().unwrap();
            let [of_99, of_9999] = ["99 %", "99.99 %"].map(|share| figure(quantiles, share));
            assert!(rms < of_99 && of_99 < of_9999, "{identified} of {motion}: {quantiles}");
        }
    }
    for (identified, motion) in
        [("a", "b"), ("a", "c"), ("b", "a"), ("b", "c"), ("c", "a"), ("c", "b")]
    {
        let prediction = predict(identified, motion);
        let ratio = figure(&prediction["foretold"], "relative_error")
            / figure(&prediction, "relative_error");
        assert!((0.5..3.0).contains(&ratio), "{identified} of {motion}: {ratio}");
    }
}

/// A file that is no result is named by its kind.
#[test]
fn a_table_in_place_of_a_result_is_named() {
    let table = tempfile::NamedTempFile::new().unwrap();
    std::fs::copy(repository("tests/data/kr300/a.csv"), table.path()).unwrap();
    let refused = didim(&predict_command(&table, "a").iter().map(|of| of as _).collect::<Vec<_>>());
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("a table of signals, not a result"), "{refused:?}");
}

/// A result that earlier versions stored predicts all the same; what it does not say is not made
/// up.
#[test]
fn a_result_without_its_covariance_predicts_and_predicts_nothing() {
    let report = tempfile::NamedTempFile::new().unwrap();
    let earlier = stored("ab", |found| {
        for kept_back in ["model_uncertainty", "covariance"] {
            found.as_object_mut().unwrap().remove(kept_back).unwrap();
        }
        // What is published to other processes, which has 65,536 bytes.
        assert!(found.to_string().len() < 40_000, "{}", found.to_string().len());
    });
    let text = predict_by(&earlier, "c", &[&"--report", &report.path()]);
    assert!(text.contains("does not state the expected error"), "{text}");
    assert!(
        text.lines().any(|line| line.starts_with("joint 6 ") && line.contains(" – ")),
        "{text}"
    );
    let report = std::fs::read_to_string(report.path()).unwrap();
    assert!(report.contains("Prediction by a stored result") && report.contains("c.csv"));
    assert_eq!(report.matches("<figure").count(), 6);
    let other =
        stored("ab", |found| found["model_uncertainty"]["deviations"] = Value::from(vec![0.1]));
    let prediction = json(&predict_by(&other, "c", &[&"--json"]));
    assert!(
        prediction["foretold"].is_null() && prediction["notes"].as_array().unwrap().len() == 1,
        "{prediction}"
    );
    // What a damaged file holds ends in an error or a note, never in a figure that is no number.
    // In the form of schema 1.
    let infinite = stored("ab", |found| {
        let uncertainty = found["model_uncertainty"].as_object_mut().unwrap();
        let size = uncertainty["mean"].as_array().unwrap().len();
        uncertainty.remove("covariance_factor").unwrap();
        let rows = (1..=size).map(|length| Value::from(vec!["-1e30"; length].join(" ")));
        uncertainty.insert("covariance".into(), rows.collect());
    });
    assert!(json(&predict_by(&infinite, "c", &[&"--json"]))["foretold"].is_null());
    type Change = fn(&mut Value);
    let changes: [(Change, &str); 4] = [
        (|found| found["parameters"][0]["name"] = Value::from("zz9"), "no base parameter `zz9`"),
        (|found| found["parameters"][1] = found["parameters"][0].clone(), "stands there twice"),
        (|found| found["parameters"] = Value::from(Vec::<Value>::new()), "has no parameters"),
        (|found| found["parameters"][0]["value"] = Value::from(1e308), "no finite torque"),
    ];
    for (change, said) in changes {
        let damaged = stored("ab", change);
        let command = predict_command(&damaged, "c");
        let finished = didim(&command.iter().map(|of| of as &dyn AsRef<OsStr>).collect::<Vec<_>>());
        let file = damaged.path().display().to_string();
        assert_eq!(finished.code, Some(1), "{finished:?}");
        assert!(finished.stderr.contains(said) && finished.stderr.contains(&file), "{finished:?}");
    }
}

/// One motion is too little to predict others, and the verdict says so. Of two motions, only the
/// torques of single joints outside the motion may be too uncertain.
#[test]
fn one_motion_of_a_kr300_is_too_little_to_predict_others_and_two_explain_the_torques() {
    for (motions, enough) in [
        ("a", false),
        ("b", false),
        ("c", false),
        ("ab", true),
        ("ac", true),
        ("bc", true),
        ("abc", true),
    ] {
        let result = identify_all("kr300", &motions_of(motions), "1.8", "8.196");
        let verdict = &result["verdict"];
        let findings = verdict["findings"].as_array().unwrap();
        let blocks = |finding: &&Value| {
            finding["severity"] == "blocking"
                && finding["uses"].as_array().unwrap().contains(&"prediction".into())
        };
        let is_single = |finding: &&Value| finding["code"] == "joint-extrapolation";
        let others: Vec<&Value> =
            findings.iter().filter(blocks).filter(|finding| !is_single(finding)).collect();
        assert_eq!(others.is_empty(), enough, "{motions}: {others:?}");
        if !enough {
            assert_eq!(verdict["uses"]["prediction"]["applicable"], false, "{motions}");
        }
        let rms_z = |recording: &Value| {
            let deviations = recording["rms_deviation_from"].as_array().unwrap();
            deviations.iter().filter_map(Value::as_f64).fold(0.0, f64::max)
        };
        let recordings = result["recordings"].as_array().map_or(&[][..], Vec::as_slice);
        assert_eq!(recordings.len(), if motions.len() > 1 { motions.len() } else { 0 });
        for recording in recordings {
            assert!((0.8..1.5).contains(&rms_z(recording)), "{motions}: {recording}");
        }
    }
}

/// Of a TIAGo the rows of arm_1 to arm_4 alone, whose torques are measured, along the motion of all
/// eight joints, one of them prismatic. The program cannot leave rows out, the equation is cut
/// here.
#[test]
fn the_measured_torques_of_a_tiago_as_the_independent_implementation() {
    let folder = repository("tests/data/tiago");
    let cell = Cell::read(&folder.join("cell.toml")).unwrap();
    let (matrix, torque) = equation(&cell, &folder.join("motion.csv"), 920..6790, 1..5);
    assert_eq!(matrix.shape(), (4 * 587, 73));
    // What acts on the other rows alone has columns of zeros: 57 of the 73 parameters are left.
    let acting: Vec<usize> = (0..73).filter(|column| matrix.column(*column).amax() > 0.0).collect();
    assert_eq!(acting.len(), 57, "{:?}", cell.base.names());
    let matrix = matrix.select_columns(&acting);
    let joint_of_row = |row: usize| row / 587;
    let (parameters, [unweighted, weighted]) = solve_weighted(&matrix, &torque, joint_of_row);
    close(unweighted, 812.6843101958475, ROUNDED, "condition number");
    close(weighted, 923.309119572419, ROUNDED, "weighted condition number");
    close(relative_error(&matrix, &torque, &parameters), 0.07034390729668052, ROUNDED, "error");
    let per_joint =
        [0.15742782149717005, 0.05143820072080096, 0.10390249594210252, 0.10470310562620368];
    for (joint, expected) in per_joint.into_iter().enumerate() {
        let joint_rows = (matrix.rows(joint * 587, 587), torque.rows(joint * 587, 587));
        let error =
            relative_error(&joint_rows.0.into_owned(), &joint_rows.1.into_owned(), &parameters);
        close(error, expected, ROUNDED, &format!("error of arm_{}", joint + 1));
    }

    // The first 36 s of it predict the rest.
    let before = (0..4 * 587).filter(|row| row % 587 < 358).collect::<Vec<_>>();
    let after = (0..4 * 587).filter(|row| row % 587 >= 358).collect::<Vec<_>>();
    let part = |rows: &[usize]| (matrix.select_rows(rows), torque.select_rows(rows));
    let ((first, second), joint_of_row) = ((part(&before), part(&after)), |row: usize| row / 358);
    let (parameters, _) = solve_weighted(&first.0, &first.1, joint_of_row);
    close(relative_error(&first.0, &first.1, &parameters), 0.06750824687418525, ROUNDED, "seen");
    close(
        relative_error(&second.0, &second.1, &parameters),
        0.08703243933132376,
        ROUNDED,
        "unseen",
    );
}

/// The cell of an arm with a changed text, in a folder of its own.
fn copied_cell(arm: &str, changes: &[(&str, &str)]) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = repository("tests/data").join(arm);
    let text = std::fs::read_to_string(folder.join("cell.toml")).unwrap();
    let text = changed(&text, changes)
        .replace("\"robot.toml\"", &format!("{:?}", folder.join("robot.toml")))
        .replace("\"eight_axes.dbc\"", &format!("{:?}", folder.join("eight_axes.dbc")))
        .replace("../../../config", repository("config").to_str().unwrap());
    let place = tempfile::tempdir().unwrap();
    let cell = place.path().join("cell.toml");
    std::fs::write(&cell, text).unwrap();
    (place, cell)
}

/// The cell of the KR 300 with a line more in `[identification]`, in a folder of its own.
fn changed_cell(line: &str) -> (tempfile::TempDir, std::path::PathBuf) {
    copied_cell("kr300", &[("[identification]\n", &format!("[identification]\n{line}\n"))])
}

const COUNTED: [&dyn AsRef<OsStr>; 4] = [&"--from", &"1.8", &"--to", &"8.196"];

/// What `didim identify` says of two motions of the KR 300 with a cell, to people and as JSON.
fn of_b_and_c(cell: &Path) -> (String, Value) {
    let [b, c] = motion_files(["b", "c"]);
    let identify: [&dyn AsRef<OsStr>; 7] =
        [&"identify", &"--cell", &cell, &"--input", &b, &"--input", &c];
    let text = succeed(&[&identify[..], &COUNTED].concat());
    (text, json(&succeed(&[&identify[..], &COUNTED, &[&"--json"]].concat())))
}

/// What `didim predict` says of the third by a stored result.
fn predicted_a(cell: &Path, result: &Path) -> Value {
    let [a] = motion_files(["a"]);
    let predict: [&dyn AsRef<OsStr>; 8] =
        [&"predict", &"--json", &"--cell", &cell, &"--result", &result, &"--input", &a];
    json(&succeed(&[&predict[..], &COUNTED].concat()))
}

fn motion_files<const N: usize>(letters: [&str; N]) -> [std::path::PathBuf; N] {
    letters.map(|letter| repository(&format!("tests/data/kr300/{letter}.csv")))
}

/// DIDIM simulates each motion by itself, and two say of the third what they say by IDIM-LS.
#[test]
fn two_motions_of_a_kr300_simulated_predict_the_third() {
    let (place, cell) = changed_cell("friction = \"auto\"");
    let configured = repository("tests/data/kr300/cell.toml");
    // As they are stated, and as they are chosen.
    for (cell, expected) in [(&configured, 0.0547), (&cell, 0.0540)] {
        let [b, c] = motion_files(["b", "c"]);
        let identify: [&dyn AsRef<OsStr>; 10] = [
            &"identify",
            &"--json",
            &"--cell",
            &cell,
            &"--method",
            &"didim",
            &"--input",
            &b,
            &"--input",
            &c,
        ];
        let estimate_found = json(&succeed(&[&identify[..], &COUNTED].concat()));
        assert_eq!(estimate_found["relative_error_per_recording"].as_array().unwrap().len(), 2);
        let result = place.path().join("result.json");
        std::fs::write(&result, estimate_found.to_string()).unwrap();
        let error = figure(&predicted_a(cell, &result), "relative_error");
        assert!((error - expected).abs() < 0.002, "{error} for {expected}");
    }
}

/// Friction laws chosen from two motions of the KR 300: held-out motion is predicted better, the
/// third motion no worse, and the result carries its laws to every prediction.
#[test]
fn friction_laws_chosen_by_a_kr300_go_with_the_result() {
    let (place, cell) = changed_cell("friction = \"auto\"");
    let (text, found) = of_b_and_c(&cell);

    let chosen = &found["friction"];
    let gains = chosen["gains"].as_array().unwrap();
    assert!(!gains.is_empty());
    let [before, after] = ["before", "after"].map(|of| figure(&chosen[of], "held_out"));
    assert!(after < before, "{chosen}");
    assert!((figure(&found["held_out"], "relative_error") - after).abs() < 1e-12);
    assert!(figure(&chosen["after"], "elsewhere") < 0.15, "{chosen}");
    // What a person is shown can be put into the robot file: each line is a table.
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with("friction = {")).collect();
    assert!(!lines.is_empty() && lines.len() <= gains.len(), "{text}");
    for line in lines {
        let table: toml::Table = line.parse().unwrap();
        assert!(table["friction"]["sign"]["model"].is_str(), "{line}");
    }

    let result = place.path().join("result.json");
    std::fs::write(&result, found.to_string()).unwrap();
    // By the cell whose robot file has none of the laws.
    let prediction = predicted_a(&repository("tests/data/kr300/cell.toml"), &result);
    let error = figure(&prediction, "relative_error");
    assert!(error < 0.0545, "{error}: without the laws it is 0.0545");
    let predicted = figure(&prediction["foretold"], "relative_error");
    assert!((0.5..2.0).contains(&(predicted / error)), "{predicted}");
}

/// Laws that the robot file stated go with the result, too: what goes on from it takes them,
/// whatever the file states by then.
#[test]
fn friction_laws_that_were_stated_go_with_the_result() {
    let (place, cell) = changed_cell("");
    let robot = place.path().join("robot.toml");
    let plain = repository("tests/data/kr300/robot.toml");
    let text = std::fs::read_to_string(&plain).unwrap();
    let lagging = text.replacen("[friction]\n", "[friction]\nhysteresis_rad = 0.003\n", 1);
    std::fs::write(&robot, lagging).unwrap();
    let with_it = std::fs::read_to_string(&cell).unwrap();
    let with_it = with_it.replace(plain.to_str().unwrap(), robot.to_str().unwrap());
    std::fs::write(&cell, &with_it).unwrap();
    let (_, found) = of_b_and_c(&cell);
    let laws = found["friction_laws"].as_array().unwrap();
    assert!(laws.len() == 6 && laws.iter().all(|own| own["hysteresis_rad"] == 0.003), "{laws:?}");
    let result = place.path().join("result.json");
    std::fs::write(&result, found.to_string()).unwrap();
    let error = figure(&predicted_a(&cell, &result), "relative_error");
    let plain_cell = repository("tests/data/kr300/cell.toml");
    let by_the_result = predicted_a(&plain_cell, &result);
    assert!((figure(&by_the_result, "relative_error") - error).abs() < 1e-12, "{by_the_result}");
    // What lags is taken for known by designs, and is in the friction of a simulator's joint.
    let advised = succeed(&[&"advise", &result, &"--cell", &plain_cell]);
    assert!(advised.contains("fc3") && !advised.contains("\nfh"), "{advised}");
    fn value_of(name: &str, found: &Value) -> f64 {
        let mut parameters = found["parameters"].as_array().unwrap().iter();
        parameters.find(|own| own["name"] == name).unwrap()["value"].as_f64().unwrap()
    }
    let export: [&dyn AsRef<OsStr>; 9] = [
        &"export",
        &"--cell",
        &cell,
        &"--result",
        &result,
        &"--to",
        &"urdf",
        &"--total-mass-kg",
        &"900",
    ];
    let urdf = succeed(&export);
    let friction: Vec<f64> = urdf
        .split(" friction=\"")
        .skip(1)
        .map(|text| text.split('"').next().unwrap().parse().unwrap())
        .collect();
    // The body that is possible is not quite the estimate.
    assert!(
        (friction[2] / (value_of("fc3", &found) + value_of("fh3", &found)) - 1.0).abs() < 0.05,
        "{friction:?}"
    );

    // A cell with a list of parameters says that theirs are not among them.
    let listed = with_it.replacen(
        "[identification]\n",
        "[identification]\nparameters = [\"zz1r\", \"fc1\"]\n",
        1,
    );
    std::fs::write(&cell, listed).unwrap();
    let said = didim(&[&"check", &"--cell", &cell, &"--other-machine"]);
    assert!(said.stdout.contains("not identified and count as 0: fh1"), "{said:?}");
}

/// The cut-off that two motions of the KR 300 choose: a lower one predicts what was held out worse.
#[test]
fn the_cut_off_chosen_by_a_kr300_goes_with_the_result() {
    let (place, cell) = changed_cell("");
    let text = std::fs::read_to_string(&cell).unwrap();
    let auto = text.replace("cutoff_hz = 5.0", "cutoff_hz = \"auto\"");
    assert_ne!(auto, text);
    std::fs::write(&cell, auto).unwrap();
    let (text, found) = of_b_and_c(&cell);

    let chosen = figure(&found["position_cutoff"], "cutoff_hz");
    assert!((7.0..=15.0).contains(&chosen), "{chosen}");
    let trials = found["position_cutoff"]["trials"].as_array().unwrap();
    let held_out = |trial: &Value| figure(trial, "held_out");
    let least = trials.iter().map(held_out).fold(f64::INFINITY, f64::min);
    let (lower, rest): (Vec<_>, Vec<_>) =
        trials.iter().partition(|trial| figure(trial, "cutoff_hz") < chosen);
    assert!(lower.len() >= 3 && lower.into_iter().all(|trial| held_out(trial) > 1.01 * least));
    assert!(held_out(rest[0]) <= 1.01 * least);
    assert!((figure(&found["held_out"], "relative_error") - held_out(rest[0])).abs() < 1e-12);
    assert!(text.contains(&format!("position_filter = {{ cutoff_hz = {chosen:?} }}")), "{text}");
    // Nothing asks for a higher cut-off: those were tried.
    assert!(
        figure(&found["position_bias"], "deviations").abs() > 3.0,
        "{}",
        found["position_bias"]
    );
    let findings = found["verdict"]["findings"].as_array().unwrap();
    let is_about_cutoff = |of: &Value| of["code"] == "filter-bias" || of["code"] == "noise-bias";
    assert!(!findings.is_empty() && !findings.iter().any(is_about_cutoff), "{findings:?}");

    let result = place.path().join("result.json");
    std::fs::write(&result, found.to_string()).unwrap();
    let predicted = predicted_a(&cell, &result);
    assert!(figure(&predicted, "relative_error") < 0.06, "{predicted}");
    assert!(predicted["foretold"].is_object(), "{predicted}");

    let check = didim(&[&"check", &"--cell", &cell]);
    assert!(check.stdout.contains("state the cut-off that it prints"), "{check:?}");
}

/// Results of a service are compared for years: its laws are stated.
#[test]
fn a_service_does_not_choose_friction_laws() {
    let (_place, cell) = changed_cell("friction = \"auto\"");
    for command in ["check", "replay"] {
        let mut arguments: Vec<&dyn AsRef<OsStr>> = vec![&command, &"--cell", &cell];
        if command == "replay" {
            arguments.push(&"none.log");
        }
        let ended = didim(&arguments);
        let error = ended.stdout + &ended.stderr;
        assert_ne!(ended.code, Some(0));
        assert!(error.contains("identification.friction"), "{error}");
        assert!(error.contains("put the laws that it prints into the robot file"), "{error}");
    }
    let (_place, cell) = changed_cell("friction = \"automatic\"");
    let error = didim(&[&"check", &"--cell", &cell]).stderr;
    assert!(error.contains("automatic") && error.contains("auto`"), "{error}");
}
