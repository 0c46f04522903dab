//! `didim new`: a cell file from an arm and a table of it, whose names and units hide more or less.
//! What the files do not tell is asked, and nothing is found or assumed wrongly.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::program::{Finished, didim, json, repository, succeed};
use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::Robot;
use tempfile::TempDir;

/// An arm of two links in a vertical plane, with friction.
pub(crate) const URDF: &str = r#"<robot name="two">
<link name="base"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<origin xyz="0 0 0.5"/><limit lower="-2" upper="2" velocity="4" effort="200"/>
<dynamics damping="3" friction="4"/></joint>
<link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="8"/>
<inertia ixx="0.02" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/>
<origin xyz="0.4 0 0"/><limit lower="-2.5" upper="2.5" velocity="6" effort="80"/>
<dynamics damping="1" friction="2"/></joint>
<link name="lower"><inertial><origin xyz="0.15 0 0"/><mass value="4"/>
<inertia ixx="0.01" iyy="0.06" izz="0.06" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"#;

/// 20 s at 200 Hz: time \[s\], positions \[rad\], torques \[N·m\].
pub(crate) fn motion(robot: &Path) -> Vec<[f64; 5]> {
    let robot = Robot::from_toml(&succeed(&[&"robot", &robot, &"--toml"])).unwrap();
    motion_of(&robot, &Model::new(&robot))
}

/// The same of another model of the robot.
pub(crate) fn motion_of(robot: &Robot, model: &Model) -> Vec<[f64; 5]> {
    let mut workspace = Workspace::new();
    let parameters = robot.nominal().unwrap().standard_parameters();
    (0..4000)
        .map(|k: u32| {
            let t = f64::from(k) / 200.0;
            // Amplitude [rad], angular frequency [rad/s]: sums of two, not in step.
            fn sum(parts: [[f64; 2]; 2], t: &f64) -> [f64; 3] {
                let derivative = |order: i32, wave: fn(f64) -> f64| -> f64 {
                    parts.iter().map(|[a, w]| a * w.powi(order) * wave(w * *t)).sum()
                };
                [derivative(0, f64::sin), derivative(1, f64::cos), -derivative(2, f64::sin)]
            }
            let [shoulder, elbow] =
                [sum([[0.9, 1.3], [0.4, 3.1]], &t), sum([[1.1, 1.9], [0.5, 2.7]], &t)];
            let [q, dq, ddq] = [0, 1, 2].map(|order: usize| [shoulder[order], elbow[order]]);
            let mut tau = [0.0; 2];
            model.inverse_dynamics(&mut workspace, parameters, &q, &dq, &ddq, &mut tau);
            [t, q[0], q[1], tau[0], tau[1]]
        })
        .collect()
}

/// A folder with the arm and a table with these names and factors.
pub(crate) fn folder(names: [&str; 5], factors: [f64; 5]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let robot = folder.path().join("arm.urdf");
    fs::write(&robot, URDF).unwrap();
    let mut table = format!("mode,{}\n", names.join(","));
    for row in motion(&robot) {
        let values =
            row.iter().zip(factors).map(|(value, factor)| format!("{:.7}", value * factor));
        writeln!(table, "auto,{}", values.collect::<Vec<_>>().join(",")).unwrap();
    }
    fs::write(folder.path().join("log.csv"), table).unwrap();
    folder
}

pub(crate) fn new(folder: &Path, further: &[&str]) -> Finished {
    let [cell, robot, log] = ["cell.toml", "arm.urdf", "log.csv"].map(|file| folder.join(file));
    let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
        vec![&"new", &cell, &"--robot", &robot, &"--log", &log];
    further.iter().for_each(|argument| arguments.push(argument));
    didim(&arguments)
}

pub(crate) const RAD: [f64; 5] = [1.0; 5];
const DEG: [f64; 5] = [1e3, 57.295_779_513_082_32, 57.295_779_513_082_32, 1.0, 1.0];

/// What is asked where nobody knows on which side of the gears it was measured.
const UNKNOWN_SIDE: [&str; 6] = [
    "urdf.drive_inertia",
    "urdf.gear_ratios",
    "data.side",
    "data.position.unit",
    "data.torque.unit",
    "data.torque.sign",
];

