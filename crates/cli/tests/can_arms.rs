//! Arms without a SYNC, by the shipped cells: simulated drives, their log, what is identified of
//! it.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use didim_dynamics::robot::Robot;
use didim_sim::Scenario;
use serde_json::Value;
use tempfile::TempDir;

use crate::program::{didim, json, repository, succeed};

struct Arm {
    folder: TempDir,
    cell: PathBuf,
    log: PathBuf,
    truth: BTreeMap<String, f64>,
}

/// The log of a simulated arm, and its truth.
fn simulated(name: &str) -> Arm {
    let folder = tempfile::tempdir().unwrap();
    let cell = repository(&format!("config/cells/{name}.toml"));
    let scenario = repository(&format!("sim-fixtures/scenarios/{name}.toml"));
    succeed(&[&"check", &"--other-machine", &"--cell", &cell]);
    let log = folder.path().join("arm.log");
    let bus = format!("log:{}", log.display());
    succeed(&[&"sim", &"--cell", &cell, &"--scenario", &scenario, &"--bus", &bus]);
    Arm { folder, cell, log, truth: truth(name) }
}

/// What is true of a simulated arm.
pub(crate) fn truth(name: &str) -> BTreeMap<String, f64> {
    let read = |path: String| fs::read_to_string(repository(&path)).unwrap();
    let robot = Robot::from_toml(&read(format!("config/robots/{name}.toml"))).unwrap();
    let scenario = read(format!("sim-fixtures/scenarios/{name}.toml"));
    Scenario::from_toml(&scenario, robot).unwrap().truth().iter().cloned().collect()
}

/// Number of temperature reports of each joint. The temperature is 30 °C at first and 1 °C higher
/// at each report.
fn temperatures(result: &Value, joints: u64) -> Vec<u64> {
    let temperatures = result["temperature"].as_array().unwrap();
    assert_eq!(temperatures.len() as u64, joints);
    (1..)
        .zip(temperatures)
        .map(|(joint, of): (u64, &Value)| {
            assert_eq!((of["joint"].as_u64(), of["unit"].as_str()), (Some(joint), Some("degC")));
            let [mean, minimum, maximum] =
                ["mean", "minimum", "maximum"].map(|key| of[key].as_f64().unwrap());
            #[allow(clippy::cast_precision_loss, reason = "a joint")]
            let start = 29.0 + joint as f64;
            assert!(start - 0.5 <= minimum && minimum <= mean && mean <= maximum, "{of}");
            assert!(maximum < start + 2.0, "{of}");
            of["readings"].as_u64().unwrap()
        })
        .collect()
}

fn identify(cell: &Path, log: &Path) -> String {
    succeed(&[&"identify", &"--cell", &cell, &"--input", &log, &"--json"])
}

/// Every parameter that is found well is true, and many are found well.
fn check(arm: &Arm, result: &str, (error, least_known): (f64, usize)) {
    let result = json(result);
    let error_found = result["relative_error"].as_f64().unwrap();
    assert!(error_found < error, "relative error {error_found}");
    let mut well = 0;
    for one in result["parameters"].as_array().unwrap() {
        let name = one["name"].as_str().unwrap();
        let number = |key: &str| one[key].as_f64().unwrap();
        let (value, sigma) = (number("value"), number("standard_deviation"));
        let truth = arm.truth[name];
        if sigma < 0.05 * truth.abs() {
            let off = (value - truth).abs();
            assert!(
                off < 5.0 * sigma + 0.05 * truth.abs(),
                "{name}: {value}, true {truth}, σ {sigma}"
            );
            well += 1;
        }
    }
    assert!(well >= least_known, "{well}");
}

