//! A cell without a bus: tables of other programs, with their own columns, units and signs, of a
//! real arm (the KR 300, tests/data/README.md).

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::bag_writer::{Bag, State};
use crate::program::{didim, json, repository, succeed};
use didim::cell::Cell;
use flate2::{Compression, write::GzEncoder};
use serde_json::Value;
use tempfile::TempDir;

const DATA: &str = r#"
[data]
rate_hz = 250.0
torque_valid = "instant"
side = "motor"
time = { column = "stamp", unit = "ms" }
position = { column = "A{axis} pos", unit = "deg", sign = [1, -1, 1, 1, 1, 1] }
torque = { columns = ["m0", "m1", "m2", "m3", "m4", "m5"], unit = "mNm" }
"#;

/// The cell of the arm without its bus and window, with another section in their place.
fn cell(section: &str) -> TempDir {
    let text = fs::read_to_string(repository("tests/data/kr300/cell.toml")).unwrap();
    let (head, rest) = text.split_once("[bus]").unwrap();
    let (_, controller) = rest.split_once("[controller]").unwrap();
    let (controller, identification) = controller.split_once("[window]").unwrap();
    let (_, identification) = identification.split_once("[identification]").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let text =
        format!("{head}{section}\n[controller]{controller}\n[identification]{identification}");
    fs::write(folder.path().join("cell.toml"), text).unwrap();
    let robot = repository("tests/data/kr300/robot.toml");
    fs::copy(robot, folder.path().join("robot.toml")).unwrap();
    folder
}

/// A recording as another program writes it: semicolons and decimal commas, degrees, axis 2 the
/// other way round, mN·m.
fn of_another_program(recording: &str) -> String {
    let text = fs::read_to_string(repository("tests/data/kr300").join(recording)).unwrap();
    let mut rows = text.lines();
    let names: Vec<&str> = rows.next().unwrap().split(',').collect();
    let column_of = |name: String| names.iter().position(|own| *own == name).unwrap();
    let mut table =
        "mode;stamp;m5;m4;m3;m2;m1;m0;A1 pos;A2 pos;A3 pos;A4 pos;A5 pos;A6 pos\n".to_owned();
    for (k, row) in rows.enumerate() {
        let fields: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
        let mut line = format!("AUT;{}", 4 * k);
        for axis in (1..=6).rev() {
            write!(line, ";{}", 1e3 * fields[column_of(format!("motor_torque_nm_{axis}"))])
                .unwrap();
        }
        for axis in 1..=6 {
            let sign = if axis == 2 { -1.0 } else { 1.0 };
            let position = fields[column_of(format!("motor_position_rad_{axis}"))];
            write!(line, ";{}", sign * position.to_degrees()).unwrap();
        }
        table += &line.replace('.', ",");
        table.push('\n');
    }
    table
}

fn identify(cell: &Path, inputs: [&Path; 2]) -> Value {
    let [a, b] = inputs;
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

/// A log of a bus is read as it is; a compressed one is named as that.
#[test]
fn a_compressed_log_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("arm.log.gz");
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(b"(1700000000.000000) can0 181#0102030405060708\n").unwrap();
    fs::write(&log, packed.finish().unwrap()).unwrap();
    let cell = repository("config/cells/tx40-cia402.toml");
    let refused = didim(&[&"identify", &"--cell", &cell, &"--input", &log]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("gunzip"), "{refused:?}");
}

/// The same table compressed by gzip, next to it.
fn compressed(table: &Path) -> PathBuf {
    let path = table.with_extension("csv.gz");
    let mut writer = GzEncoder::new(fs::File::create(&path).unwrap(), Compression::fast());
    writer.write_all(&fs::read(table).unwrap()).unwrap();
    writer.finish().unwrap();
    path
}

