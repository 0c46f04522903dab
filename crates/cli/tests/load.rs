//! A load that the simulated arm picks up and keeps, through the whole pipeline.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::expectation::Expectation;
use crate::program::{Installation, command, json, repository, succeed};
use serde_json::Value;

/// The load \[kg\].
const MASS: f64 = 1.5;
const LOADED: &str =
    "samples = 34500\npayload = { mass_kg = 1.5, position_m = [0.02, -0.03, 0.08] }";

/// A cell that identifies all base parameters: a load changes many that are not essential.
fn cell() -> Installation {
    let file = repository("config/cells/tx40-packed-fd.toml");
    let shipped = fs::read_to_string(file).unwrap();
    let start = shipped.find("# The essential parameters").unwrap();
    let end = start + shipped[start..].find("\n]\n").unwrap() + 3;
    Installation::from_cell("tx40-packed-fd", &[(&shipped[start..end], "")])
}

/// The frames of these cycles of the motion, by a noise of its own.
fn log(cell: &Installation, name: &str, cycles: usize, seed: usize, loaded: bool) -> PathBuf {
    let (cycles, seed) = (format!("cycles = {cycles}"), format!("seed = {seed}\nd"));
    let payload_samples = if loaded { LOADED } else { "samples = 34500" };
    let changes = [
        ("cycles = 1", cycles.as_str()),
        ("seed = 1\nd", seed.as_str()),
        ("samples = 34500", payload_samples),
    ];
    let (scenario, log) = (cell.scenario(&changes), cell.path(name));
    let bus = format!("log:{}", log.display());
    succeed(&[&"sim", &"--cell", &cell.cell(), &"--bus", &bus, &"--scenario", &scenario]);
    log
}

/// What a replay logs, as a service does.
fn replay(cell: &Installation, log: &Path) -> String {
    let replay = command(&[&"replay", &"--cell", &cell.cell(), &log, &"--state", &cell.state()])
        .env("RUST_LOG", "info")
        .output()
        .unwrap();
    let messages = String::from_utf8(replay.stderr).unwrap();
    assert!(replay.status.success(), "{messages}");
    messages
}

fn history(cell: &Installation) -> Vec<Value> {
    let text = fs::read_to_string(cell.state().join("history.jsonl")).unwrap();
    text.lines().map(json).collect()
}

/// How far a mass is from the truth, in its standard deviations, which are small.
fn off(mass: &Value, truth: f64) -> f64 {
    let [value, sigma] = ["value", "standard_deviation"].map(|key| mass[key].as_f64().unwrap());
    assert!(sigma < 0.2, "{mass}");
    (value - truth) / sigma
}

#[test]
fn a_load_is_reported_once_it_is_picked_up_and_none_before() {
    let cell = cell();
    replay(&cell, &log(&cell, "empty.log", 1, 1, false));
    assert!(history(&cell)[0].get("load").is_none(), "there was no baseline");
    succeed(&[&"baseline", &"set", &"--state", &cell.state()]);

    // Of three motions the second is half way when the load comes.
    let [empty, loaded] = [("before.log", 2, false), ("after.log", 3, true)]
        .map(|(name, seed, loaded)| fs::read_to_string(log(&cell, name, 3, seed, loaded)).unwrap());
    let half_way = 39_700 + 2_500 + 17_250;
    let lines = empty.lines().take(half_way).chain(loaded.lines().skip(half_way));
    let picked_up = cell.path("picked-up.log");
    fs::write(&picked_up, lines.map(|line| format!("{line}\n")).collect::<String>()).unwrap();
    let messages = replay(&cell, &picked_up);
    let lines = history(&cell);
    let [_, before, changing, after] = lines.as_slice() else { panic!("{}", lines.len()) };
    let (before, change, after) = (&before["load"], &changing["load"]["changed"], &after["load"]);
    assert_eq!((&before["baseline"], &before["presence"]["seen"]), (&0.into(), &false.into()));
    assert!(off(&before["mass_kg"], 0.0).abs() < 3.0 && before.get("changed").is_none());
    // Parts of two seconds.
    let after_s = change["after_s"].as_f64().unwrap();
    assert!((3.0..6.0).contains(&after_s), "{change}");
    let expected = Expectation::of("payload-half-way");
    let most_kg = expected.get("off_by_at_most_kg");
    assert!(off(&change["from_kg"], 0.0).abs() < most_kg);
    assert!(off(&change["to_kg"], MASS).abs() < most_kg);
    assert_eq!(after["presence"]["seen"], true);
    assert!(off(&after["mass_kg"], MASS).abs() < 3.0 && after.get("changed").is_none());

    // Reported once, while it moves.
    let load_messages: Vec<&str> =
        messages.lines().filter(|line| line.contains("load on the")).collect();
    let [none, change] = load_messages.as_slice() else { panic!("{load_messages:?}") };
    assert!(none.contains("the load on the flange: none"), "{none}");
    assert!(change.contains("has changed: none before, 1."), "{change}");
    let table = succeed(&[&"history", &"--state", &cell.state()]);
    expected.assert_said(&table, &[]);
}