/// DIDIM by the gains in the commands, compared with the same gains in the cell; and commands
/// without usable gains.
fn the_law_of_commands_is_the_controller(arm: &Arm) {
    let shipped = fs::read_to_string(&arm.cell).unwrap();
    let shipped = shipped.replace("\"../", &format!("\"{}/", repository("config").display()));
    let scenario = fs::read_to_string(repository("sim-fixtures/scenarios/openarm.toml")).unwrap();
    let controller_start = scenario.find("[controller]").unwrap();
    let controller = &scenario[controller_start..scenario.find("[simulation]").unwrap()];
    let controller = controller.replace("[controller]", "[controller]\nkind = \"cabinet\"");
    let law = shipped.lines().find(|line| line.starts_with("law = ")).unwrap();
    let texts = [&shipped, &(shipped.replace(law, "") + "\n" + &controller)];
    let cells = ["unidentifiable.toml", "stated.toml"].map(|name| arm.folder.path().join(name));
    cells.iter().zip(texts).for_each(|(cell, text)| fs::write(cell, text).unwrap());
    let parameters = cells.each_ref().map(|cell| {
        let didim = [&"--method" as &dyn AsRef<OsStr>, &"didim"];
        let input: [&dyn AsRef<OsStr>; 6] =
            [&"identify", &"--json", &"--cell", cell, &"--input", &arm.log];
        json(&succeed(&[&input[..], &didim].concat()))
    });
    let [reported, expected] = parameters.each_ref().map(|of| of["parameters"].as_array().unwrap());
    assert_eq!(reported.len(), expected.len());
    for (one, other) in reported.iter().zip(expected) {
        let number = |of: &Value, key: &str| of[key].as_f64().unwrap();
        let off = number(one, "value") - number(other, "value");
        // Motors that compute at every instant and every 0.2 ms differ by less than what both are
        // known to.
        assert!(off.abs() < 0.5 * number(other, "combined_standard_deviation"), "{one} {other}");
    }
    // Each result says which gains it was made with.
    let stiffness = &parameters[0]["stiffness"][3];
    assert_eq!((&stiffness["joint"], &stiffness["unit"]), (&4.into(), &"N·m/rad".into()));
    assert!((stiffness["mean"].as_f64().unwrap() - 150.0).abs() < 0.07, "{stiffness}");

    let log = fs::read_to_string(&arm.log).unwrap();
    let changed = |change: fn(&str, usize) -> String| {
        let lines = log.lines().enumerate().map(|(number, line)| match line.split_once("##1") {
            Some((head, data)) if head.ends_with(" 003") => {
                format!("{head}##1{}", change(data, number))
            }
            _ => line.to_owned(),
        });
        // A command of nothing is none.
        let lines = lines.filter(|line| !line.ends_with("##1"));
        let file = arm.folder.path().join("changed.log");
        fs::write(&file, lines.collect::<Vec<_>>().join("\n") + "\n").unwrap();
        let arguments: [&dyn AsRef<OsStr>; 8] = [
            &"identify",
            &"--json",
            &"--cell",
            &cells[0],
            &"--method",
            &"didim",
            &"--input",
            &file,
        ];
        let finished = didim(&arguments);
        assert_eq!(finished.code, Some(1), "{finished:?}");
        finished.stderr
    };
    // p16 v12 kp12 kd12 torque12: a third stiffness from the middle on, a speed that is none, a
    // torque.
    let gains = changed(|data, number| {
        let stiffness = if number > 45_000 { "400" } else { &data[7..10] };
        format!("{}{stiffness}{}", &data[..7], &data[10..])
    });
    assert!(gains.contains("the stiffness in the commands of joint 3 goes from 120.0"), "{gains}");
    let speed = changed(|data, _| format!("{}{}{}", &data[..4], "900", &data[7..]));
    assert!(speed.contains("joint 3 ask for") && speed.contains("neither zero"), "{speed}");
    let none = changed(|_, _| String::new());
    assert!(none.contains("have no control law or no target of joint 3"), "{none}");
    let torque = changed(|data, _| format!("{}900", &data[..13]));
    assert!(torque.contains("joint 3 add torques of"), "{torque}");
}