#[test]
fn a_table_of_another_program_identifies_as_the_same_recording_does() {
    let arm = repository("tests/data/kr300");
    let [a, b] = ["a.csv", "b.csv"].map(|file| arm.join(file));
    let expected = identify(&arm.join("cell.toml"), [&a, &b]);
    let own_columns = cell("[data]\nrate_hz = 250.0\ntorque_valid = \"instant\"\n");
    let others = cell(DATA);
    let [foreign_a, foreign_b] = ["a.csv", "b.csv"].map(|file| {
        let path = others.path().join(file);
        fs::write(&path, of_another_program(file)).unwrap();
        path
    });
    let compressed = compressed(&foreign_b);
    let results = [
        identify(&own_columns.path().join("cell.toml"), [&a, &b]),
        identify(&others.path().join("cell.toml"), [&foreign_a, &compressed]),
    ];
    let value = |of: &Value, k: usize| of["parameters"][k]["value"].as_f64().unwrap();
    for found in &results {
        assert_eq!(found["parameters"].as_array().unwrap().len(), 58);
        for k in 0..58 {
            let [one, other] = [found, &expected].map(|of| value(of, k));
            assert!((one - other).abs() < 1e-7 * other.abs().max(1e-2), "{k}: {one} {other}");
        }
        assert_eq!(found["verdict"]["applicable"], expected["verdict"]["applicable"]);
    }
    // Half a compressed file is none.
    let cut = others.path().join("cut.csv.gz");
    let contents = fs::read(&compressed).unwrap();
    fs::write(&cut, &contents[..contents.len() / 2]).unwrap();
    let out = didim(&[&"identify", &"--cell", &others.path().join("cell.toml"), &"--input", &cut]);
    assert_eq!(out.code, Some(1), "{}", out.stderr);
    assert!(out.stderr.contains("cut.csv.gz: "), "{}", out.stderr);
    let said = succeed(&[&"check", &"--cell", &others.path().join("cell.toml")]);
    assert!(said.contains("no bus: tables with the columns of [data], 250 samples/s"), "{said}");
}

#[test]
fn what_is_wrong_with_the_columns_is_said_by_key() {
    let refused = |section: &str| {
        let folder = cell(section);
        let out = didim(&[&"check", &"--cell", &folder.path().join("cell.toml")]);
        assert_eq!(out.code, Some(78), "{}", out.stderr);
        out.stderr
    };
    let cases = [
        (String::new(), "and [data] are both missing"),
        (DATA.replace("250.0", "0.0"), "`data.rate_hz`: is 0"),
        (DATA.replace("side = \"motor\"\n", ""), "`data.side`: is missing"),
        (DATA.replace("position = ", "reference = "), "`data.position`: is missing"),
        (DATA.replace("A{axis} pos", "pos"), "`pos` is one column for 6 axes"),
        (DATA.replace("\"m0\", ", ""), "`columns` has 5 names for 6 axes"),
        (DATA.replace("\"deg\"", "\"mNm\""), "the unit \"mNm\" for axis 1; use \"rad\" or \"deg\""),
        (DATA.replace("\"mNm\"", "\"A\""), "has the unit \"A\"; give `per_ampere`"),
        (
            DATA.replace("unit = \"mNm\"", "unit = \"Nm\", per_ampere = 2.0"),
            "has `per_ampere`, which belongs to",
        ),
        (
            DATA.replace("unit = \"mNm\"", "unit = \"A\", per_ampere = [2.0]"),
            "`per_ampere` has another number",
        ),
        (
            DATA.replace("unit = \"mNm\"", "unit = \"C\""),
            "the unit \"C\" for axis 1; use \"Nm\" or \"mNm\" or \"Ncm\"",
        ),
        (
            DATA.replace("unit = \"mNm\"", "unit = { name = \"x\", si = 0 }"),
            "the unit \"x\" of the size 0",
        ),
        (
            DATA.replace("unit = \"mNm\"", "unit = \"mNm\", wraps = true"),
            "`wraps`, which belongs to positions",
        ),
        (
            DATA.replace("\"ms\"", "\"min\""),
            "the unit \"min\"; use \"s\", \"ms\", \"us\" or \"ns\"",
        ),
        (DATA.replace("[1, -1, 1, 1, 1, 1]", "[1, -1]"), "`sign` has another number of entries"),
        (DATA.replace("[1, -1, 1, 1, 1, 1]", "-2"), "has a sign of -2"),
        (DATA.replace("unit = \"mNm\"", "unit = \"mNm\", factor = 0"), "has a factor of 0"),
        (
            DATA.replace("unit = \"mNm\"", "unit = \"mNm\", factor = [1.0]"),
            "`factor` has another number of entries",
        ),
        (
            DATA.replace("unit = \"mNm\"", "unit = \"mNm\", zero = 1.0"),
            "has `zero`, which belongs to positions",
        ),
        (DATA.replace("unit = \"deg\"", "unit = \"deg\", zero = nan"), "a `zero` of NaN"),
        (format!("{DATA}excludes = [\"inertia\"]\n"), "inertia"),
        (
            DATA.replace("columns = [", "column = \"m{index}\", columns = ["),
            "give `column` or `columns`",
        ),
        (DATA.replace("rate_hz", "rate"), "rate"),
        (DATA.replace("250.0", "30000.0"), "`data.rate_hz`: is 30000"),
        (
            DATA.replace("\"instant\"", "{ held = { hold_us = 5e5, delay_us = 0.0 } }"),
            "`data.torque_valid`",
        ),
        (
            DATA.replace("\"instant\"", "{ held = { hold_us = nan, delay_us = 0.0 } }"),
            "`data.torque_valid`",
        ),
    ];
    for (section, expected) in cases {
        let said = refused(&section);
        assert!(said.contains(expected), "{said}\nis not: {expected}");
    }
}

