//! `didim history` and `didim baseline` on what `didim replay` left.

use std::path::Path;

use crate::program::parameters_with_units;

use super::support::{Configuration, Folder, cia402_cell, data, didim};

/// Replays the same log so many times into one folder.
fn replayed(folder: &Folder, times: usize) -> String {
    let state = folder.path("state");
    for _ in 0..times {
        let log = &data().cia402_log;
        didim(&["replay", "--cell", &cia402_cell(), log, "--state", &state, "--json"]).done();
    }
    state
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn results_are_listed_compared_and_reported() {
    let folder = Folder::new();
    let state = replayed(&folder, 2);
    let result = |k: u32| {
        std::fs::read_to_string(Path::new(&state).join(format!("result-0000000{k}.json"))).unwrap()
    };
    assert_eq!(result(0), result(1), "the same samples, the same bytes, whatever the date");
    let first = json(&result(0));
    assert_eq!(first["input_sha256"].as_str().unwrap().len(), 64);
    let configuration = first["configuration"].as_str().unwrap();
    let configuration_folder = Path::new(&state).join("configurations").join(configuration);
    let stored_cell = std::fs::read_to_string(configuration_folder.join("cell.toml")).unwrap();
    assert_eq!(stored_cell, std::fs::read_to_string(cia402_cell()).unwrap());

    let set = didim(&["baseline", "set", "--state", &state, "0"]).done();
    assert!(set.starts_with("result 0 of 2"), "{set}");
    let shown = didim(&["baseline", "show", "--state", &state]).done();
    assert!(shown.starts_with("result 0 of 2") && shown.contains("fc3"), "{shown}");

    let text = didim(&["history", "--state", &state, "--parameter", "fc3"]).done();
    assert!(text.lines().nth(1).unwrap().ends_with("baseline"), "{text}");
    assert!(text.lines().nth(2).unwrap().ends_with("in band"), "{text}");
    assert!(text.contains("fc3 [N·m], ±2σ") && text.contains("fc3 has grown by 0"), "{text}");
    let compared = didim(&["history", "--state", &state, "--compare", "0", "1"]).done();
    let rows = compared.lines().skip(1);
    let same = |row: &str| row.split_whitespace().skip(4).collect::<Vec<_>>().join(" ");
    assert!(rows.map(same).all(|row| row == "0 +0.00 % +0.0 0 %"), "{compared}");

    rows_for_databases(&folder, &state);

    let report = folder.path("history.html");
    let document =
        json(&didim(&["history", "--state", &state, "--json", "--report", &report]).done());
    assert_eq!(document["results"].as_array().unwrap().len(), 2);
    // Of both results and of the baseline.
    assert_eq!(parameters_with_units(&document), 3 * 28);
    assert_eq!(document["results"][1]["compared"], true);
    assert_eq!(document["baseline"]["result"]["result"], 0);
    let parameters = document["results"][1]["parameters"].as_array().unwrap();
    let stored = json(&result(1));
    let stored = stored["estimate"]["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), stored.len());
    for (fixed, stored) in parameters.iter().zip(stored) {
        for key in ["name", "unit"] {
            assert_eq!(fixed[key], stored[key]);
        }
        // The history has the digits that the uncertainty leaves.
        for (key, rounding) in [("value", 1e-8), ("standard_deviation", 1e-4)] {
            let [fixed, stored] = [fixed, stored].map(|of| of[key].as_f64().unwrap());
            assert!((fixed / stored - 1.0).abs() < rounding, "{key}: {fixed} {stored}");
        }
    }
    assert!(std::fs::read_to_string(report).unwrap().contains("Every parameter in its band"));

    let cleared = didim(&["baseline", "clear", "--state", &state]).done();
    assert_eq!(cleared, "the baseline is cleared\n");
    let shown = didim(&["baseline", "show", "--state", &state]);
    shown.refused(1, &["no baseline is set", "`didim baseline set`"]);
}

/// `--out`: a row for each parameter of each result.
fn rows_for_databases(folder: &Folder, state: &str) {
    let history = ["history", "--state", state, "--out"];
    let out = folder.path("history.csv");
    fn rows_with(more: &[&'static str], history: &[&str; 4], out: &str) -> Vec<Vec<String>> {
        didim(&[&history[..], &[out], more].concat()).done();
        let text = std::fs::read_to_string(out).unwrap();
        text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
    }
    let rows = rows_with(&[], &history, &out);
    assert_eq!(rows.len(), 1 + 2 * 28);
    let column = |name: &str| rows[0].iter().position(|own| own == name).unwrap();
    let text_at = |row: usize, name: &str| rows[row][column(name)].as_str();
    let lines = std::fs::read_to_string(Path::new(state).join("history.jsonl")).unwrap();
    let line = json(lines.lines().next().unwrap());
    for (row, parameter) in (1..).zip(line["parameters"].as_array().unwrap()) {
        assert_eq!(
            (text_at(row, "parameter"), text_at(row, "unit")),
            (text(&parameter["name"]), text(&parameter["unit"]))
        );
        for name in ["value", "standard_deviation", "combined_standard_deviation"] {
            let (own, stored) = (text_at(row, name).parse::<f64>().unwrap(), &parameter[name]);
            assert!((own / stored.as_f64().unwrap() - 1.0).abs() < 1e-12, "{own} {stored}");
        }
    }
    for (name, expected) in [
        ("cell", "tx40-cia402"),
        ("robot", "tx40"),
        ("result", "0"),
        ("method", "didim"),
        ("time", text(&line["time"])),
        ("configuration", text(&line["configuration"])),
        ("applicable", "true"),
        ("monitoring", "true"),
        ("prediction", "true"),
        // No verdict, and nothing noted.
        ("contact_detection", ""),
        ("payload_kg", ""),
        ("note", ""),
    ] {
        assert_eq!(text_at(1, name), expected, "{name}");
    }
    // Each result has one of its own, and it stays.
    let [first, second] = [text_at(1, "identity"), text_at(29, "identity")];
    assert!(first.len() == 64 && first != second && text_at(28, "identity") == first);
    let chosen = rows_with(&["--last", "1", "--parameter", "fc3"], &history, &out);
    assert_eq!(chosen.len(), 2);
    assert_eq!((chosen[1][0].as_str(), chosen[1][column("parameter")].as_str()), (second, "fc3"));

    let path = |name: &str| folder.path(name);
    didim(&[&history[..], &[&path("history.xlsx")]].concat()).refused(2, &["--out", ".parquet"]);
    let parquet = path("history.parquet");
    let written = didim(&[&history[..], &[&parquet]].concat());
    if cfg!(feature = "parquet") {
        written.done();
        assert_eq!(std::fs::read(parquet).unwrap()[..4], *b"PAR1");
    } else {
        written.refused(1, &["--features parquet", ".csv"]);
    }
}

fn text(value: &serde_json::Value) -> &str {
    value.as_str().unwrap()
}

/// The same log as of a day in 2026, and as it is: the simulated arm counts from 0.
#[test]
fn a_result_says_when_it_was_recorded_and_the_history_when_it_was_stored() {
    let folder = Folder::new();
    let (state, report) = (folder.path("state"), folder.path("report.html"));
    let undated = std::fs::read_to_string(&data().cia402_log).unwrap();
    let dated = undated.lines().map(|line| {
        let (seconds, rest) = line.strip_prefix('(').unwrap().split_once('.').unwrap();
        format!("({}.{rest}\n", 1_795_331_849 + seconds.parse::<u64>().unwrap())
    });
    let dated = folder.file("dated.log", &dated.collect::<String>());
    for log in [&dated, &dated, &data().cia402_log] {
        let replay = ["replay", "--cell", &cia402_cell(), log, "--state", &state, "--json"];
        didim(&[&replay[..], &["--report", &report]].concat()).done();
    }
    let result = |k: u32| {
        std::fs::read_to_string(Path::new(&state).join(format!("result-0000000{k}.json"))).unwrap()
    };
    assert_eq!(result(0), result(1), "the same recording, the same bytes");
    let recorded = json(&result(0))["window"]["recorded"].clone();
    assert!(recorded.as_str().unwrap().starts_with("2026-11-22T07:17:29."), "{recorded}");
    assert_eq!(json(&result(2))["window"].get("recorded"), None, "it has no date");
    let document = json(&didim(&["history", "--state", &state, "--json"]).done());
    let of_line = |k: usize| document["results"][k]["recorded"].clone();
    assert_eq!((of_line(0), of_line(2)), (recorded, serde_json::Value::Null));
    let table = didim(&["history", "--state", &state]).done();
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows[0].contains("recorded (UTC)") && rows[0].contains("stored (UTC)"), "{table}");
    assert!(rows[1].contains("2026-11-22 07:17") && rows[3].contains("not known"), "{table}");
    // Of the last, and of one that `identify` reads.
    let entry = "<dt>Recorded</dt><dd>without a date; the file was written 20";
    assert!(std::fs::read_to_string(&report).unwrap().contains(entry));
    let identify = ["identify", "--cell", &cia402_cell(), "--input", &dated];
    let text = didim(&[&identify[..], &["--report", &report]].concat()).done();
    assert!(text.contains("\nrecorded: 2026-11-22 07:17:29."), "{text}");
    let entry = "<dt>Recorded</dt><dd>2026-11-22 07:17:29.";
    assert!(std::fs::read_to_string(&report).unwrap().contains(entry));
    let output = json(&didim(&[&identify[..], &["--json"]].concat()).done());
    assert!(output["recorded"].as_str().unwrap().starts_with("2026-11-22T07:17:29."));
}

/// An arm whose third joint has worn: the simulated friction has grown, and the cell that
/// identifies knows nothing of it.
#[test]
fn worn_friction_is_found_by_its_name_and_size() {
    let folder = Folder::new();
    let state = folder.path("state");
    let worn = Configuration::with_edit("robots/tx40.toml", "fc3 = 6.48", "fc3 = 7.45");
    let worn = worn.path("cells/tx40-cia402.toml");
    // A shipped scenario has the shipped arm: as a file it takes that of the cell.
    let scenario = include_str!("../../../../sim-fixtures/scenarios/tx40-paper.toml");
    let scenario = folder.file("scenario.toml", scenario);
    fn replay(cell: &str, seed: &str, folder: &Folder, scenario: &str, state: &str) {
        let log = folder.path("drive.log");
        let bus = format!("log:{log}");
        let sim = ["sim", "--cell", cell, "--scenario", scenario, "--seed", seed, "--bus", &bus];
        didim(&sim).done();
        didim(&["replay", "--cell", &cia402_cell(), &log, "--state", state]).done();
    }
    replay(&cia402_cell(), "1", &folder, &scenario, &state);
    didim(&["baseline", "set", "--state", &state]).done();
    replay(&cia402_cell(), "2", &folder, &scenario, &state);
    fn alarms(state: &str) -> Vec<serde_json::Value> {
        let document = json(&didim(&["history", "--state", state, "--json"]).done());
        document["alarms"].as_array().unwrap().clone()
    }
    assert!(alarms(&state).is_empty(), "the arm is as it was");
    replay(&worn, "3", &folder, &scenario, &state);
    assert!(alarms(&state).is_empty(), "one result is none");
    replay(&worn, "4", &folder, &scenario, &state);
    let alarms = alarms(&state);
    assert_eq!(alarms.len(), 1, "{alarms:?}");
    assert_eq!(alarms[0]["parameter"], "fc3");
    let number = |key: &str| alarms[0][key].as_f64().unwrap();
    let (change, sigma) = (number("relative_change"), number("deviation_sigma"));
    let deviation = (change - (7.45 / 6.48 - 1.0)) * sigma / change;
    assert!(deviation.abs() < 4.0, "{deviation} σ from the truth: {alarms:?}");

    // The report of a stored result has the comparison of its time, and its alarms.
    let report = |number: &str, out: &[&str]| {
        let of = ["report", number, "--state", &state, "--cell", &cia402_cell()];
        didim(&[&of[..], out].concat()).done()
    };
    let drift = |number: &str| json(&report(number, &["--json"]))["drift"].clone();
    assert!(drift("0").is_null(), "the baseline itself");
    let alarmed = ["1", "2", "3"].map(|number| {
        let drift = drift(number);
        assert_eq!((&drift["baseline"], &drift["compared"]), (&0.into(), &true.into()));
        assert_eq!(drift["parameters"].as_array().unwrap().len(), 28);
        let alarms = drift["alarms"].as_array().unwrap().iter();
        alarms.map(|alarm| alarm["parameter"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    });
    assert_eq!(alarmed, [vec![], vec![], vec!["fc3".to_owned()]]);
    let page = folder.path("report.html");
    for (number, alarms) in [("2", 0), ("3", 1)] {
        report(number, &["--out", &page]);
        let html = std::fs::read_to_string(&page).unwrap();
        assert_eq!(html.matches("<p class=\"alarm\"><strong>Alarm: </strong>fc3").count(), alarms);
        assert_eq!(html.matches("No alarm is raised.").count(), 1 - alarms);
    }

    // The same in torque along a motion: 1 N·m where joint 3 moves, and chance everywhere else.
    let compare = ["history", "--state", &state, "--cell", &cia402_cell(), "--compare", "0", "3"];
    let along = ["--along", &folder.path("drive.log")];
    let text = didim(&[&compare[..], &along].concat()).done();
    assert!(text.contains("difference, rms") && text.contains("by chance"), "{text}");
    let document = json(&didim(&[&compare[..], &along, &["--json"]].concat()).done());
    let torques = document["difference"]["torques"].as_array().unwrap();
    assert_eq!(torques.len(), 6);
    for (joint, torque) in (1..).zip(torques) {
        let number = |key: &str| torque[key].as_f64().unwrap();
        let (rms, by_chance) = (number("rms"), number("by_chance"));
        if joint == 3 {
            assert!((0.6..1.0).contains(&rms) && rms > 10.0 * by_chance, "{torque}");
            assert!((0.9..1.3).contains(&number("largest").abs()), "{torque}");
        } else {
            assert!(rms < 3.0 * by_chance, "joint {joint}: {torque}");
        }
    }
    didim(&["history", "--state", &state, "--along", "x"]).refused(2, &["--compare", "--cell"]);
}

#[test]
fn what_is_not_there_is_said_with_what_is() {
    let folder = Folder::new();
    let empty = folder.path("");
    didim(&["history", "--state", &empty]).refused(1, &["no history in", "--state"]);
    didim(&["baseline", "set", "--state", &empty]).refused(1, &["didim: no history in"]);
    let state = replayed(&folder, 1);
    let set = didim(&["baseline", "set", "--state", &state, "7"]);
    set.refused(1, &["result 7 is not in the history; it has results 0 to 0"]);
    let unknown = didim(&["history", "--state", &state, "--parameter", "fc9"]);
    unknown.refused(2, &["no result has the parameter `fc9`", "fc1"]);
    didim(&["history", "--state", &state, "--compare", "0", "3"])
        .refused(1, &["result 3 is not in"]);
    // A result that may not be used is no baseline.
    let history = Path::new(&state).join("history.jsonl");
    let line = std::fs::read_to_string(&history).unwrap();
    std::fs::write(&history, line.replace("\"monitoring\":true", "\"monitoring\":false")).unwrap();
    let set = didim(&["baseline", "set", "--state", &state, "0"]);
    set.refused(1, &["result 0 is not usable for monitoring"]);
    didim(&["baseline", "set", "--state", &state])
        .refused(1, &["no result in the history is usable for monitoring"]);
}

#[test]
fn a_note_that_cannot_be_is_refused_before_it_is_sent() {
    didim(&["note"]).refused(2, &["nothing to note"]);
    didim(&["note", "--payload-kg", "-1"]).refused(2, &["a payload of -1 kg is impossible"]);
    didim(&["note", "--temperature-c", "400"])
        .refused(2, &["a temperature of 400 °C is impossible", "between -60 and 200 °C"]);
    let folder = Folder::new();
    let note = didim(&["note", "--text", "warm", "--runtime", &folder.path("")]);
    note.refused(1, &["no service at"]);
}