#[test]
fn an_openarm_is_identified_from_its_bus() {
    let arm = simulated("openarm");
    let result = identify(&arm.cell, &arm.log);
    check(&arm, &result, (0.1, 20));
    // Answers tell the temperature of their motor in each cycle; half a second at either end is
    // margin.
    let counted = json(&result)["samples"].as_u64().unwrap() - 500;
    assert_eq!(temperatures(&json(&result), 7), [counted; 7]);
    // The frames are those of the wire: a command, then its answer, and answers say that the motor
    // is enabled.
    let log = fs::read_to_string(&arm.log).unwrap();
    let ids: Vec<&str> =
        log.lines().take(14).map(|line| line.split([' ', '#']).nth(2).unwrap()).collect();
    let expected = "001 011 002 012 003 013 004 014 005 015 006 016 007 017";
    assert_eq!(ids.join(" "), expected);
    assert!(log.lines().all(|line| line.contains("##1")));

    the_law_of_commands_is_the_controller(&arm);

    // A register is read, and one answer does not come: both cost no more than a cycle.
    let mut lines: Vec<String> = log.lines().map(str::to_owned).collect();
    let middle = lines.len() / 28 * 14;
    assert!(lines[middle + 5].contains(" 013#"), "{}", lines[middle + 5]);
    lines.remove(middle + 5);
    let stamp = lines[middle + 1].split(' ').next().unwrap().to_owned();
    lines.insert(middle + 2, format!("{stamp} can0 7FF##10100331700000000"));
    lines.insert(middle + 3, format!("{stamp} can0 011##10100331700005842"));
    let disturbed = arm.folder.path().join("disturbed.log");
    fs::write(&disturbed, lines.join("\n") + "\n").unwrap();
    let finished = didim(&[&"identify", &"--cell", &arm.cell, &"--input", &disturbed, &"--json"]);
    assert_eq!(finished.code, Some(0), "{finished:?}");
    for cause in ["excepted 1", "unknown id 1", "missing axis 2"] {
        assert!(finished.stderr.contains(cause), "{cause}: {}", finished.stderr);
    }
    check(&arm, &finished.stdout, (0.1, 20));
}

#[test]
fn a_piper_is_identified_from_its_bus_and_its_replay_gives_the_same_bytes() {
    let arm = simulated("piper");
    let result = identify(&arm.cell, &arm.log);
    check(&arm, &result, (0.1, 15));
    let offline = json(&result);
    // 40 times a second, of 200; half a second at either end is margin.
    let counted = offline["samples"].as_u64().unwrap() - 200;
    let readings = temperatures(&offline, 6);
    assert!(readings.iter().all(|of| of.abs_diff(counted / 5) <= 1), "{readings:?} of {counted}");
    assert_eq!(offline["supply_voltage"][5]["mean"].as_f64(), Some(48.0));
    assert!(offline.get("drive_mode").is_none(), "nothing of it is on this bus");
    let replay = || {
        let state = tempfile::tempdir().unwrap();
        let arguments = [&"--cell" as &dyn AsRef<OsStr>, &arm.cell, &arm.log, &"--json"];
        let printed =
            succeed(&[&[&"replay" as _], &arguments[..], &[&"--state", &state.path()]].concat());
        let read = |file| fs::read_to_string(state.path().join(file)).unwrap();
        (printed, [read("latest.json"), read("history.jsonl")])
    };
    let (first, [result, history]) = replay();
    let (again, [result_again, _]) = replay();
    assert!(first == again && result == result_again);
    // What the result says of its window its line of the history says too.
    let (window, line) = (json(&result)["window"].clone(), json(history.lines().next().unwrap()));
    temperatures(&window, 6);
    for key in ["temperature", "supply_voltage"] {
        assert!(line[key].is_array() && line[key] == window[key], "{key}");
    }
    check(&arm, &first, (0.1, 15));
}