/// Columns with another scale and another zero, which `factor` and `zero` correct.
#[test]
fn a_factor_and_a_zero_correct_the_columns() {
    let right = cell(DATA);
    let corrected = DATA
        .replace("unit = \"deg\"", "unit = \"deg\", factor = [0.5, 1, 1, 1, 1, 1], zero = 10.0")
        .replace("unit = \"mNm\"", "unit = \"mNm\", factor = 4.0");
    let wrong = cell(&corrected);
    let names: Vec<String> = (1..=6).map(|axis| format!("A{axis} pos")).collect();
    let mut inputs = Vec::new();
    for (folder, changes) in [(&right, false), (&wrong, true)] {
        for file in ["a.csv", "b.csv"] {
            let text = of_another_program(file);
            let columns: Vec<&str> = text.lines().next().unwrap().split(';').collect();
            let mut table = format!("{}\n", columns.join(";"));
            for row in text.lines().skip(1) {
                let fields = row.split(';').zip(&columns).map(|(field, name)| {
                    let Ok(value) = field.replace(',', ".").parse::<f64>() else {
                        return field.to_owned();
                    };
                    let axis = names.iter().position(|own| own == name);
                    let value = match axis {
                        _ if !changes || *name == "stamp" => value,
                        Some(axis) => value / if axis == 0 { 0.5 } else { 1.0 } + 10.0,
                        None => value / 4.0,
                    };
                    value.to_string().replace('.', ",")
                });
                table += &(fields.collect::<Vec<_>>().join(";") + "\n");
            }
            let path = folder.path().join(file);
            fs::write(&path, table).unwrap();
            inputs.push(path);
        }
    }
    let expected = identify(&right.path().join("cell.toml"), [&inputs[0], &inputs[1]]);
    let found = identify(&wrong.path().join("cell.toml"), [&inputs[2], &inputs[3]]);
    let parameters = |of: &Value| of["parameters"].as_array().unwrap().clone();
    for (one, other) in parameters(&found).iter().zip(parameters(&expected)) {
        let [one, value, deviation] =
            [&one["value"], &other["value"], &other["standard_deviation"]]
                .map(|of| of.as_f64().unwrap());
        assert!((one - value).abs() < 1e-4 * deviation, "{other}: {one}");
    }
}

/// The driver subtracts gravity: the file says so once, and what needs gravity is refused.
#[test]
fn torques_without_gravity_are_declared_in_the_cell() {
    let folder = cell(&format!("{DATA}excludes = [\"gravity\"]\n"));
    let path = folder.path().join("cell.toml");
    let read = Cell::read(&path).unwrap();
    let is_zero = |gravity: [f64; 3]| gravity.iter().all(|component| *component == 0.0);
    assert!(is_zero(read.robot.gravity_m_s2()));
    assert!(!is_zero(read.robot_as_described.gravity_m_s2()));
    let complete = Cell::read(&cell(DATA).path().join("cell.toml")).unwrap();
    let is_moment = |name: &&String| name.starts_with("mx") || name.starts_with("my");
    let moments = |of: &Cell| of.base.names().iter().filter(is_moment).count();
    // Accelerations show every first moment of this arm.
    assert_eq!(moments(&read), moments(&complete));
    let table = folder.path().join("a.csv");
    fs::write(&table, of_another_program("a.csv")).unwrap();
    let found = identify(&path, [&table, &table]);
    let result = folder.path().join("result.json");
    fs::write(&result, found.to_string()).unwrap();
    let codes = found["verdict"]["findings"].as_array().unwrap().iter();
    assert!(codes.clone().any(|of| of["code"] == "incomplete-torque"), "{found}");
    for format in ["urdf", "c", "matlab"] {
        let out = didim(&[
            &"export",
            &"--cell",
            &path,
            &"--result",
            &result,
            &"--to",
            &format,
            &"--total-mass-kg",
            &"1000",
        ]);
        assert_eq!(out.code, Some(1), "{}", out.stderr);
        assert!(out.stderr.contains("torques without gravity"), "{}", out.stderr);
    }
    let predicted = json(&succeed(&[
        &"predict",
        &"--json",
        &"--cell",
        &path,
        &"--result",
        &result,
        &"--input",
        &table,
    ]));
    let notes = predicted["notes"].as_array().unwrap();
    let without = "measured and predicted torques are without gravity";
    assert!(notes.contains(&Value::from(without)), "{notes:?}");
}