#[test]
fn what_a_table_shows_is_found_and_the_rest_is_asked() {
    let table_with = |torque: f64| [1.0, 1.0, 1.0, torque, torque];
    // Names, factors, what has to be found or assumed, what has to be asked.
    type Case = ([&'static str; 5], [f64; 5], &'static [&'static str], &'static [&'static str]);
    let cases: [Case; 10] = [
        (
            ["t_ms", "J1 pos [deg]", "J2 pos [deg]", "J1 torque [Nm]", "J2 torque [Nm]"],
            DEG,
            &[
                "time.unit = \"ms\"",
                "position.column = \"J{axis} pos [deg]\"",
                "position.unit = \"deg\"",
                "side = \"joint\"",
                "torque.unit = \"Nm\"",
                "torque.sign = 1",
            ],
            &["urdf.drive_inertia"],
        ),
        // No unit anywhere, efforts that the joints exert.
        (
            ["timestamp", "actual_q_0", "actual_q_1", "effort_0", "effort_1"],
            table_with(-1.0),
            &[
                "time.unit = \"s\"",
                "position.column = \"actual_q_{index}\"",
                "position.unit = \"rad\"",
                "torque.unit = \"Nm\"",
                "torque.sign = -1",
            ],
            &["urdf.drive_inertia"],
        ),
        (
            ["time", "shoulder_position", "elbow_position", "shoulder_torque", "elbow_torque"],
            table_with(1e3),
            &[
                "position.columns = [\"shoulder_position\", \"elbow_position\"]",
                "torque.unit = \"mNm\"",
            ],
            &["urdf.drive_inertia"],
        ),
        // Of motors: the arm's limits say nothing of units, and torques have no size.
        (
            ["time", "q1", "q2", "tau1", "tau2"],
            [1.0, 100.0, 80.0, 0.01, 0.0125],
            &[
                "time.unit = \"s\"",
                "position.column = \"q{axis}\"",
                "torque.column = \"tau{axis}\"",
            ],
            &UNKNOWN_SIDE,
        ),
        // Currents.
        (
            ["time", "joint_pos_1", "joint_pos_2", "joint_current_1", "joint_current_2"],
            table_with(0.07),
            &["torque.unit = \"A\""],
            &[
                "urdf.drive_inertia",
                "urdf.gear_ratios",
                "data.side",
                "data.position.unit",
                "data.torque.per_ampere",
                "data.torque.sign",
            ],
        ),
        (
            ["time", "q_1_rad", "q_2_rad", "current_1_mA", "current_2_mA"],
            table_with(70.0),
            &["position.unit = \"rad\"", "torque.unit = \"mA\""],
            &[
                "urdf.drive_inertia",
                "urdf.gear_ratios",
                "data.side",
                "data.torque.per_ampere",
                "data.torque.sign",
            ],
        ),
        // Units as people write them; a rate of an odd number of milliseconds is another test's.
        (
            ["t [us]", "A1 pos (deg)", "A2 pos (deg)", "A1 tau [mNm]", "A2 tau [mNm]"],
            [1e6, DEG[1], DEG[2], 1e3, 1e3],
            &[
                "time.unit = \"us\"",
                "position.unit = \"deg\"",
                "torque.unit = \"mNm\"",
                "side = \"joint\"",
            ],
            &["urdf.drive_inertia"],
        ),
        // The names say what gravity says otherwise.
        (
            ["time", "q1", "q2", "tau1_Nm", "tau2_Nm"],
            table_with(1e3),
            &["side = \"joint\""],
            &["urdf.drive_inertia", "data.torque.unit"],
        ),
        // Angles of the joints and currents of the motors.
        (
            ["time", "q1", "q2", "motor_current_1 [pct]", "motor_current_2 [pct]"],
            table_with(70.0),
            &[],
            &UNKNOWN_SIDE,
        ),
        // Nothing that could be a torque.
        (
            ["time", "q1", "q2", "x1", "x2"],
            RAD,
            &["position.column = \"q{axis}\""],
            &[
                "urdf.drive_inertia",
                "urdf.gear_ratios",
                "data.side",
                "data.position.unit",
                "data.torque.column",
                "data.torque.unit",
                "data.torque.sign",
            ],
        ),
    ];
    for (names, factors, found, asked) in cases {
        let folder = folder(names, factors);
        let Finished { code, stdout, stderr } = new(folder.path(), &[]);
        assert_eq!(code, Some(0), "{stderr}");
        let cell = folder.path().join("cell.toml");
        let text = fs::read_to_string(&cell).unwrap();
        for line in found.iter().chain(&["robot = \"arm.urdf\"", "rate_hz = 200.0"]) {
            assert!(text.lines().any(|own| own == *line), "{line}:\n{text}");
        }
        let mut missing: Vec<&str> = stdout
            .lines()
            .filter_map(|line| line.strip_prefix("missing  ")?.split_once(':'))
            .map(|(key, _)| key)
            .collect();
        missing.sort_unstable();
        let mut asked = asked.to_vec();
        asked.sort_unstable();
        assert_eq!(missing, asked, "{stdout}");
        // The check lists all of them, with their lines.
        let check = didim(&[&"check", &"--cell", &cell, &"--other-machine"]);
        assert_eq!(check.code, Some(78), "{}", check.stderr);
        assert!(
            asked.iter().all(|key| check.stderr.contains(&format!(": {key}: "))),
            "{}",
            check.stderr
        );
    }
}

/// Rates are those of the times: of 12 ms, of 2.5 ms that are written as 2 and 3, of a tenth of a
/// second.
#[test]
fn a_rate_is_not_rounded_and_a_slow_log_is_not_a_fast_one() {
    let names = ["time", "q1", "q2", "tau1", "tau2"];
    fn table(step_ms: f64, decimals: usize, names: &[&str; 5]) -> (String, TempDir) {
        let folder = folder(*names, RAD);
        let log = folder.path().join("log.csv");
        let text = fs::read_to_string(&log).unwrap();
        let mut rows = text.lines();
        let mut table = rows.next().unwrap().to_owned() + "\n";
        for (k, row) in rows.enumerate() {
            let fields: Vec<&str> = row.split(',').collect();
            #[expect(clippy::cast_precision_loss, reason = "rows")]
            let time = k as f64 * step_ms * 1e-3;
            writeln!(table, "auto,{time:.decimals$},{}", fields[2..].join(",")).unwrap();
        }
        fs::write(log, table).unwrap();
        let made = new(folder.path(), &[]);
        assert_eq!(made.code, Some(0), "{}", made.stderr);
        (made.stdout, folder)
    }
    for (step_ms, decimals, rate) in [(12.0, 4, 83.333), (2.5, 3, 400.0), (2.5, 6, 400.0)] {
        let (said, _folder) = table(step_ms, decimals, &names);
        let line = said.lines().find(|line| line.contains("data.rate_hz = ")).unwrap();
        let rate_hz: f64 =
            line.split("= ").nth(1).unwrap().split(':').next().unwrap().parse().unwrap();
        assert!((rate_hz / rate - 1.0).abs() < 1e-3, "{line}");
    }
    let (said, folder) = table(100.0, 3, &names);
    for key in ["data.rate_hz", "data.time.unit"] {
        assert!(said.contains(&format!("missing  {key}: ")), "{said}");
    }
    fs::remove_file(folder.path().join("cell.toml")).unwrap();
    let made = new(folder.path(), &["--set", "data.time.unit=s"]);
    assert!(made.stdout.contains("found    data.rate_hz = 10.0"), "{}", made.stdout);
}

#[test]
fn from_urdf_and_log_to_the_report_in_three_commands() {
    let names = ["t_ms", "shoulder pos", "elbow pos", "shoulder torque", "elbow torque"];
    let folder = folder(names, DEG);
    let path_of = |name: &str| folder.path().join(name);
    let (cell, log, report) = (path_of("cell.toml"), path_of("log.csv"), path_of("report.html"));
    let made = new(folder.path(), &["--set", "urdf.drive_inertia=false"]);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    assert!(made.stdout.contains("next: didim identify --cell "), "{}", made.stdout);
    let checked = json(&succeed(&[&"check", &"--json", &"--cell", &cell, &"--other-machine"]));
    assert_eq!((&checked["sound"], &checked["findings"]), (&true.into(), &serde_json::json!([])));
    let result = json(&succeed(&[
        &"identify",
        &"--json",
        &"--cell",
        &cell,
        &"--input",
        &log,
        &"--report",
        &report,
    ]));
    assert!(fs::read_to_string(&report).unwrap().contains("<html"));
    fn value(name: &str, result: &serde_json::Value) -> f64 {
        let parameters = result["parameters"].as_array().unwrap();
        parameters.iter().find(|one| one["name"] == name).unwrap()["value"].as_f64().unwrap()
    }
    // As in the URDF.
    for (name, configured) in [("fv1", 3.0), ("fc1", 4.0), ("fv2", 1.0), ("fc2", 2.0)] {
        assert!(
            (value(name, &result) / configured - 1.0).abs() < 0.02,
            "{name}: {}",
            value(name, &result)
        );
    }
    // The cell leaves the cut-off to the recording. Its stored result has a report all the same.
    let state = path_of("state");
    let stored: [&dyn AsRef<std::ffi::OsStr>; 7] =
        [&"identify", &"--cell", &cell, &"--input", &log, &"--state", &state];
    succeed(&stored);
    let page = path_of("stored.html");
    succeed(&[&"report", &"0", &"--cell", &cell, &"--state", &state, &"--out", &page]);
    assert!(fs::read_to_string(&page).unwrap().contains("<html"));
}

#[test]
fn answers_of_the_wrong_type_are_all_named_next_to_what_is_open() {
    let folder = folder(["time", "q1", "q2", "tau1", "tau2"], RAD);
    let answers = ["--set", "data.side=left", "--set", "urdf.gear_ratios=one"];
    let made = new(folder.path(), &answers);
    assert_eq!(made.code, Some(78), "{}", made.stderr);
    for part in
        [": urdf.drive_inertia: ", "\nand 2 wrong:", ": data.side: ", ": urdf.gear_ratios: "]
    {
        assert!(made.stderr.contains(part), "{part}: {}", made.stderr);
    }
    // Nothing that `check` refuses is written; with the same values written by hand it lists them.
    let cell = folder.path().join("cell.toml");
    assert!(!cell.exists());
    assert_eq!(new(folder.path(), &[]).code, Some(0));
    let text = fs::read_to_string(&cell).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (key, line) in [("side = ", "side = \"left\""), ("gear_ratios = ", "gear_ratios = \"one\"")]
    {
        let own = lines.iter_mut().find(|own| own.starts_with(key)).unwrap();
        *own = line.to_owned();
    }
    fs::write(&cell, lines.join("\n")).unwrap();
    let check = didim(&[&"check", &"--cell", &cell, &"--other-machine", &"--json"]);
    assert!(check.stderr.contains("\nand 2 wrong:"), "{}", check.stderr);
    let findings = &json(&check.stdout)["findings"];
    let keys: Vec<&str> =
        findings.as_array().unwrap().iter().map(|one| one["key"].as_str().unwrap()).collect();
    assert!(keys.contains(&"data.side") && keys.contains(&"urdf.drive_inertia"), "{keys:?}");
}

/// A first column that advances steadily is the time, and its name has the unit.
#[test]
fn a_time_that_no_name_shows_has_the_unit_in_its_name() {
    let names = ["duration [ms]", "q1 [rad]", "q2 [rad]", "tau1 [Nm]", "tau2 [Nm]"];
    let folder = folder(names, [1e3, 1.0, 1.0, 1.0, 1.0]);
    let log = folder.path().join("log.csv");
    let table = fs::read_to_string(&log).unwrap();
    let rows = table.lines().map(|line| line.split_once(',').unwrap().1.to_owned() + "\n");
    fs::write(&log, rows.collect::<String>()).unwrap();
    let made = new(folder.path(), &["--set", "urdf.drive_inertia=false"]);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    for line in ["found    data.rate_hz = 200.0", "found    data.time.unit = \"ms\""] {
        assert!(made.stdout.contains(line), "{line}: {}", made.stdout);
    }
}

/// Whatever is open of a table, an answer that no cell can have is refused, and nothing is written.
#[test]
fn a_wrong_answer_is_refused_while_others_are_open() {
    let folder = folder(["time", "q1", "q2", "tau1", "tau2"], RAD);
    let cell = folder.path().join("cell.toml");
    for (answer, key) in [
        ("name=", "name"),
        ("data.torque.sign=0", "data.torque"),
        ("data.rate_hz=-3", "data.rate_hz"),
        ("urdf.gear_ratios=[100,100,100]", "urdf.gear_ratios"),
        ("data.position.unit=degree", "data.position"),
        ("identification.position_filter.cutoff_hz=-1", "identification.position_filter"),
        ("identification.decimation_filter.factor=0", "identification"),
    ] {
        let made = new(folder.path(), &["--set", answer]);
        assert_eq!(made.code, Some(78), "{answer}: {}", made.stdout);
        assert!(made.stderr.contains(key), "{answer}: {}", made.stderr);
        assert!(!cell.exists(), "{answer}");
    }
    for answer in ["data.position.column=p{axis}", "data.torque.columns=[5,99]"] {
        let made = new(folder.path(), &["--set", answer]);
        assert_eq!(made.code, Some(78), "{answer}: {}", made.stdout);
        assert!(made.stderr.contains("available: mode time q1"), "{answer}: {}", made.stderr);
    }
    let made = new(folder.path(), &["--set", "data.position.column=[q1]"]);
    assert!(made.stderr.contains("each of the 2 axes, not 1"), "{}", made.stderr);
    // What is open stays open.
    let made = new(folder.path(), &["--set", "identification.position_filter.cutoff_hz=60"]);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    assert!(made.stdout.contains("missing  urdf.drive_inertia"), "{}", made.stdout);
}

/// Columns without names: a list answers the question for their name, with `columns =` or without.
#[test]
fn numbers_of_columns_answer_the_question_for_their_name() {
    let folder = folder(["time", "q1", "q2", "tau1", "tau2"], RAD);
    let log = folder.path().join("log.csv");
    let table = fs::read_to_string(&log).unwrap();
    let rows = table.lines().skip(1).map(|line| line.replace("auto", "7") + "\n");
    fs::write(&log, rows.collect::<String>()).unwrap();
    let answers = ["data.position.column=[3, 4]", "data.torque.column=columns = [5, 6]"];
    let further = ["urdf.drive_inertia=false", "data.time.column=2", "data.side=joint"];
    let all: Vec<&str> =
        answers.iter().chain(&further).flat_map(|answer| ["--set", *answer]).collect();
    let made = new(folder.path(), &all);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    for line in ["stated   data.position.columns = [3, 4]", "stated   data.torque.columns = [5, 6]"]
    {
        assert!(made.stdout.contains(line), "{line}: {}", made.stdout);
    }
}

/// Lists in fields, with the names of their joints in another order than the arm's.
#[test]
fn lists_are_matched_with_the_names_of_their_joints() {
    let folder = folder(["time", "q1", "q2", "tau1", "tau2"], RAD);
    let log = folder.path().join("log.csv");
    let mut table = "time,name,position,effort\n".to_owned();
    for line in fs::read_to_string(&log).unwrap().lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let [_, time, q1, q2, tau1, tau2] = fields[..] else { panic!("{line}") };
        let names = "\"['elbow', 'gripper', 'shoulder']\"";
        let row = format!("{time},{names},\"[{q2}, 0.1, {q1}]\",\"[{tau2}, 0.0, {tau1}]\"");
        writeln!(table, "{row}").unwrap();
    }
    fs::write(&log, table).unwrap();
    let made = new(folder.path(), &["--set", "urdf.drive_inertia=false"]);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    for line in [
        "data.position.columns = [\"position[2]\", \"position[0]\"]",
        "data.torque.columns = [\"effort[2]\", \"effort[0]\"]",
        "data.torque.unit = \"Nm\"",
    ] {
        assert!(made.stdout.contains(line), "{line}: {}", made.stdout);
    }
}

/// InfluxDB without a pivot: the name of a value is in its row.
#[test]
fn a_table_with_one_value_in_each_row_is_named() {
    let folder = folder(["time", "q1", "q2", "tau1", "tau2"], RAD);
    let log = folder.path().join("log.csv");
    let mut table = "#group,false,false,true,true,false,false,true,true\n\
        #datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,\
        string\n#default,_result,,,,,,,\n\
        ,result,table,_start,_stop,_time,_value,_field,_measurement\n"
        .to_owned();
    let instant = |second: u32| format!("2023-11-14T22:13:{second:02}Z");
    for second in 0..50 {
        for field in ["q1", "q2", "tau1", "tau2"] {
            let [start, stop, time] = [0, 59, second].map(instant);
            writeln!(table, ",,0,{start},{stop},{time},0.25,{field},arm").unwrap();
        }
    }
    fs::write(&log, table).unwrap();
    let made = new(folder.path(), &[]);
    assert_eq!(made.code, Some(78), "{}", made.stdout);
    assert!(made.stderr.contains("a pivot"), "{}", made.stderr);
}

/// Names as a list in another form, below the first row, or of another arm; and a list of names
/// next to columns with numbers.
#[test]
fn lists_of_names_have_several_forms() {
    let folder = folder(["time", "q1", "q2", "tau1", "tau2"], RAD);
    let log = folder.path().join("log.csv");
    let text = fs::read_to_string(&log).unwrap();
    let reversed = "data.position.columns = [\"position[1]\", \"position[0]\"]";
    for (names, first, expected) in [
        ("('elbow', 'shoulder')", false, reversed),
        ("['elbow' 'shoulder']", false, reversed),
        ("['arm/elbow', 'arm/shoulder']", false, reversed),
        ("['elbow', 'shoulder']", true, reversed),
        ("['joint_a', 'joint_b']", false, "missing  data.position.column"),
    ] {
        let mut table = "time,names,position,effort\n".to_owned();
        if first {
            table += "0,,,\n";
        }
        for line in text.lines().skip(1) {
            let fields: Vec<&str> = line.split(',').collect();
            let [_, time, q1, q2, tau1, tau2] = fields[..] else { panic!("{line}") };
            writeln!(table, "{time},\"{names}\",\"[{q2}, {q1}]\",\"[{tau2}, {tau1}]\"").unwrap();
        }
        fs::write(&log, table).unwrap();
        let made = new(folder.path(), &[]);
        assert_eq!(made.code, Some(0), "{names}: {}", made.stderr);
        assert!(made.stdout.contains(expected), "{names}: {}", made.stdout);
        fs::remove_file(folder.path().join("cell.toml")).unwrap();
    }
    // Modes are no order of the columns.
    let lines = text.lines().map(|line| match line.split_once(',') {
        Some(("mode", rest)) => format!("active,{rest}\n"),
        Some((_, rest)) => format!("\"['elbow', 'shoulder']\",{rest}\n"),
        None => panic!("{line}"),
    });
    fs::write(&log, lines.collect::<String>()).unwrap();
    let made = new(folder.path(), &[]);
    assert!(made.stdout.contains("data.position.column = \"q{axis}\""), "{}", made.stdout);
}

/// Two columns of times, of which one has to be chosen: the rest is written.
#[test]
fn an_open_time_is_no_mistake() {
    let folder = folder(["time", "q1", "q2", "tau1", "tau2"], RAD);
    let log = folder.path().join("log.csv");
    let text = fs::read_to_string(&log).unwrap();
    let mut lines = text.lines();
    let mut table = format!("timestamp,{}\n", lines.next().unwrap());
    for line in lines {
        writeln!(table, "{},{line}", line.split(',').nth(1).unwrap()).unwrap();
    }
    fs::write(&log, table).unwrap();
    let made = new(folder.path(), &[]);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    assert!(made.stdout.contains("missing  data.time.column"), "{}", made.stdout);
}

/// Joint states without a header and without efforts: no answer would help.
#[test]
fn joint_states_without_efforts_are_named() {
    let folder = folder(["time", "q1", "q2", "tau1", "tau2"], RAD);
    let log = folder.path().join("log.csv");
    let rows = |further: &str| -> String {
        let row = |k: u32| format!("17,{k},base,elbow,shoulder,{}.5,0.25{further}\n", k % 7);
        (0..300).map(row).collect()
    };
    for further in ["", ",0.1,0.2"] {
        fs::write(&log, rows(further)).unwrap();
        let made = new(folder.path(), &[]);
        assert_eq!(made.code, Some(78), "{}", made.stdout);
        assert!(made.stderr.contains("joint states without efforts"), "{}", made.stderr);
    }
    fs::write(&log, rows(",0.1,0.2,3.0,4.0")).unwrap();
    assert_eq!(new(folder.path(), &[]).code, Some(0));
    // The second list is of torques.
    fs::remove_file(folder.path().join("cell.toml")).unwrap();
    fs::write(&log, rows(",0.1,0.2")).unwrap();
    let answers = ["--set", "data.position.columns=[6,7]", "--set", "data.torque.columns=[8,9]"];
    let made = new(folder.path(), &answers);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
}

/// An answer settles what follows from it, so it is asked first.
#[test]
fn questions_come_before_those_that_their_answers_settle() {
    let folder = folder(["time", "p1", "p2", "tau1", "tau2"], RAD);
    let asked = |answers: &[&str]| {
        let made = new(folder.path(), answers);
        assert_eq!(made.code, Some(0), "{}", made.stderr);
        fs::remove_file(folder.path().join("cell.toml")).unwrap();
        let missing = made.stdout.lines().filter_map(|line| line.strip_prefix("missing  "));
        missing.map(|line| line.split(':').next().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let first = asked(&[]);
    let place = |key: &str| first.iter().position(|own| own == key).unwrap();
    let order = ["data.position.column", "data.side", "data.position.unit", "data.torque.unit"];
    assert!(order.is_sorted_by_key(|key| place(key)), "{first:?}");
    assert!(place("data.side") < place("urdf.gear_ratios"), "{first:?}");
    assert_eq!(asked(&["--set", "data.position.column=p{axis}"]), ["urdf.drive_inertia"]);
}

#[test]
fn currents_too_large_for_ampere_are_asked_for_their_unit() {
    let names = ["time", "q1", "q2", "present_current_1", "present_current_2"];
    for (factor, unit) in [(0.1, "A"), (1e3, "?")] {
        let folder = folder(names, [1.0, 1.0, 1.0, factor, factor]);
        assert_eq!(new(folder.path(), &["--set", "urdf.drive_inertia=false"]).code, Some(0));
        let cell = fs::read_to_string(folder.path().join("cell.toml")).unwrap();
        assert!(cell.contains(&format!("torque.unit = \"{unit}\"")), "{factor}: {cell}");
        assert_eq!(cell.contains("torque.per_ampere"), unit == "A", "{factor}: {cell}");
    }
}

#[test]
fn joints_that_never_move_are_named_before_anything_is_fitted() {
    let folder = folder(["time", "q1", "q2", "tau1", "tau2"], RAD);
    assert_eq!(new(folder.path(), &["--set", "urdf.drive_inertia=false"]).code, Some(0));
    let [cell, log] = ["cell.toml", "log.csv"].map(|file| folder.path().join(file));
    let table = fs::read_to_string(&log).unwrap();
    for (rests, expected) in [
        (
            &[3][..],
            "log.csv: joint 2 (elbow) never moves beyond its noise in the samples that count",
        ),
        (
            &[2, 3],
            "log.csv: no joint moves beyond its noise in the samples that count: nothing can be \
            identified from a standstill",
        ),
    ] {
        fs::write(
            &log,
            table
                .lines()
                .map(|line: &str| {
                    let mut fields: Vec<&str> = line.split(',').collect();
                    rests.iter().for_each(|field| {
                        if line.starts_with("auto") {
                            fields[*field] = "0.25"
                        }
                    });
                    fields.join(",") + "\n"
                })
                .collect::<String>(),
        )
        .unwrap();
        let said = didim(&[&"identify", &"--cell", &cell, &"--input", &log]).stderr;
        assert!(said.contains(expected), "{said}");
    }
}

/// Stamps in the two columns that exported logs of ROS have, and dates: as a time from 0, to the
/// bit, in what comes out.
#[test]
fn stamps_in_two_columns_and_dates_are_times_to_the_nanosecond() {
    // 1 May 2024, 12:00 in UTC.
    const BEGIN_S: u64 = 1_714_564_800;
    fn convert(folder: &Path) -> Finished {
        let [cell, log, out] = ["cell.toml", "log.csv", "out.csv"].map(|file| folder.join(file));
        didim(&[&"convert", &"--cell", &cell, &log, &out])
    }
    fn converted(folder: &Path, convert: &impl Fn(&Path) -> Finished) -> String {
        let Finished { code, stderr, .. } = convert(folder);
        assert_eq!(code, Some(0), "{stderr}");
        assert!(!stderr.contains("off a uniform grid"), "{stderr}");
        fs::read_to_string(folder.join("out.csv")).unwrap()
    }
    let (names, answers) =
        (["time", "q1", "q2", "tau1", "tau2"], ["--set", "urdf.drive_inertia=false"]);
    let from_zero = folder(names, RAD);
    assert_eq!(new(from_zero.path(), &answers).code, Some(0));
    let expected = converted(from_zero.path(), &convert);
    // Names, the fields of a row, what is found, and rows with what is wrong and what is said of
    // it.
    type Case = (
        &'static str,
        fn(u64) -> String,
        &'static [&'static str],
        [(&'static str, &'static str, &'static str); 2],
    );
    let cases: [Case; 2] = [
        (
            "header.stamp.sec,header.stamp.nanosec",
            |ns| format!("{},{}", BEGIN_S + ns / 1_000_000_000, ns % 1_000_000_000),
            &["time.sec = \"header.stamp.sec\"", "time.nanosec = \"header.stamp.nanosec\""],
            [
                (
                    "1714564800,15000000",
                    "1714564800,1000000000",
                    "line 5, column `header.stamp.nanosec`: 1000000000 is not a number of \
                    nanoseconds within a second, 0 to 999999999",
                ),
                (
                    "1714564800,15000000",
                    "1714564800.5,0",
                    "line 5, column `header.stamp.sec`: 1714564800.5 is not a number of whole \
                    seconds; put the right column",
                ),
            ],
        ),
        (
            "stamp",
            |ns| {
                format!(
                    "2024-05-01T14:00:{:02}.{:09}+02:00",
                    ns / 1_000_000_000,
                    ns % 1_000_000_000
                )
            },
            &["time.column = \"stamp\"", "time.unit = \"iso8601\""],
            [
                (
                    "T14:00:00.015",
                    "T24:00:00.015",
                    "line 5, column `stamp`: `2024-05-01T24:00:00.015000000+02:00` is no date with \
                    a time of day (ISO 8601); write 2024-05-01T12:00:00.123456Z",
                ),
                (
                    "2024-05-01T14:00:00.015000000+02:00",
                    "0.015",
                    "line 5, column `stamp`: `0.015` is no date",
                ),
            ],
        ),
    ];
    for (names, time, found, wrong) in cases {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log.csv");
        fs::copy(from_zero.path().join("arm.urdf"), folder.path().join("arm.urdf")).unwrap();
        let text = fs::read_to_string(from_zero.path().join("log.csv")).unwrap();
        let mut rows = text.lines();
        let mut table = rows.next().unwrap().replace("time", names) + "\n";
        for (row, k) in rows.zip(0..) {
            let others = row.splitn(3, ',').nth(2).unwrap();
            writeln!(table, "auto,{},{others}", time(5_000_000 * k)).unwrap();
        }
        fs::write(&log, &table).unwrap();
        let made = new(folder.path(), &answers);
        assert_eq!(made.code, Some(0), "{}", made.stderr);
        for line in found.iter().chain(&["rate_hz = 200.0"]) {
            assert!(made.stdout.contains(&format!("found    data.{line}")), "{}", made.stdout);
        }
        assert_eq!(converted(folder.path(), &convert), expected, "{names}");
        fs::remove_file(folder.path().join("out.csv")).unwrap();
        for (right, wrong, said) in wrong {
            fs::write(&log, table.replacen(right, wrong, 1)).unwrap();
            let Finished { code, stderr, .. } = convert(folder.path());
            assert!(code != Some(0) && stderr.contains(said), "{stderr}");
        }
        // Dates are no numbers, and one column no two.
        let cell = folder.path().join("cell.toml");
        let text = fs::read_to_string(&cell).unwrap();
        for (right, wrong, said) in [
            (
                "time.unit = \"iso8601\"",
                "time.unit = \"s\"",
                "is a date, and a number is stated; state unit = \"iso8601\"",
            ),
            (
                "time.nanosec = \"header.stamp.nanosec\"",
                "",
                "is one column or two; give `column` and `unit`, or",
            ),
        ] {
            if text.contains(right) {
                fs::write(&log, &table).unwrap();
                fs::write(&cell, text.replace(right, wrong)).unwrap();
                let Finished { code, stderr, .. } = convert(folder.path());
                assert!(code != Some(0) && stderr.contains(said), "{stderr}");
            }
        }
    }
}

/// The name says ms, the type us; the file is known by its first bytes, also where it is converted.
#[cfg(feature = "parquet")]
#[test]
fn a_parquet_file_is_a_table_whose_types_give_the_unit_of_the_time() {
    let folder = tempfile::tempdir().unwrap();
    let [cell, robot, out, log] =
        ["cell.toml", "arm.urdf", "out.csv", "motion.log"].map(|name| folder.path().join(name));
    fs::write(&robot, URDF).unwrap();
    fs::copy(repository("crates/formats/tests/golden/parquet_stamps_us.parquet"), &log).unwrap();
    let answers = [
        "urdf.drive_inertia=false",
        "urdf.gear_ratios=[1.0, 1.0]",
        "data.side=joint",
        "data.position.unit=rad",
        "data.torque.unit=Nm",
        "data.torque.sign=1",
    ];
    let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
        vec![&"new", &cell, &"--robot", &robot, &"--log", &log];
    answers.iter().for_each(|answer| arguments.extend([&"--set" as &dyn AsRef<_>, answer]));
    let said = succeed(&arguments);
    for found in
        ["data.rate_hz = 250.0", "data.time.unit = \"us\"", "data.torque.column = \"tau_{index}\""]
    {
        assert!(said.contains(&format!("found    {found}")), "{said}");
    }
    succeed(&[&"convert", &"--cell", &cell, &log, &out]);
    assert_eq!(didim_formats::read_csv(&out, None).unwrap().samples(), 120);
}

#[cfg(not(feature = "parquet"))]
#[test]
fn without_the_feature_a_parquet_file_is_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    fs::write(folder.path().join("arm.urdf"), URDF).unwrap();
    fs::write(&log, b"PAR1").unwrap();
    let Finished { code, stderr, .. } = new(folder.path(), &[]);
    assert_eq!(code, Some(78), "{stderr}");
    assert!(stderr.contains("cargo build --release --features parquet"), "{stderr}");
}

/// What a DBC file tells of the shipped buses, held against their cells: nothing is found or
/// assumed otherwise.
#[test]
fn a_dbc_file_shows_signals_and_what_marks_a_sample() {
    let unanswered = toml::Value::String("?".to_owned());
    let cases = [
        ("packed_fd_six_axes", "tx40-packed-fd", "tx40", &["position", "torque", "counter"][..]),
        (
            "cia402_six_axes",
            "tx40-cia402",
            "tx40",
            &["position", "torque", "reference", "sync", "status_word"],
        ),
        ("piper", "piper", "piper", &["position", "sync", "temperature", "supply_voltage"]),
        (
            "openarm_damiao",
            "openarm",
            "openarm",
            &["position", "torque", "reference", "sync", "temperature"],
        ),
    ];
    for (dbc, shipped, arm, found) in cases {
        let folder = tempfile::tempdir().unwrap();
        let path_of = |name: &str| folder.path().join(name);
        let config = |path: String| repository("config").join(path);
        let (cell, log, shipped) =
            (path_of("cell.toml"), path_of("drive.log"), config(format!("cells/{shipped}.toml")));
        let bus = format!("log:{}", log.display());
        let scenario = match arm {
            "tx40" => "tx40-paper".into(),
            arm => repository(&format!("sim-fixtures/scenarios/{arm}.toml")),
        };
        succeed(&[&"sim", &"--cell", &shipped, &"--scenario", &scenario, &"--bus", &bus]);
        let (robot, dbc) = (config(format!("robots/{arm}.toml")), config(format!("dbc/{dbc}.dbc")));
        succeed(&[&"new", &cell, &"--robot", &robot, &"--dbc", &dbc, &"--log", &log]);
        let read = |file: &Path| -> toml::Table {
            toml::from_str(&fs::read_to_string(file).unwrap()).unwrap()
        };
        let layout = |of: &toml::Table| of["bus"]["layout"].as_table().unwrap().clone();
        let (made, configured) = (layout(&read(&cell)), layout(&read(&shipped)));
        assert!(
            found.iter().chain(&["rate_hz", "axes"]).all(|key| made.contains_key(*key)),
            "{made}"
        );
        for (key, value) in made.iter().filter(|(key, _)| *key != "dbc") {
            for (part, value) in value
                .as_table()
                .unwrap_or(&toml::Table::from_iter([(String::new(), value.clone())]))
            {
                let expected =
                    if part.is_empty() { &configured[key] } else { &configured[key][part] };
                // What a torque is may be asked, and nothing else.
                let asked = key == "torque" && *value == unanswered;
                assert!(asked || value == expected, "{key} {part}: {value} is {expected}");
            }
        }
        // Signs are of the drives: they are asked, of each.
        let check = didim(&[&"check", &"--cell", &cell, &"--other-machine"]);
        for axis in 1..=6 {
            let key = format!(": bus.drives.{axis}.torque.sign: ");
            assert!(check.stderr.contains(&key), "{}", check.stderr);
        }
    }
}

/// The joints of a RealMan, whose cell nobody ships: another arm of seven axes stands for it.
#[test]
fn a_dbc_file_without_a_sync_shows_that_signals_are_of_their_arrival() {
    let folder = tempfile::tempdir().unwrap();
    let cell = folder.path().join("cell.toml");
    let [robot, dbc] =
        ["robots/iiwa7.toml", "dbc/realman_joint.dbc"].map(|path| repository("config").join(path));
    let said = succeed(&[&"new", &cell, &"--robot", &robot, &"--dbc", &dbc]);
    let made: toml::Table = toml::from_str(&fs::read_to_string(&cell).unwrap()).unwrap();
    let layout = &made["bus"]["layout"];
    let word = |key: &str, part: &str| layout[key][part].as_str().unwrap();
    assert_eq!(layout["sync"].as_str(), Some("ServoCommand_1"));
    for (key, signal) in [
        ("position", "ServoFeedback_{axis}.Position"),
        ("torque", "ServoFeedback_{axis}.Current"),
        ("reference", "ServoCommand_{axis}.TargetPosition"),
    ] {
        assert_eq!((word(key, "signal"), word(key, "valid")), (signal, "arrival"));
    }
    assert!(layout.get("temperature").is_none(), "nothing of it is in this file");
    assert!(said.contains("the file has no SYNC"), "{said}");
}

/// The entry of a PDO's transmission type in a device file.
fn transmission_type(kind: u8) -> String {
    format!(
        "ParameterName=Transmission type\nObjectType=0x7\nDataType=0x0005\nAccessType=rw\n\
         DefaultValue={kind}"
    )
}

/// What a device file tells of the shipped drives, held against their cell; with its questions
/// answered, the layout is that cell's.
#[test]
fn device_files_show_objects_and_ask_for_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let path_of = |name: &str| folder.path().join(name);
    let config = |path: &str| repository("config").join(path);
    let (log, shipped) = (path_of("drive.log"), config("cells/tx40-cia402-eds.toml"));
    let (robot, eds) = (config("robots/tx40.toml"), config("eds/cia402_drive.eds"));
    succeed(&[&"sim", &"--cell", &shipped, &"--bus", &format!("log:{}", log.display())]);
    let read = |file: &Path| -> toml::Table {
        toml::from_str(&fs::read_to_string(file).unwrap()).unwrap()
    };
    let layout = |of: &toml::Table| of["bus"]["layout"].as_table().unwrap().clone();
    let shipped_layout = layout(&read(&shipped));
    let cell = path_of("cell.toml");
    let said = succeed(&[&"new", &cell, &"--robot", &robot, &"--eds", &eds, &"--log", &log]);
    assert!(said.contains("assumed  bus.layout.nodes.6.node_id = 6: the log has as many nodes"));
    let made = layout(&read(&cell));
    for key in ["axes", "rate_hz", "reference", "status_word"] {
        assert_eq!(made[key], shipped_layout[key], "{key}");
    }
    assert_eq!(made["position"], shipped_layout["position"]);
    // A demand is held, for how long nobody knows from the file.
    assert_eq!(made["torque"]["object"], shipped_layout["torque"]["object"]);
    assert_eq!(made["torque"]["unit"], shipped_layout["torque"]["unit"]);
    assert_eq!(made["torque"]["valid"].as_str(), Some("?"));
    let check = didim(&[&"check", &"--cell", &cell, &"--other-machine"]);
    for open in ["bus.layout.torque.valid: ", "bus.drives.6.torque.scale: "] {
        assert!(check.stderr.contains(open), "{}", check.stderr);
    }

    // A DCF tells its node, and what it carries by events is not taken.
    let text = fs::read_to_string(&eds).unwrap();
    let dcf = |node: usize| {
        let file = path_of(&format!("drive-{node}.dcf"));
        fs::write(&file, format!("{text}\n[DeviceComissioning]\nNodeID={node}\n")).unwrap();
        file
    };
    let files: Vec<_> = (11..17).map(dcf).collect();
    let by_events = text.replace(&transmission_type(1), &transmission_type(255));
    assert_ne!(by_events, text);
    fs::write(path_of("events.eds"), by_events).unwrap();
    fn layout_of(
        cell: &str,
        files: &[std::path::PathBuf],
        path_of: &impl Fn(&str) -> std::path::PathBuf,
        robot: &std::path::Path,
    ) -> Finished {
        let cell = path_of(cell);
        let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
            vec![&"new", &cell, &"--robot", &robot];
        files.iter().for_each(|file| arguments.extend([&"--eds" as &dyn AsRef<_>, file]));
        didim(&arguments)
    }
    let made = layout_of("dcf.toml", &files, &path_of, &robot);
    assert!(made.stdout.contains("found    bus.layout.nodes.6.node_id = 16"), "{}", made.stdout);
    assert!(made.stdout.contains("found    bus.layout.nodes.1.dcf = \"drive-11.dcf\""));
    let made = layout_of("twice.toml", &[&files[..5], &files[..1]].concat(), &path_of, &robot);
    let why = "missing  bus.layout.nodes.6.node_id: the number of axis 6's drive on the bus; its \
        DCF was made for node 11";
    assert!(made.stdout.contains(why), "{}", made.stdout);
    let refused = layout_of("none.toml", &[dcf(200)], &path_of, &robot);
    assert!(refused.stderr.contains("NodeID is 200, no node's number"), "{}", refused.stderr);
    let made = layout_of("events.toml", &[path_of("events.eds")], &path_of, &robot);
    let why = "type 255 does not go by the SYNC";
    assert!(
        made.stdout.contains("missing  bus.layout.position.object: ") && made.stdout.contains(why)
    );
    assert!(!made.stdout.contains("bus.layout.reference"), "{}", made.stdout);
    let refused = layout_of("two.toml", &files[..2], &path_of, &robot);
    assert_eq!(refused.code, Some(78));
    assert!(refused.stderr.contains("2 device files for 6 joints"), "{}", refused.stderr);
    assert_eq!(
        layout_of("one.toml", &files[..1], &path_of, &robot).code,
        Some(78),
        "a DCF is of one node"
    );
}

#[test]
fn what_cannot_be_done_is_said() {
    let names = ["time", "q1", "q2", "tau1", "tau2"];
    let folder = folder(names, RAD);
    fn says(further: &[&str], code: i32, what: &str, folder: &TempDir) {
        let Finished { code: found, stdout, stderr } = new(folder.path(), further);
        assert_eq!((found, stdout.as_str()), (Some(code), ""), "{stderr}");
        assert!(stderr.contains(what), "{stderr}");
    }
    says(
        &["--set", "urdf.mass=1"],
        78,
        "`urdf.mass` is not a key of this cell; available keys: data.position",
        &folder,
    );
    says(&["--set", "urdf"], 2, "has to be KEY=VALUE", &folder);
    // Answers of another length or type: asked again, or refused by the cell that comes of them.
    let columns = "data.position.columns=[\"q1\", \"q2\", \"time\"]";
    says(&["--set", columns], 78, "each of the 2 axes, not 3", &folder);
    // A log that is none, or runs backwards.
    let log = folder.path().join("log.csv");
    let table = fs::read_to_string(&log).unwrap();
    let mut rows: Vec<&str> = table.lines().collect();
    rows.swap(1000, 1001);
    fs::write(&log, rows.join("\n")).unwrap();
    says(&[], 78, "time goes back in row 1001 of `time`", &folder);
    fs::write(&log, "").unwrap();
    says(&[], 1, "this is an empty file, not a recording", &folder);
    fs::write(&log, &table).unwrap();
    says(&["--tip", "hand"], 78, "hand", &folder);
    says(&["--bag", "x.mcap"], 2, "cannot be used with", &folder);
    assert!(!folder.path().join("cell.toml").exists());
    assert_eq!(new(folder.path(), &[]).code, Some(0));
    says(&[], 2, "is there already; name another file, or remove it", &folder);
    // A bag that does not say what arm it is.
    let bag = repository("crates/formats/tests/golden/bag_none.mcap");
    let cell = folder.path().join("other.toml");
    let robot = repository("config/robots/ur5e.toml");
    let asked = succeed(&[&"new", &cell, &"--robot", &robot, &"--bag", &bag]);
    assert!(
        asked.contains(
            "missing  data.bag.joints: names in the messages, in the arm's order, of a b c"
        ),
        "{asked}"
    );
    fs::remove_file(&cell).unwrap();
    let refused = didim(&[&"new", &cell, &"--bag", &bag]);
    assert_eq!(refused.code, Some(78));
    assert!(
        refused.stderr.contains("bag_none.mcap has no robot_description"),
        "{}",
        refused.stderr
    );
}
