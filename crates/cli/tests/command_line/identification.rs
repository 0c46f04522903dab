//! `didim identify` on the simulated arm: the truth is found, and found again to the byte.

use didim_identification::identification::Method;
use serde_json::Value;

use super::support::{Configuration, Folder, cia402_cell, data, didim, head, packed_cell};

#[track_caller]
fn identify(cell: &str, input: &str, options: &[&str]) -> Value {
    let command = ["identify", "--cell", cell, "--input", input, "--json"];
    let text = didim(&[&command, options].concat()).done();
    assert_eq!((text.matches('\n').count(), text.ends_with('\n')), (1, true), "{text}");
    serde_json::from_str(&text).unwrap()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is no number in {value}"))
}

/// Deviation of every parameter from the scenario's truth, in standard deviations.
fn deviations(output: &Value) -> Vec<(String, f64)> {
    let scenario = didim_sim::tx40_paper().unwrap();
    let parameters = output["parameters"].as_array().unwrap();
    parameters
        .iter()
        .map(|parameter: &Value| {
            let name = parameter["name"].as_str().unwrap().to_owned();
            let truth = scenario.truth_of(&name).unwrap();
            let z = (number(parameter, "value") - truth) / number(parameter, "standard_deviation");
            (name, z)
        })
        .collect()
}

fn rms(deviations: &[(String, f64)]) -> f64 {
    let sum: f64 = deviations.iter().map(|(_, z)| z * z).sum();
    (sum / deviations.len() as f64).sqrt()
}