#[test]
fn what_needs_frames_says_that_the_cell_has_none() {
    let folder = cell(DATA);
    let cell = folder.path().join("cell.toml");
    let log = folder.path().join("drive.log");
    fs::write(&log, "(1.000000) can0 123#00\n").unwrap();
    let table = folder.path().join("a.csv");
    fs::write(&table, of_another_program("a.csv").replacen(";m5", ";m6", 1)).unwrap();
    let said = |arguments: &[&dyn AsRef<OsStr>]| {
        let out = didim(arguments);
        assert_ne!(out.code, Some(0));
        out.stderr
    };
    let frames = "the cell kr300 has no [bus], and this takes its frames";
    assert!(said(&[&"run", &"--cell", &cell]).contains(frames));
    assert!(said(&[&"replay", &"--cell", &cell, &log]).contains(frames));
    assert!(said(&[&"identify", &"--cell", &cell, &"--input", &log]).contains(frames));
    assert!(said(&[&"sim", &"--cell", &cell, &"--bus", &"can:vcan0"]).contains("kr300"));
    // Whatever it is called, it is a table.
    let text = folder.path().join("a.txt");
    fs::copy(&table, &text).unwrap();
    assert!(
        said(&[&"identify", &"--cell", &cell, &"--input", &text]).contains("a.txt: column `m5`")
    );
    let missing = said(&[&"identify", &"--cell", &cell, &"--input", &table]);
    assert!(missing.contains("column `m5` is missing; the header has mode stamp m6"), "{missing}");
}

/// A wrong unit, sign or sample is named before anything is fitted.
#[test]
fn what_does_not_fit_the_robot_is_named_with_its_likely_cause() {
    let identify = |section: &str, change: &dyn Fn(String) -> String| {
        let folder = cell(section);
        let table = folder.path().join("a.csv");
        fs::write(&table, change(of_another_program("a.csv"))).unwrap();
        let cell = folder.path().join("cell.toml");
        didim(&[
            &"identify",
            &"--cell",
            &cell,
            &"--input",
            &table,
            &"--from",
            &"1.8",
            &"--to",
            &"8.196",
        ])
    };
    let as_it_is = |table: String| table;
    let refused = |section: &str, change: &dyn Fn(String) -> String| {
        let out = identify(section, change);
        assert_eq!(out.code, Some(1), "{}", out.stderr);
        let stderr = out.stderr;
        assert!(stderr.contains("a.csv: the data do not fit the robot: the "), "{stderr}");
        stderr
    };
    let good = identify(DATA, &as_it_is);
    let said: Vec<&str> = good.stderr.lines().collect();
    assert!(good.code == Some(0) && said.len() == 1, "{said:?}");
    assert!(said[0].starts_with("next: didim identify --cell "), "{said:?}");
    let degrees = refused(&DATA.replace("\"deg\"", "\"rad\""), &as_it_is);
    assert!(degrees.contains("(degrees in place of radians?)"), "{degrees}");
    let thousand = refused(&DATA.replace("\"mNm\"", "\"Nm\""), &as_it_is);
    assert!(thousand.contains("(mN·m, a current, or the other side of the gear?)"), "{thousand}");
    // Sample 1000 is 4 s after the first.
    let spoiled = |table: String| {
        let mut lines: Vec<String> = table.lines().map(str::to_owned).collect();
        let mut fields: Vec<&str> = lines[1001].split(';').collect();
        fields[10] = "1e6";
        lines[1001] = fields.join(";");
        lines.join("\n")
    };
    let glitch = refused(DATA, &spoiled);
    assert!(
        glitch.contains("joint 3")
            && glitch.contains("after 4.000 s")
            && glitch.contains("(a glitch?)"),
        "{glitch}"
    );
    // Angles of the motors taken for those of the joints.
    let joint_side = DATA.replace("\"motor\"", "\"joint\"");
    assert!(refused(&joint_side, &as_it_is).contains(" its limit of "));
    // A limit that is passed by little is said, and nothing is refused.
    let folder = cell(DATA);
    let robot = fs::read_to_string(folder.path().join("robot.toml")).unwrap();
    fs::write(
        folder.path().join("robot.toml"),
        robot.replace("velocity_max_rad_s = 3.0", "velocity_max_rad_s = 0.5"),
    )
    .unwrap();
    fs::write(folder.path().join("a.csv"), of_another_program("a.csv")).unwrap();
    let path_of = |name: &str| folder.path().join(name);
    let out = didim(&[
        &"identify",
        &"--cell",
        &path_of("cell.toml"),
        &"--input",
        &path_of("a.csv"),
        &"--from",
        &"1.8",
        &"--to",
        &"8.196",
    ]);
    assert_eq!(out.code, Some(0), "{}", out.stderr);
    assert!(
        out.stderr.contains("a.csv: the speed of joint ") && out.stderr.contains("rad/s"),
        "{}",
        out.stderr
    );
}