/// Without a load, and with one of a kilogram, by a cell that states the torque of joint 2 half as
/// large as it is and that of joint 5 with the other sign: both are found, and the lines that are
/// printed are those of the cell.
#[test]
fn gains_of_a_piper_are_found_by_a_load() {
    let folder = tempfile::tempdir().unwrap();
    let right = fs::read_to_string(repository("config/cells/piper.toml")).unwrap();
    let right = right.replace("\"../", &format!("\"{}/", repository("config").display()));
    let scenario = fs::read_to_string(repository("sim-fixtures/scenarios/piper.toml")).unwrap();
    let load = "\n[payload]\nmass_kg = 1.0\nposition_m = [0.05, 0.0, 0.16]\n";
    let [of_drives, expected, empty, loaded] =
        ["drives.toml", "cell.toml", "empty.log", "loaded.log"].map(|of| folder.path().join(of));
    fs::write(&of_drives, &right).unwrap();
    for (log, text) in [(&empty, scenario.clone()), (&loaded, scenario + load)] {
        let file = folder.path().join("scenario.toml");
        fs::write(&file, text).unwrap();
        let bus = format!("log:{}", log.display());
        succeed(&[&"sim", &"--cell", &of_drives, &"--scenario", &file, &"--bus", &bus]);
    }
    let mut drives: Vec<&str> = right.split("[[bus.drives]]").collect();
    let (second, fifth) = (
        drives[2].replace("nm_per_a = 4.725", "nm_per_a = 2.3625"),
        drives[5].replace("}, sign = 1", "}, sign = -1"),
    );
    (drives[2], drives[5]) = (&second, &fifth);
    fs::write(&expected, drives.join("[[bus.drives]]")).unwrap();
    let arguments: [&dyn AsRef<OsStr>; 9] = [
        &"gains",
        &"--cell",
        &expected,
        &"--input",
        &empty,
        &"--loaded",
        &loaded,
        &"--declared-mass-kg",
        &"1.0",
    ];
    let centre: [&dyn AsRef<OsStr>; 2] = [&"--declared-centre-m", &"0.05,0,0.16"];
    let printed = succeed(&[&arguments[..], &centre].concat());
    let gains = json(&succeed(&[&arguments[..], &centre, &[&"--json"]].concat()));
    let truth = [4.725, 4.725, 4.725, 0.95844, -0.95844, 0.95844];
    let mut found_gains = 0;
    for (gain, truth) in gains["gains"].as_array().unwrap().iter().zip(truth) {
        let Some(value) = gain["found"]["value"].as_f64() else { continue };
        let sigma = gain["found"]["standard_deviation"].as_f64().unwrap();
        assert!((value - truth).abs() < 5.0 * sigma + 0.02 * truth.abs(), "{gain}");
        assert!(printed.contains(gain["cell_line"].as_str().unwrap()), "{printed}");
        found_gains += 1;
    }
    assert!(found_gains >= 4, "{printed}");
    // Without the load, by the stated gain of one drive; the ratio to it is that of the true ones.
    let alone = json(&succeed(&[&arguments[..5], &[&"--json"]].concat()));
    let reference = usize::try_from(alone["reference"].as_u64().unwrap()).unwrap() - 1;
    let stated_gains = [4.725, 2.3625, 4.725, 0.95844, 0.95844, 0.95844];
    let scale = truth[reference] / stated_gains[reference];
    assert_eq!(alone["load"], Value::Null);
    let of_second = &alone["gains"][1]["found"];
    let [value, sigma] =
        ["value", "standard_deviation"].map(|key| of_second[key].as_f64().unwrap() * scale);
    assert!((value - 4.725).abs() < 5.0 * sigma.abs() + 0.1, "{alone}");
    // The same record twice has no load.
    let nothing = [&"gains" as &dyn AsRef<OsStr>, &"--cell", &expected, &"--input", &empty];
    let nothing = didim(
        &[&nothing[..], &[&"--loaded", &empty, &"--declared-mass-kg", &"1.0"], &centre].concat(),
    );
    assert_eq!(nothing.code, Some(1), "{nothing:?}");
    let why = "do not identify the gains of joints 1";
    assert!(nothing.stderr.contains(why) && nothing.stdout.is_empty(), "{nothing:?}");
}