#[test]
fn one_object_with_the_promised_keys() {
    let output = identify(&packed_cell(), &data().packed_log, &[]);
    for key in [
        "schema",
        "method",
        "robot",
        "samples",
        "rows",
        "parameters",
        "condition_number",
        "singular_values",
        "unweighted_condition_number",
        "unweighted_singular_values",
        "relative_error",
        "relative_error_per_joint",
        "rms_error_per_joint_nm",
        "durbin_watson_per_joint",
        "relative_prediction_deviation_per_joint",
        "durbin_watson_expected",
        "whiteness_per_joint",
        "ljung_box_per_joint",
        "effective_rows_per_joint",
        "torque_delay_per_joint",
        "freedoms",
        "elsewhere",
        "held_out",
        "iterations",
        "simulations",
        "elapsed_ms",
        "verdict",
    ] {
        assert!(output.get(key).is_some(), "no {key} in {output}");
    }
    assert_eq!(output["schema"], 2);
    assert_eq!((&output["method"], &output["robot"]), (&"idim-ls".into(), &"tx40".into()));
    assert_eq!((&output["samples"], &output["iterations"]), (&39_700.into(), &1.into()));
    assert_eq!(output["simulations"], 0);
    assert_eq!(output["verdict"]["applicable"], true, "{}", output["verdict"]);
    assert_eq!(output["verdict"]["reasons"], Value::Array(vec![]));
    let names: Vec<&str> = output["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(|parameter| parameter["name"].as_str().unwrap())
        .collect();
    assert_eq!(names.len(), 28);
    assert_eq!((names[0], names[27]), ("zz1r", "fc_m6"));
    for parameter in output["parameters"].as_array().unwrap() {
        let relative = number(parameter, "standard_deviation") / number(parameter, "value").abs();
        assert!((number(parameter, "relative_standard_deviation") / relative - 1.0).abs() < 1e-9);
    }
    for key in ["relative_error_per_joint", "rms_error_per_joint_nm", "durbin_watson_per_joint"] {
        assert_eq!(output[key].as_array().unwrap().len(), 6, "{key}");
    }
    assert!(number(&output["singular_values"], "max") > number(&output["singular_values"], "min"));
    assert!(number(&output, "elapsed_ms") > 0.0);
}

/// Errors that alternate, as a closed loop makes them, tell no more than independent ones.
#[test]
fn there_are_no_more_effective_rows_than_rows() {
    let output = identify(&cia402_cell(), &data().cia402_log, &["--method", "idim-ls"]);
    let rows = number(&output, "rows") / 6.0;
    let effective = output["effective_rows_per_joint"].as_array().unwrap();
    assert_eq!(effective.len(), 6);
    for one in effective.iter().map(|one| one.as_f64().unwrap()) {
        assert!((1.0..=rows).contains(&one), "{one} of {rows}");
    }
}

/// z of 28 parameters: their rms is 1 to within 0.2 or so, since they are correlated.
#[test]
fn the_truth_is_found_by_every_method() {
    // From the paper's start CLIE does not arrive on this motion, and says so.
    let configuration = Configuration::with_edit(
        "cells/tx40-packed-fd.toml",
        "start = \"unit-drive-inertias\"",
        "start = \"idim-ls\"",
    );
    let cell = configuration.packed_cell();
    for method in Method::ALL {
        let output = identify(&cell, &data().packed_log, &["--method", method.name()]);
        assert_eq!(output["method"], method.name());
        assert_eq!(output["verdict"]["applicable"], true, "{}", output["verdict"]);
        let deviations = deviations(&output);
        println!("rms of the deviations {:.2}: {deviations:.2?}", rms(&deviations));
        for (name, z) in &deviations {
            assert!(z.abs() <= 4.0, "{method}: {name} is {z:.1} standard deviations off");
        }
        assert!(rms(&deviations) <= 1.4, "{method}: {}", rms(&deviations));
    }
}

/// The paper's filter of 50 Hz smooths what these encoders resolve: the estimate is several
/// standard deviations off, and the verdict says so.
#[test]
fn a_position_filter_that_biases_is_reported_by_the_verdict() {
    let configuration = Configuration::with_edit(
        "cells/tx40-packed-fd.toml",
        "cutoff_hz = 200.0",
        "cutoff_hz = 50.0",
    );
    let output = identify(&configuration.packed_cell(), &data().packed_log, &[]);
    let deviations = deviations(&output);
    assert!(deviations.iter().any(|(_, z)| z.abs() > 2.5), "{deviations:.2?}");
    let notes = output["verdict"]["notes"].to_string();
    assert!(notes.contains("position filter distorts the motion"), "{notes}");
    // The bias is in the combined uncertainty.
    for ((name, z), parameter) in deviations.iter().zip(output["parameters"].as_array().unwrap()) {
        let ratio = number(parameter, "standard_deviation")
            / number(parameter, "combined_standard_deviation");
        assert!((z * ratio).abs() <= 2.0, "{name}: {z} {ratio}");
    }
}

/// Who iterates says how; who does not has no such keys.
#[test]
fn didim_shows_how_it_converged() {
    let output = identify(&packed_cell(), &data().packed_log, &["--method", "didim"]);
    let steps = output["convergence"].as_array().unwrap();
    assert_eq!(steps.len() as u64, output["simulations"].as_u64().unwrap());
    // From the paper's start, which is far away.
    assert!((4..=10).contains(&steps.len()), "{steps:?}");
    assert!(number(&steps[0], "parameter_change") > 1e4);
    assert!(number(steps.last().unwrap(), "parameter_change") <= 0.2);
    assert!(number(steps.last().unwrap(), "relative_error_change") <= 0.01);
    assert_eq!(output["reference"], "recorded");
    let text = didim(&[
        "identify",
        "--cell",
        &packed_cell(),
        "--input",
        &data().packed_log,
        "--method",
        "didim",
    ])
    .done();
    for part in ["convergence", "simulation 1", "█", "torque delay"] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    let other = identify(&packed_cell(), &data().packed_log, &[]);
    assert!(other.get("convergence").is_none() && other.get("reference").is_none());
}

/// A rate that is wrong by a thousandth makes inertias wrong by two, which fit as well.
#[test]
fn a_sample_rate_that_the_stamps_contradict_is_refused() {
    for rate in ["4995.0", "4950.0", "4000.0", "5005.0"] {
        let configured = format!("rate_hz = {rate}");
        let configuration =
            Configuration::with_edit("cells/tx40-packed-fd.toml", "rate_hz = 5000.0", &configured);
        let cell = std::fs::read_to_string(configuration.packed_cell()).unwrap();
        let cell = cell.replace(
            "sample_period_s = 2e-4",
            &format!("sample_period_s = {:e}", 1.0 / rate.parse::<f64>().unwrap()),
        );
        std::fs::write(configuration.packed_cell(), cell).unwrap();
        didim(&["identify", "--cell", &configuration.packed_cell(), "--input", &data().packed_log])
            .refused(1, &["samples/s", "rate_hz"]);
    }
}

/// The controller is what makes the recorded command of the recorded reference and position. A
/// wrong gain shows with its size, and above the tolerance of the torque gain it is named before
/// what follows from it.
#[test]
fn a_controller_that_is_not_the_recorded_one_is_reported_by_the_verdict() {
    let largest = |output: &Value| {
        let errors = output["controller_error_per_joint"].as_array().unwrap().iter();
        errors.map(|error| error.as_f64().unwrap()).fold(0.0, f64::max)
    };
    let right = identify(&packed_cell(), &data().packed_log, &["--method", "didim"]);
    assert!(largest(&right) < 3e-4, "{right}");
    for (from, to, is_named) in [
        ("kd_s_per_rad = 2.5361", "kd_s_per_rad = 2.485", false),
        ("341.87", "343.6", false),
        ("kd_s_per_rad = 2.5361", "kd_s_per_rad = 2.0", true),
        ("341.87", "360.0", true),
    ] {
        let configuration = Configuration::with_edit("cells/tx40-packed-fd.toml", from, to);
        let cell = configuration.packed_cell();
        let output = identify(&cell, &data().packed_log, &["--method", "didim"]);
        assert!(largest(&output) > 1e-3, "{to}: {}", output["controller_error_per_joint"]);
        assert_eq!(output["verdict"]["applicable"], !is_named, "{to}");
        let findings = output["verdict"]["findings"].as_array().unwrap();
        assert_eq!(findings.iter().any(|of| of["code"] == "controller"), is_named, "{to}");
        if is_named {
            let finding = &findings[0];
            assert_eq!(finding["code"], "controller", "{to}");
            assert_eq!(finding["subject"]["joints"], serde_json::json!([1]), "{to}");
        }
    }
}

/// A cell that says nothing of its controller: the method of the command line is refused with what
/// is missing, that of the file when the file is read.
#[test]
fn a_method_that_simulates_needs_a_controller() {
    let cell = std::fs::read_to_string(packed_cell()).unwrap();
    let (start, end) =
        (cell.find("[controller]").unwrap(), cell.find("# A window begins with motion").unwrap());
    let configuration =
        Configuration::with_edit("cells/tx40-packed-fd.toml", &cell[start..end], "");
    let without = configuration.packed_cell();
    didim(&["identify", "--cell", &without, "--input", &data().packed_log, "--method", "didim"])
        .refused(78, &["[controller]", "idim-ls"]);
    let text = std::fs::read_to_string(&without).unwrap();
    std::fs::write(&without, text.replace("method = \"idim-ls\"", "method = \"didim\"")).unwrap();
    didim(&["check", "--cell", &without]).refused(78, &["identification.method", "[controller]"]);
}

/// Robust weights that are none, and a method that has none: the cell is wrong and not the record.
#[test]
fn robust_weights_are_checked_with_the_cell() {
    fn with_robust(robust: &str) -> Configuration {
        let section = format!("[identification]\nrobust = {robust}");
        Configuration::with_edit("cells/tx40-packed-fd.toml", "[identification]", &section)
    }
    for tuning in ["-1.0", "0.0", "nan"] {
        let robust = format!("{{ kind = \"huber\", tuning = {tuning} }}");
        let (configuration, input) = (with_robust(&robust), &data().packed_log);
        let cell = configuration.packed_cell();
        let says = [&*cell, "`identification.robust`", "tuning", "1.345"];
        didim(&["check", "--cell", &cell]).refused(78, &says);
        didim(&["identify", "--cell", &cell, "--input", input]).refused(78, &says);
    }
    let configuration = with_robust("{ kind = \"bisquare\" }");
    let cell = configuration.packed_cell();
    didim(&["check", "--cell", &cell, "--other-machine"]).done();
    let says = [&*cell, "`identification.robust`", "has no robust weights"];
    for method in ["idim-iv", "clie", "cloe"] {
        let input = &data().packed_log;
        didim(&["identify", "--cell", &cell, "--input", input, "--method", method])
            .refused(78, &says);
    }
    let text = std::fs::read_to_string(&cell).unwrap();
    std::fs::write(&cell, text.replace("method = \"idim-ls\"", "method = \"clie\"")).unwrap();
    didim(&["check", "--cell", &cell]).refused(78, &says);
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let folder = Folder::new();
    let cell = packed_cell();
    let [one, two, other] = ["1.log", "2.log", "3.log"].map(|name| folder.path(name));
    for (log, seed) in [(&one, "7"), (&two, "7"), (&other, "8")] {
        didim(&["sim", "--cell", &cell, "--bus", &format!("log:{log}"), "--seed", seed]).done();
    }
    let [one_bytes, two_bytes, other_bytes] =
        [&one, &two, &other].map(|log| std::fs::read(log).unwrap());
    assert!(one_bytes == two_bytes);
    assert!(one_bytes != other_bytes && one_bytes.len() == other_bytes.len());

    let figures = [folder.path("1.svg"), folder.path("2.svg")];
    let command = ["identify", "--cell", &cell, "--json", "--figure"];
    let outputs = [(&one, &figures[0]), (&two, &figures[1])].map(|(log, figure)| {
        let text = didim(&[&command[..], &[figure, "--input", log]].concat()).done();
        // The run time is the last key, and the only one that may differ.
        let (result, elapsed) = text.split_once(",\"elapsed_ms\":").unwrap();
        assert!(elapsed.trim_end().strip_suffix('}').unwrap().parse::<f64>().unwrap() > 0.0);
        result.to_owned()
    });
    assert_eq!(outputs[0], outputs[1]);
    let [first, second] = figures.map(|figure| std::fs::read(figure).unwrap());
    assert!(first == second && first.starts_with(b"<svg"));
}

/// What a table says is what its log says: values, to the bit.
#[test]
fn log_and_table_give_the_same_result() {
    let [mut log, mut table] =
        [&data().packed_log, &data().packed_csv].map(|input| identify(&packed_cell(), input, &[]));
    for output in [&mut log, &mut table] {
        output.as_object_mut().unwrap().remove("elapsed_ms");
    }
    assert_eq!(log, table);
}

#[test]
fn methods_have_names() {
    let cell = packed_cell();
    let method_names = Method::ALL.map(Method::name).join(", ");
    for unknown in ["IDIM-LS", "idim_ls", ""] {
        didim(&["identify", "--cell", &cell, "--input", "x", &format!("--method={unknown}")])
            .refused(2, &["--method", &format!("possible values: {method_names}")]);
    }
}

#[test]
fn only_what_was_asked_for_counts() {
    let cell = packed_cell();
    let complete = identify(&cell, &data().packed_log, &[]);
    let part = identify(&cell, &data().packed_log, &["--from", "1", "--to", "5"]);
    assert_eq!(complete["samples"], part["samples"]);
    // A row in 125 samples, six joints, 20001 samples.
    let rows = number(&part, "rows");
    assert!((rows - 6.0 * 20_001.0 / 125.0).abs() <= 6.0, "{rows}");
    assert!(rows < number(&complete, "rows"));
}

#[test]
fn the_table_for_people_names_every_parameter_and_its_regrouping() {
    let text = didim(&[
        "identify",
        "--cell",
        &packed_cell(),
        "--input",
        &data().packed_log,
        "--regrouping",
    ])
    .done();
    for part in ["zz1r", "fc_m6", "verdict: applicable", "Durbin", "zz1r = zz1 + ia1 + yy2 + yy3"] {
        assert!(text.contains(part), "{part} in {text}");
    }
}

/// A result that must not be used is a result: code 0, and the verdict says why.
#[test]
fn a_poor_result_says_so_in_its_verdict() {
    let configuration = Configuration::with_edit(
        "cells/tx40-packed-fd.toml",
        "sign = 1, provenance = \"drive of",
        "sign = -1, provenance = \"drive of",
    );
    let output = identify(&configuration.packed_cell(), &data().packed_log, &[]);
    assert_eq!(output["verdict"]["applicable"], false);
    let reasons = output["verdict"]["reasons"].to_string();
    let sign_flipped =
        "all 2 identifiable drive inertias and friction coefficients of joint 1 are negative";
    assert!(reasons.contains(sign_flipped), "{reasons}");
    // What follows from it is left out.
    assert!(!reasons.contains("fv1"), "{reasons}");
}

/// A table without times is as good as one with, when the rate is given.
#[test]
fn a_sample_rate_replaces_the_times() {
    let folder = Folder::new();
    let text = head(&data().packed_csv, usize::MAX);
    let timeless: String =
        text.lines().map(|line| line.split_once(',').unwrap().1.to_owned() + "\n").collect();
    let input = folder.file("timeless.csv", &timeless);
    let output = identify(&packed_cell(), &input, &["--sample-rate", "5000"]);
    let expected = identify(&packed_cell(), &data().packed_csv, &[]);
    assert_eq!(output["parameters"], expected["parameters"]);
}

/// The shipped cell's 28 parameters are what the noise of the scenario lets be found.
#[test]
fn the_essential_parameters_are_found_among_all() {
    let output = identify(&packed_cell(), &data().packed_log, &["--essential"]);
    let names = |of: &Value| -> Vec<String> {
        of.as_array().unwrap().iter().map(|name| name.as_str().unwrap().to_owned()).collect()
    };
    let essential = names(&output["reduction"]["essential"]);
    let parameters = output["parameters"].as_array().unwrap();
    let identified: Vec<_> = parameters.iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert_eq!(essential, identified);
    let left_out = output["reduction"]["left_out"].as_array().unwrap();
    assert_eq!(left_out.len() + essential.len(), 60);
    let reference_result = identify(&packed_cell(), &data().packed_log, &[]);
    let listed: Vec<_> = reference_result["parameters"].as_array().unwrap().to_vec();
    let missing = listed.iter().filter(|p| !identified.contains(&p["name"].as_str().unwrap()));
    assert_eq!(missing.count(), 0, "{essential:?}");
    assert!(essential.len() <= 31, "{essential:?}");

    let command = ["identify", "--cell", &packed_cell(), "--input", &data().packed_log];
    let text = didim(&[&command[..], &["--essential"]].concat()).done();
    assert!(text.starts_with("parameter  relative σ"), "{text}");
    for part in ["left out\n", "  stays\n", "base parameters are essential", "parameters = [\n"] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
}