const BAG: &str = r#"
[data]
rate_hz = 250.0
torque_valid = "instant"
side = "motor"

[data.bag]
joints = ["A1", "A2", "A3", "A4", "A5", "A6"]
effort = { unit = "mNm", sign = [1, -1, 1, 1, 1, 1] }
"#;

/// A recording as ROS 2 has it, the joints from the last to the first.
fn bag(recording: &str, path: &Path) {
    let text = fs::read_to_string(repository("tests/data/kr300").join(recording)).unwrap();
    let mut bag = Bag::create(path);
    for (k, row) in (0_u64..).zip(text.lines().skip(1)) {
        let fields: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
        let positions: Vec<f64> = (0..6).rev().map(|k| fields[1 + k]).collect();
        let efforts: Vec<f64> =
            (0..6).rev().map(|k| fields[7 + k] * if k == 1 { -1e3 } else { 1e3 }).collect();
        bag.state(
            "/joint_states",
            &State {
                stamp_ns: 1_700_000_000_000_000_000 + 4_000_000 * k,
                joints: &["A6", "A5", "A4", "A3", "A2", "A1"],
                positions: &positions,
                efforts: &efforts,
            },
        );
    }
    bag.finish();
}

#[test]
fn a_bag_of_ros_2_identifies_as_the_same_recording_does() {
    let arm = repository("tests/data/kr300");
    let [a, b] = ["a.csv", "b.csv"].map(|file| arm.join(file));
    let expected = identify(&arm.join("cell.toml"), [&a, &b]);
    let folder = cell(BAG);
    let path_of = |name: &str| folder.path().join(name);
    bag("a.csv", &path_of("a.mcap"));
    // A folder is a bag too.
    fs::create_dir(path_of("b")).unwrap();
    bag("b.csv", &path_of("b").join("b_0.mcap"));
    let results = identify(&path_of("cell.toml"), [&path_of("a.mcap"), &path_of("b")]);
    for k in 0..58 {
        let [one, other] =
            [&results, &expected].map(|of| of["parameters"][k]["value"].as_f64().unwrap());
        assert!((one - other).abs() < 1e-7 * other.abs().max(1e-2), "{k}: {one} {other}");
    }
    // Currents, of which each ampere is a thousandth of a newton metre; and each milliampere.
    for (unit, per_ampere) in [("A", 0.001), ("mA", 1.0)] {
        let unit_keys = format!("unit = \"{unit}\", per_ampere = {per_ampere:?}");
        let currents = cell(&BAG.replace("unit = \"mNm\"", &unit_keys));
        let of_currents =
            identify(&currents.path().join("cell.toml"), [&path_of("a.mcap"), &path_of("b")]);
        assert_eq!(of_currents["parameters"], results["parameters"], "{unit}");
    }
    let said = succeed(&[&"check", &"--cell", &path_of("cell.toml")]);
    assert!(said.contains("no bus: ROS 2 bags, 250 samples/s"), "{said}");
    assert!(!said.contains("window."), "{said}");
    let refused = |section: &str| {
        let folder = cell(section);
        let out = didim(&[&"check", &"--cell", &folder.path().join("cell.toml")]);
        assert_eq!(out.code, Some(78), "{}", out.stderr);
        out.stderr
    };
    for (section, expected) in [
        (BAG.replace("\"A6\"", "\"A5\""), "names `A5` twice"),
        (BAG.replace(", \"A6\"", ""), "has 5 names for 6 axes"),
        (BAG.replace("\"mNm\"", "\"A\""), "give `per_ampere`"),
        (BAG.replace("effort = ", "efforts = "), "efforts"),
    ] {
        let said = refused(&section);
        assert!(said.contains(expected), "{said}");
    }
    let other = cell(&BAG.replace("\"A6\"", "\"A7\""));
    let out = didim(&[
        &"identify",
        &"--cell",
        &other.path().join("cell.toml"),
        &"--input",
        &path_of("a.mcap"),
    ]);
    assert_eq!(out.code, Some(1));
    assert!(
        out.stderr.contains("no topic has all of the joints A1 A2 A3 A4 A5 A7"),
        "{}",
        out.stderr
    );
}

