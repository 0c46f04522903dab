//! `didim compare`: the reproduction of the paper within its limits, tables, files, mistakes.

use serde_json::Value;

use super::golden::golden;
use super::support::{Configuration, Folder, cia402_cell, data, didim, packed_cell, shipped};

/// What stands above the tables in the documents.
const TABLES_HEADING: &str = "\
# The paper's tables on the simulated TX40

What [paper.md](paper.md) discusses, as printed by

```sh
didim compare --cell config/cells/tx40-paper.toml --scenario tx40-paper-errors --strict \\
  --published config/published/output-error-methods.toml \\
  --limits config/limits/tx40-paper-errors.toml --folds 0 --markdown paper-tables.md
```

";

/// The paper's experiment, with everything that can be written. Time is no part of it.
#[test]
fn the_paper_comes_out_within_its_limits() {
    let folder = Folder::new();
    let [markdown, report, figure] =
        ["paper.md", "paper.html", "paper.svg"].map(|f| folder.path(f));
    let cell = shipped("cells/tx40-paper.toml");
    let published = shipped("published/output-error-methods.toml");
    let limits = shipped("limits/tx40-paper-errors.toml");
    let experiment =
        ["compare", "--cell", &cell, "--scenario", "tx40-paper-errors", "--strict", "--folds", "0"];
    let against = ["--published", &published, "--limits", &limits];
    let files = ["--markdown", &markdown, "--report", &report, "--figure", &figure];
    let text = didim(&[&experiment[..], &against, &files].concat()).done();
    let timeless: String =
        text.split_inclusive('\n').filter(|line| !line.starts_with("time ")).collect();
    golden("compare.txt", &timeless);
    let tables = std::fs::read_to_string(markdown).unwrap();
    golden("../../../../../docs/evidence/paper-tables.md", &format!("{TABLES_HEADING}{tables}"));
    // A panel for every method and joint, a stem for every lag.
    let figure = std::fs::read_to_string(figure).unwrap();
    assert_eq!(figure.matches(r#"class="frame""#).count(), 8 * 6);
    assert_eq!(figure.matches(r#"class="stem""#).count(), 8 * 6 * 30);
    for said in ["CLOE, strict", "34500 rows", "IDIM-IV", "276 rows"] {
        assert!(figure.contains(said), "{said}");
    }
    let html = std::fs::read_to_string(report).unwrap();
    for said in ["limits hold.", "Output Error Methods", "tx40-paper-errors", "<dd>1</dd>"] {
        assert!(html.contains(said), "{said}");
    }
    assert!(!html.contains(" s</td>"), "no run time in a file");
}

#[test]
fn json_has_every_method_and_what_is_held_out() {
    let (cell, log) = (packed_cell(), &data().packed_log);
    let command = ["compare", "--cell", &cell, "--input", log, "--methods", "idim-iv"];
    let json = didim(&[&command[..], &["--folds", "3", "--json"]].concat()).done();
    let comparison: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&comparison["schema"], &comparison["robot"]), (&1.into(), &"tx40".into()));
    assert_eq!(comparison["truth"], Value::Null);
    let methods = comparison["methods"].as_array().unwrap();
    let names: Vec<&str> = methods.iter().map(|of| of["method"].as_str().unwrap()).collect();
    assert_eq!(names, ["idim-ls", "idim-iv"]);
    for of in methods {
        assert_eq!((&of["framework"], &of["failure"]), (&"decimated".into(), &Value::Null));
        assert_eq!(of["estimate"]["parameters"].as_array().unwrap().len(), 28);
        assert!(of["elapsed_ms"].as_f64().unwrap() > 0.0);
    }
    // The same as identify alone.
    let alone = ["identify", "--cell", &cell, "--input", log, "--method", "idim-iv", "--json"];
    let alone: Value = serde_json::from_str(&didim(&alone).done()).unwrap();
    assert_eq!(alone["parameters"], methods[1]["estimate"]["parameters"]);
    let agreement = comparison["agreement"].as_array().unwrap();
    assert_eq!(agreement.len(), 2);
    assert_eq!((&agreement[0]["inside"], &agreement[0]["compared"]), (&28.into(), &28.into()));
    for of in comparison["held_out"].as_array().unwrap() {
        let error = |which: &str| of[which]["relative_error"].as_f64().unwrap();
        assert!(error("in_sample") < error("held_out") && error("held_out") < 1e-3, "{of}");
    }
}

/// A method that cannot run is a row with its cause, and the others are there.
#[test]
fn without_a_controller_only_the_reference_runs() {
    let configuration = Configuration::new();
    let cell = configuration.packed_cell();
    let text = std::fs::read_to_string(&cell).unwrap();
    let (before, rest) = text.split_once("[controller]").unwrap();
    let (_, after) = rest.split_once("[window]").unwrap();
    let (after, rest) = after.split_once("[identification.simulation]").unwrap();
    let (_, last) = rest.split_once("[service]").unwrap();
    std::fs::write(&cell, format!("{before}[window]{after}[service]{last}")).unwrap();
    let log = &data().packed_log;
    let compare = ["compare", "--cell", &cell, "--input", log, "--folds", "0"];
    let outcome = didim(&compare);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("IDIM-IV, CLIE, CLOE, DIDIM"), "{}", outcome.stderr);
    assert_eq!(outcome.stderr.matches("[controller]").count(), 1, "{}", outcome.stderr);
    let text = &outcome.stdout;
    assert!(text.starts_with("IDIM-LS  applicable\n"), "{text}");
    assert!(text.contains("\nzz1r ") && !text.contains("FAILED"), "{text}");
    // A method that the command line names cannot be left out.
    let named = [&compare[..], &["--methods", "idim-ls,didim"]].concat();
    didim(&named).refused(78, &["didim simulates the closed loop", "[controller]"]);
}

/// Exit code 3 if the result of a named method is not usable.
#[test]
fn a_use_of_the_compared_results_is_required() {
    // Values are known no better than the torque gains.
    let tolerances = "[identification]\ntolerances = { torque_gain = 0.3 }";
    let configuration =
        Configuration::with_edit("cells/tx40-packed-fd.toml", "[identification]", tolerances);
    let (cell, log) = (configuration.packed_cell(), &data().packed_log);
    let compare = ["compare", "--cell", &cell, "--input", log, "--folds", "0", "--json"];
    let required = |usage: &str| {
        didim(&[&compare[..], &["--methods", "idim-ls", "--require", usage]].concat())
    };
    assert_eq!(required("monitoring").code, Some(0));
    let refused = required("physical-values");
    assert_eq!(refused.code, Some(3), "{}", refused.stderr);
    assert!(refused.stderr.contains("not usable for physical-values: IDIM-LS: "));
}

/// A controller that no arm follows: the results of the others are there, and exit code 3 says once
/// that one is missing.
#[test]
fn a_method_without_a_result_is_said_once() {
    let (gain, unstable) = ("kd_s_per_rad = 2.5361", "kd_s_per_rad = 2536.1");
    let configuration = Configuration::with_edit("cells/tx40-packed-fd.toml", gain, unstable);
    let (cell, log) = (configuration.packed_cell(), &data().packed_log);
    let compare = ["compare", "--cell", &cell, "--input", log, "--folds", "0", "--json"];
    let outcome = didim(&[&compare[..], &["--methods", "idim-ls,didim"]].concat());
    assert_eq!(outcome.code, Some(3), "{}", outcome.stderr);
    assert_eq!(outcome.stderr.matches("DIDIM").count(), 1, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("1 of 2 runs"), "{}", outcome.stderr);
    let methods = &serde_json::from_str::<Value>(&outcome.stdout).unwrap()["methods"];
    assert_eq!(methods[0]["estimate"]["parameters"].as_array().unwrap().len(), 28);
    assert_eq!((&methods[0]["failure"], &methods[1]["estimate"]), (&Value::Null, &Value::Null));
}

/// A twentieth of a second has fewer rows than parameters.
#[test]
fn without_any_result_there_is_no_comparison() {
    let (cell, log) = (packed_cell(), &data().packed_log);
    let command = ["compare", "--cell", &cell, "--input", log, "--methods", "idim-ls"];
    let short = ["--from", "1", "--to", "1.05", "--folds", "0", "--json"];
    let mut outcome = didim(&[&command[..], &short].concat());
    let json: Value = serde_json::from_str(&std::mem::take(&mut outcome.stdout)).unwrap();
    assert_eq!(json["methods"][0]["failure_kind"], "refused", "{json}");
    outcome.refused(1, &["no method has a result; IDIM-LS: "]);
}

#[test]
fn a_limit_that_does_not_hold_is_named() {
    let folder = Folder::new();
    let limits = "[[limits]]\nfigure = \"condition-number\"\nmethod = \"idim-ls\"\nat_most = 5\n\
                  [[limits]]\nfigure = \"condition-number\"\nmethod = \"idim-ls\"\nat_most = 500\n";
    let limits = folder.file("limits.toml", limits);
    let (cell, log) = (packed_cell(), &data().packed_log);
    let command = ["compare", "--cell", &cell, "--input", log, "--methods", "idim-ls"];
    let mut outcome = didim(&[&command[..], &["--folds", "0", "--limits", &limits]].concat());
    let text = std::mem::take(&mut outcome.stdout);
    assert!(text.contains("Limits\n") && text.contains("zz1r"), "the result is there: {text}");
    outcome.refused(3, &["1 of 2 limits", "IDIM-LS: condition number: 1", "at most 5"]);
}

#[test]
fn mistakes() {
    let (cell, log) = (packed_cell(), &data().packed_log);
    let folder = Folder::new();
    let compare = |more: &[&str]| didim(&[&["compare", "--cell", &cell], more].concat());
    compare(&[]).refused(2, &["--input", "required"]);
    let methods = ["--input", log, "--methods", "didim,idim-xx"];
    compare(&methods).refused(2, &["idim-xx", "possible values: idim-ls"]);
    let both = ["--input", log, "--scenario", "tx40-paper"];
    compare(&both).refused(2, &["--scenario", "cannot be used with"]);
    compare(&["--input", log, "--seed", "1"]).refused(2, &["--seed", "cannot be used with"]);
    compare(&["--input", log, "--folds", "1"]).refused(2, &["2 to 20"]);
    compare(&["--scenario", "tx41"]).refused(2, &["tx41", "tx40-paper"]);
    compare(&["--input", log, "--to", "60"]).refused(2, &["--to 60", "0 to 7.9398 s"]);
    let wrong = folder.file("wrong.toml", "source = \"x\"\nmethod = []\n");
    compare(&["--input", log, "--published", &wrong]).refused(78, &["wrong.toml", "line 2"]);
    compare(&["--input", log, "--limits", &wrong]).refused(78, &["wrong.toml", "limits"]);
    let limit = "[[limits]]\nfigure = \"inside\"\nmethod = \"cloe\"\nat_least = 1\n";
    let limit = folder.file("limit.toml", limit);
    compare(&["--input", log, "--methods", "idim-ls", "--limits", &limit])
        .refused(78, &["limit.toml", "CLOE does not run"]);
    let none = folder.file("none.toml", "limits = []\n");
    compare(&["--input", log, "--limits", &none]).refused(78, &["none.toml", "at least one"]);
    let report = folder.path("nowhere/report.html");
    compare(&["--input", log, "--report", &report]).refused(1, &["nowhere/report.html", "folder"]);
    let nowhere = folder.path("nowhere.toml");
    compare(&["--input", log, "--limits", &nowhere]).refused(78, &["nowhere.toml", "No such file"]);
    didim(&["compare", "--cell", &cia402_cell(), "--scenario", "tx40-paper"])
        .refused(1, &["5000", "500", "cell of the scenario's rate"]);
}