/// Joints of a RealMan arm on their own bus, by their DBC file: no such arm is described in
/// `config/robots`, so that another of seven axes stands for it.
#[test]
fn a_cell_of_realman_joints_is_checked_and_decodes() {
    let folder = tempfile::tempdir().unwrap();
    let shipped = fs::read_to_string(repository("config/cells/openarm.toml")).unwrap();
    let (head, rest) = shipped.split_once("[bus.layout]").unwrap();
    let (_, tail) = rest.split_once("# A window begins").unwrap();
    let config = repository("config").display().to_string();
    let mut text = head.replace("../robots/openarm", "../robots/iiwa7");
    text += r#"[bus.layout]
dbc = "../dbc/realman_joint.dbc"
axes = 7
rate_hz = 200.0
sync = "ServoCommand_1"
position = { signal = "ServoFeedback_{axis}.Position", valid = "arrival" }
torque = { signal = "ServoFeedback_{axis}.Current", valid = "arrival" }
reference = { signal = "ServoCommand_{axis}.TargetPosition", valid = "arrival" }
enabled = { signal = "ServoFeedback_{axis}.Enabled", is = 1 }
"#;
    for _ in 0..7 {
        text += r#"
[[bus.drives]]
position = { scale = "deg", sign = 1, zero = 0.0, wraps = "refuse", provenance = "vendor's page" }
torque = { scale = { nm_per_a = 2.5 }, sign = 1, provenance = "assumed" }
"#;
    }
    let text = text.replace("\"../", &format!("\"{config}/")) + "\n# A window begins" + tail;
    let text = text.replace("factor = 30", "factor = 12");
    let cell = folder.path().join("cell.toml");
    fs::write(&cell, text).unwrap();
    succeed(&[&"check", &"--other-machine", &"--cell", &cell]);
    // A table as the frames of these joints, and back.
    let header: Vec<String> = ["position_rad", "torque_nm", "reference_rad"]
        .iter()
        .flat_map(|what| (1..=7).map(move |axis| format!("motor_{what}_{axis}")))
        .collect();
    let mut table = format!("time_s,{}\n", header.join(","));
    for k in 0..400 {
        let t = f64::from(k) / 200.0;
        let cells = (0..21).map(|j| format!("{:.6}", (t + f64::from(j)).sin()));
        table += &format!("{t:.3},{}\n", cells.collect::<Vec<_>>().join(","));
    }
    let [input, log, output] =
        ["in.csv", "arm.log", "out.csv"].map(|name| folder.path().join(name));
    fs::write(&input, &table).unwrap();
    succeed(&[&"convert", &"--cell", &cell, &input, &log]);
    assert!(fs::read_to_string(&log).unwrap().contains(" 507##1"));
    succeed(&[&"convert", &"--cell", &cell, &log, &output]);
    let rows = |text: &str| -> Vec<Vec<f64>> {
        let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
        text.lines().skip(1).map(row).collect()
    };
    let (sent, read) = (rows(&table), rows(&fs::read_to_string(&output).unwrap()));
    assert_eq!(sent.len(), read.len());
    for (sent, read) in sent.iter().zip(&read) {
        let (sent, read) = (&sent[1..], &read[1..]);
        for (k, (sent, read)) in sent.iter().zip(read).enumerate() {
            // Half a step of 0.0001 deg, and of 1 mA.
            let tolerance = if (7..14).contains(&k) { 1.26e-3 } else { 1e-6 };
            assert!((sent - read).abs() < tolerance, "{sent} {read}");
        }
    }
}