/// Drives count positions and references in the same way. A reference that another program writes
/// differently has its own sign and zero.
#[test]
fn references_have_the_sign_and_zero_of_the_positions_unless_they_have_their_own() {
    let convention = "sign = [1, -1, 1, 1, 1, 1], zero = [0, 90, 0, 0, 0, 0]";
    let data = DATA.replace("sign = [1, -1, 1, 1, 1, 1]", convention);
    let scales_of = |reference: &str| {
        let folder =
            cell(&format!("{data}reference = {{ column = \"r{{axis}}\", {reference} }}\n"));
        let read = Cell::read(&folder.path().join("cell.toml")).unwrap();
        let reference = read.columns.unwrap().reference.unwrap();
        [reference.scales[1], reference.zeros.get(1).copied().unwrap_or_default()]
    };
    let degree = 1_f64.to_radians();
    assert_close(scales_of("unit = \"deg\""), [-degree, 90.0]);
    assert_close(scales_of("unit = \"rad\""), [-1.0, 90.0 * degree]);
    assert_close(scales_of("unit = \"rad\", sign = 1, zero = 0"), [1.0, 0.0]);
    assert_close(scales_of("unit = \"rad\", sign = 1"), [1.0, 90.0 * degree]);
}

/// The number of the first line that begins so.
fn line_number(text: &str, begin: &str) -> usize {
    let found = text.lines().position(|line| line.starts_with(begin));
    found.unwrap_or_else(|| panic!("{begin}")) + 1
}

fn assert_close([scale, zero]: [f64; 2], expected: [f64; 2]) {
    let near = |one: f64, other: f64| (one - other).abs() < 1e-9;
    assert!(near(scale, expected[0]) && near(zero, expected[1]), "{scale} {zero}");
}

/// A command above the torque of its drive: one of the two limits is wrong, and both are named.
#[test]
fn a_controller_that_commands_more_than_its_drive_has_is_refused() {
    let folder = cell(DATA);
    let file = folder.path().join("cell.toml");
    let robot = fs::read_to_string(folder.path().join("robot.toml")).unwrap();
    let text = fs::read_to_string(&file).unwrap();
    let (before, rest) = text.split_once("[controller]").unwrap();
    let (_, after) = rest.split_once("[identification]").unwrap();
    let controller = |limit: &str| {
        let joint = "{ law = { kind = \"p\", kp_per_rad = 1.0, k_tau_nm = 1.0 } }".to_owned();
        let first = joint.replace("} }", &format!("}}, torque_limit_nm = {limit} }}"));
        let joints = [vec![first], vec![joint; 5]].concat().join(", ");
        format!(
            "{before}[controller]\nkind = \"cabinet\"\ntiming = {{ kind = \"continuous\", \
             sample_period_s = 2e-4 }}\njoints = [{joints}]\n[identification]{after}"
        )
    };
    fs::write(&file, controller("1e9")).unwrap();
    let said = Cell::read(&file).unwrap_err().to_string();
    let text = fs::read_to_string(&file).unwrap();
    let in_cell = format!("line {}: `controller.joints", line_number(&text, "joints = ["));
    let in_robot =
        format!("robot.toml:{} joint[1].torque_max_nm", line_number(&robot, "torque_max_nm"));
    assert!(said.contains(&in_cell) && said.contains(&in_robot), "{said}");
    fs::write(&file, controller("1.0")).unwrap();
    assert!(Cell::read(&file).is_ok(), "{:?}", Cell::read(&file).err());
}
