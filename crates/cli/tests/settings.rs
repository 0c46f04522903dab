//! Values that findings ask to write: where they are written, the finding is gone and the error no
//! larger. Of drives on a bus, and of the columns of a table.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use crate::new::{RAD, folder, motion};
use crate::program::{Installation, changed, json, repository, succeed};
use didim::cell::{Cell, SignalSource};
use didim_dynamics::robot::{JointIndex, MotorIndex, TorqueTerm};
use didim_formats::Side;
use didim_identification::identification::{Change, Signal, SignalAxis};
use serde_json::Value;

/// Writes a value at a key such as `bus.drives[2].position.zero`.
fn write(file: &Path, key: &str, value: &Value) {
    let mut table: toml::Table = fs::read_to_string(file).unwrap().parse().unwrap();
    let key = key.replace('[', ".").replace(']', "");
    let parts: Vec<&str> = key.split('.').collect();
    let mut at = &mut toml::Value::Table(core::mem::take(&mut table));
    let mut root = at.clone();
    at = &mut root;
    for part in &parts[..parts.len() - 1] {
        at = match part.parse::<usize>() {
            Ok(number) => &mut at.as_array_mut().unwrap()[number - 1],
            Err(_) => {
                let table = at.as_table_mut().unwrap();
                table.entry((*part).to_owned()).or_insert_with(|| toml::Table::new().into())
            }
        };
    }
    let (last, value) = (parts[parts.len() - 1], toml::Value::try_from(value).unwrap());
    match (last.parse::<usize>(), at) {
        (Ok(number), toml::Value::Array(list)) => list[number - 1] = value,
        (_, toml::Value::Table(table)) => drop(table.insert(last.to_owned(), value)),
        (_, other) => panic!("{key}: {other}"),
    }
    fs::write(file, toml::to_string(&root).unwrap()).unwrap();
}

pub(crate) fn identify(cell: &Path, input: &Path) -> Value {
    let arguments: [&dyn AsRef<OsStr>; 8] =
        [&"identify", &"--json", &"--method", &"idim-ls", &"--cell", &cell, &"--input", &input];
    json(&succeed(&arguments))
}

/// The findings with a code that ask to write a value at a key that begins so.
fn settings(result: &Value, code: &str, begin: &str) -> Vec<Value> {
    let findings = result["verdict"]["findings"].as_array().unwrap().iter();
    let own = findings.filter(|of| of["code"] == code && of["set"]["key"].is_string());
    let begins = own.filter(|of| of["set"]["key"].as_str().unwrap().starts_with(begin));
    begins.cloned().collect()
}

/// Largest probability of a false finding.
const FALSE: f64 = 0.01;

/// Identifies with a wrong cell, writes what its finding says, and identifies again.
fn assert_corrected(cell: &Path, input: &Path, code: &str, begin: &str, right: f64) {
    assert_corrected_within(cell, input, (code, begin), [right, 0.02 * right.abs().max(1.0)]);
}

/// The same, with the tolerance of the right value. `begin` is that of the key, in the file that
/// the finding names.
fn assert_corrected_within(
    cell: &Path,
    input: &Path,
    (code, begin): (&str, &str),
    [right, tolerance]: [f64; 2],
) {
    let before = identify(cell, input);
    let found = settings(&before, code, begin);
    // Others may follow from the first.
    assert!(!found.is_empty(), "{begin}: {:#}", before["verdict"]["findings"]);
    assert!(found[0]["figure"].is_number(), "{}", found[0]);
    // Signs of parameters are counted, and not tested.
    if code != "wrong-signs-of-joint" {
        let [probability, tests] = ["probability", "tests"]
            .map(|name| found[0]["significance"][name].as_f64().unwrap_or(f64::NAN));
        assert!(tests >= 1.0 && probability * tests < FALSE, "{}", found[0]);
    }
    let set = &found[0]["set"];
    let (key, line) = (set["key"].as_str().unwrap(), set["line"].as_u64().unwrap());
    let name = set["file"].as_str().unwrap();
    let file = cell.parent().unwrap().join(name);
    let text = fs::read_to_string(&file).unwrap();
    let place = text.lines().nth(usize::try_from(line).unwrap() - 1).unwrap();
    let parts: Vec<&str> = key.split(['.', '[', ']']).collect();
    let has_place = parts.iter().any(|part| !part.is_empty() && place.contains(part));
    // The key of a section that the file does not have can be written before all others.
    assert!(has_place || (line == 1 && !text.contains(parts[0])), "{key}: {place}");
    let said = found[0]["message"].as_str().unwrap();
    assert!(said.contains(&format!("`{name}:{} {key}`: ", set["line"])), "{said}");
    let axis = begin.split(['[', ']']).nth(1).map_or(2, |number| number.parse().unwrap());
    let value = match &set["value"] {
        Value::Array(list) => list[axis - 1].as_f64().unwrap(),
        Value::Number(value) => value.as_f64().unwrap(),
        // A truth or a word has one right value.
        _ => right,
    };
    assert!((value - right).abs() < tolerance, "{key}: {value}, not {right}");
    write(&file, key, &set["value"]);
    let after = identify(cell, input);
    let remaining = settings(&after, code, key);
    assert!(remaining.is_empty(), "{remaining:#?}");
    let error = |of: &Value| of["relative_error"].as_f64().unwrap();
    assert!(error(&after) <= error(&before), "{} {}", error(&after), error(&before));
}

/// A log of the shipped arm, and its installation.
fn recorded() -> (Installation, PathBuf) {
    let installation = Installation::from_cell("tx40-cia402", &[]);
    let log = installation.path("arm.log");
    let bus = format!("log:{}", log.display());
    succeed(&[&"sim", &"--cell", &installation.cell(), &"--bus", &bus]);
    (installation, log)
}

#[test]
fn drives_on_a_bus_get_the_values_that_the_data_ask_for() {
    let (installation, log) = recorded();
    let cell = installation.cell();
    let shipped = fs::read_to_string(&cell).unwrap();
    let torque = "torque.scale.per_mille_of_rated_torque.rated_torque_nm";
    let gain = format!("bus.drives[2].{torque}");
    write(&cell, &gain, &Value::from(1.65));
    assert_corrected(&cell, &log, "torque-gain", &gain, 1.375);
    for key in ["bus.drives[4].torque.sign", "bus.drives[4].position.sign"] {
        fs::write(&cell, &shipped).unwrap();
        write(&cell, key, &Value::from(-1));
        assert_corrected(&cell, &log, "wrong-signs-of-joint", key, 1.0);
    }
    fs::write(&cell, &shipped).unwrap();
    write(&cell, "bus.drives[2].position.zero", &Value::from(60_000.0));
    assert_zero_corrected(&cell, &log, "bus.drives[2].position.zero");
}

/// The same of a zero, which is compared with the error that it had.
fn assert_zero_corrected(cell: &Path, input: &Path, begin: &str) {
    let before = identify(cell, input);
    let found = settings(&before, "geometry", begin);
    assert_eq!(found.len(), 1, "{begin}: {:#}", before["verdict"]["findings"]);
    let set = &found[0]["set"];
    write(cell, set["key"].as_str().unwrap(), &set["value"]);
    let after = identify(cell, input);
    assert!(settings(&after, "geometry", begin).is_empty(), "{:#}", after["verdict"]["findings"]);
    let error = |of: &Value| of["relative_error"].as_f64().unwrap();
    assert!(error(&after) <= error(&before), "{} {}", error(&after), error(&before));
}

/// A cell that identifies every base parameter.
fn without_parameters(text: &str) -> String {
    let (before, rest) = text.split_once("parameters = [").unwrap();
    let (_, after) = rest.split_once("]\n").unwrap();
    format!("{before}{after}")
}

/// Writes a copy of the robot of a cell, with a changed line.
fn change_robot(cell: &Path, [line, other]: [&str; 2]) {
    let robot = fs::read_to_string(repository("config/robots/tx40.toml")).unwrap();
    fs::write(cell.with_file_name("robot.toml"), changed(&robot, &[(line, other)])).unwrap();
    write(cell, "robot", &Value::from("robot.toml"));
}

const COUPLED: &str = "[0.0, 0.0, 0.0, 0.0, 32.0, 32.0]";

#[test]
fn delays_and_couplings_of_a_bus_get_the_values_that_the_data_ask_for() {
    let (installation, log) = recorded();
    let cell = installation.cell();
    let shipped = fs::read_to_string(&cell).unwrap();
    let delays = json("[0.0, 0.0, 20000.0, 0.0, 0.0, 0.0]");
    write(&cell, "bus.torque_delay_us", &delays);
    let asked = ("late-signal", "bus.torque_delay_us[3]");
    assert_corrected_within(&cell, &log, asked, [0.0, 500.0]);
    fs::write(&cell, &shipped).unwrap();
    write(&cell, "bus.torque_delay_us", &Value::from(20_000.0));
    let asked = ("late-signal", "bus.torque_delay_us");
    assert_corrected_within(&cell, &log, asked, [0.0, 500.0]);
    fs::write(&cell, &shipped).unwrap();
    // Too short for another reading of the signals: a contradicted value.
    write(&cell, "bus.torque_delay_us", &json("[0.0, 0.0, 3000.0, 0.0, 0.0, 0.0]"));
    let asked = ("torque-delay", "bus.torque_delay_us[3]");
    assert_corrected_within(&cell, &log, asked, [0.0, 500.0]);
    fs::write(&cell, &shipped).unwrap();
    change_robot(&cell, [COUPLED, &COUPLED.replacen("32.0", "-32.0", 1)]);
    assert_corrected(&cell, &log, "coupling", "transmission.rows[6][5]", 32.0);

    // The robot file lays an arm on its side that stands.
    fs::write(&cell, &shipped).unwrap();
    change_robot(&cell, ["gravity_m_s2 = [0.0, 0.0, -9.81]", "gravity_m_s2 = [0.0, 9.81, 0.0]"]);
    assert_corrected_within(&cell, &log, ("gravity-direction", "gravity_m_s2"), [0.0, 0.1]);
}

/// Records the simulated arm of a cell that excludes these terms from its torques.
fn record_without(installation: &Installation, name: &str, terms: &[&str]) -> PathBuf {
    write(&installation.cell(), "bus.layout.excludes", &serde_json::json!(terms));
    let log = installation.path(name);
    let bus = format!("log:{}", log.display());
    succeed(&[&"sim", &"--cell", &installation.cell(), &"--bus", &bus]);
    log
}

/// The simulated controller subtracts what the cell excludes.
#[test]
fn simulated_torques_lack_what_the_cell_excludes() {
    let installation = Installation::from_cell("tx40-cia402", &[]);
    let cell = installation.cell();
    let plain = without_parameters(&fs::read_to_string(&cell).unwrap());
    fs::write(&cell, &plain).unwrap();
    let error = |of: &Value| of["relative_error"].as_f64().unwrap();
    let complete = record_without(&installation, "complete.log", &[]);
    let (floor, value) = (error(&identify(&cell, &complete)), |of: &Value, name: &str| {
        let parameters = of["parameters"].as_array().unwrap().iter();
        let mut found = parameters.filter(|own| own["name"] == name);
        found.next().map(|own| own["value"].as_f64().unwrap())
    });
    for terms in [&["gravity"][..], &["friction"], &["gravity", "friction"]] {
        let log = record_without(&installation, "excluded.log", terms);
        let as_recorded = identify(&cell, &log);
        assert!(error(&as_recorded) < 3.0 * floor, "{terms:?}: {} {floor}", error(&as_recorded));
        assert_eq!(value(&as_recorded, "fc1").is_some(), !terms.contains(&"friction"));
        let inertia = value(&as_recorded, "zz1r").unwrap();
        assert!((inertia - 1.24).abs() < 0.03, "{terms:?}: {inertia}");
        // The same torques are not those of the complete arm.
        write(&cell, "bus.layout.excludes", &serde_json::json!([]));
        let other = error(&identify(&cell, &log));
        let is_other = other > 2.0 * error(&as_recorded);
        assert_eq!(is_other, terms.contains(&"gravity"), "{terms:?}: {other}");
    }
}

/// A coupling that is left out is a model error. The reading is not compared, because friction of
/// a wrist looks like one, but its value is known.
#[test]
fn arms_get_the_coupling_and_drive_inertia_that_the_data_ask_for() {
    let (installation, log) = recorded();
    let cell = installation.cell();
    let shipped = fs::read_to_string(&cell).unwrap();
    let all_parameters = without_parameters(&shipped);
    fs::write(&cell, &all_parameters).unwrap();
    change_robot(&cell, [COUPLED, &COUPLED.replacen("32.0", "0.0", 1)]);
    let robot = cell.with_file_name("robot.toml");
    let without = ["fv_m6 = 0.61\n", "fc_m6 = 1.9\n"].map(|line| (line, ""));
    let text = fs::read_to_string(&robot).unwrap();
    fs::write(&robot, changed(&text, &without)).unwrap();
    assert_corrected(&cell, &log, "unmodelled-effect", "transmission.rows[6][5]", 32.0);

    let text = fs::read_to_string(repository("config/robots/tx40.toml")).unwrap();
    for joint in [3, 4] {
        fs::write(&cell, &all_parameters).unwrap();
        let nominal = format!("\nia{joint} = ");
        let without_inertia = changed(&text, &[(&nominal, "\n# ")]);
        fs::write(&robot, without_inertia).unwrap();
        let key = format!("joint[{joint}].drive_inertia");
        write(&robot, &key, &Value::from(false));
        write(&cell, "robot", &Value::from("robot.toml"));
        assert_corrected(&cell, &log, "drive-inertia", &key, 1.0);
    }
}

/// A table of the arm with two links, with another torque of the second joint and other motors.
fn two_link_table(change: impl Fn([f64; 3], &mut [f64; 5])) -> tempfile::TempDir {
    let folder = folder(["t", "q1", "q2", "f1", "f2"], RAD);
    let rows = motion(&folder.path().join("arm.urdf"));
    let mut table = "t,q1,q2,f1,f2\n".to_owned();
    for neighbours in rows.windows(3) {
        let mut row = neighbours[1];
        change([0, 1, 2].map(|k: usize| neighbours[k][2]), &mut row);
        let values = row.map(|value| format!("{value:.9}"));
        table += &(values.join(",") + "\n");
    }
    fs::write(folder.path().join("log.csv"), table).unwrap();
    folder
}

#[test]
fn joints_of_a_urdf_get_the_values_that_the_data_ask_for() {
    // The torque also accelerates a drive, of 0.3 kg·m².
    let with_drive = two_link_table(|[before, own, after], row| {
        row[4] += 0.3 * (after - 2.0 * own + before) / (0.005 * 0.005);
    });
    let [cell, log] = ["cell.toml", "log.csv"].map(|name| with_drive.path().join(name));
    fs::write(&cell, two_link_cell("", "")).unwrap();
    assert_corrected(&cell, &log, "drive-inertia", "urdf.joints.elbow.drive_inertia", 1.0);

    // The second motor turns with both joints.
    let coupled = two_link_table(|_, row| {
        row[2] += row[1];
        row[3] -= row[4];
    });
    let [cell, log] = ["cell.toml", "log.csv"].map(|name| coupled.path().join(name));
    let ratios = ("[1.0, 1.0]", "[[1.0, 0.0], [-1.0, 1.0]]");
    let text = changed(&two_link_cell("", ""), &[ratios, ("\"joint\"", "\"motor\"")]);
    fs::write(&cell, text).unwrap();
    assert_corrected(&cell, &log, "coupling", "urdf.gear_ratios[2][1]", 1.0);

    // Coulomb friction of another width than that of the arm.
    let plain = two_link_table(|_, _| ());
    let [cell, log] = ["cell.toml", "log.csv"].map(|name| plain.path().join(name));
    let wide = changed(&two_link_cell("", ""), &[("width_rad_s = 0.02", "width_rad_s = 0.8")]);
    fs::write(&cell, wide).unwrap();
    assert_corrected(&cell, &log, "unmodelled-effect", "identification.friction", 1.0);
}

/// A finding about one gain of all joints needs known torques. Its key exists in each kind of cell,
/// as do those of the other changes: written there, the cell is read again.
#[test]
fn every_change_has_a_key_in_every_kind_of_cell() {
    let installation = Installation::from_cell("tx40-cia402", &[]);
    let folder = folder(["t", "q1", "q2", "f1", "f2"], RAD);
    let table = folder.path().join("cell.toml");
    let (joint, motor) = (JointIndex::new(1), MotorIndex::new(1));
    let axis = SignalAxis::Motor(motor);
    let [factor, standard_deviation, offset] = [1.1, 0.01, 0.2];
    let delay =
        |axis, signal| Change::Delay { axis, signal, delay_s: -2e-3, standard_deviation_s: 1e-4 };
    let gravity = Change::Gravity { gravity_m_s2: [0.0, 0.0, 9.81], standard_deviation_m_s2: 0.0 };
    let of_signals = [
        (Change::TorqueScale { axis: None, factor, standard_deviation }, true),
        (Change::TorqueScale { axis: Some(axis), factor, standard_deviation }, true),
        (delay(None, Signal::Torque), true),
        (delay(Some(axis), Signal::Torque), true),
        (delay(Some(axis), Signal::Position), true),
        (Change::Sign { axis, signal: Signal::Torque }, true),
        (Change::Exclude { term: TorqueTerm::Gravity }, true),
        (gravity, true),
        (Change::DriveInertia { joint }, true),
        (
            Change::Coupling { motor, joint: JointIndex::new(0), entry: 0.5, standard_deviation },
            true,
        ),
        // Positions of bags are those of the joints, in radians.
        (Change::PositionScale { axis, factor, standard_deviation }, false),
        (Change::Position { joint, offset, standard_deviation }, false),
        (Change::Sign { axis, signal: Signal::Position }, false),
    ];
    let bag = "bag = { joints = [\"shoulder\", \"elbow\"], effort = { unit = \"Nm\" } }\n";
    let of_bus = without_parameters(&fs::read_to_string(installation.cell()).unwrap());
    for (cell, text, source) in [
        (installation.cell(), of_bus.clone(), SignalSource::Bus),
        (installation.cell(), of_bus, SignalSource::OwnTable(Side::Motor)),
        (table.clone(), two_link_cell("", ""), SignalSource::OwnTable(Side::Joint)),
        (table.clone(), two_link_cell("", ""), SignalSource::Table),
        (table, two_link_cell("", bag), SignalSource::Bag),
    ] {
        for (change, is_of_bags) in &of_signals {
            fs::write(&cell, &text).unwrap();
            let setting = Cell::read(&cell).unwrap().setting(&[source], change);
            if source == SignalSource::Bag && !is_of_bags {
                assert_eq!(setting, None, "{change:?}");
                continue;
            }
            let setting = setting.unwrap_or_else(|| panic!("{source:?} {change:?}"));
            // The shipped robot file stays as it is.
            if setting.file == "cell.toml" {
                write(&cell, &setting.key, &serde_json::to_value(&setting.value).unwrap());
                let read = Cell::read(&cell).unwrap_or_else(|error| panic!("{setting}: {error}"));
                assert_ne!(read.setting(&[source], change), Some(setting), "{change:?}");
            }
        }
    }
    // A table and a bag have their own keys: one of them would correct half of the data.
    let sources = [SignalSource::Table, SignalSource::Bag];
    let cell = Cell::read(&folder.path().join("cell.toml")).unwrap();
    assert_eq!(cell.setting(&sources, &of_signals[1].0), None);
    let delayed = cell.setting(&sources, &of_signals[3].0).unwrap();
    assert_eq!(delayed.key, "data.torque_delay_us");
}

/// The scale of an axis in N·m is not a torque for an ampere.
#[test]
fn each_axis_gets_the_scale_of_its_own_unit() {
    let folder = folder(["t", "q1", "q2", "f1", "f2"], RAD);
    let file = folder.path().join("cell.toml");
    let mixed = "unit = [\"Nm\", \"A\"], per_ampere = [1.0, 2.0]";
    let text = changed(&two_link_cell("", ""), &[("unit = \"Nm\"", mixed)]);
    fs::write(&file, text).unwrap();
    let cell = Cell::read(&file).unwrap();
    let keys = [0, 1].map(|motor| {
        let axis = Some(SignalAxis::Motor(MotorIndex::new(motor)));
        let change = Change::TorqueScale { axis, factor: 1.1, standard_deviation: 0.01 };
        cell.setting(&[SignalSource::Table], &change).unwrap().key
    });
    assert_eq!(keys, ["data.torque.factor", "data.torque.per_ampere[2]"]);
}

#[test]
fn columns_of_a_table_get_the_values_that_the_data_ask_for() {
    let (installation, log) = recorded();
    let (cell, table) = (installation.path("cell.toml"), installation.path("arm.csv"));
    succeed(&[&"convert", &"--cell", &cell, &log, &table]);
    let shipped = fs::read_to_string(&cell).unwrap();
    let (_, identification) = shipped.split_once("[identification]").unwrap();
    let (identification, _) = identification.split_once("# From the paper's start").unwrap();
    let robot = repository("config/robots/tx40.toml");
    let data = |more: [&str; 2]| {
        let [position, torque] = more;
        format!(
            "name = \"table\"\nrobot = {robot:?}\n[data]\nrate_hz = 500.0\n\
             torque_valid = {{ held = {{ hold_us = 200.0, delay_us = 0.0 }} }}\nside = \"motor\"\n\
             time = {{ column = \"time_s\", unit = \"s\" }}\n\
             position = {{ column = \"motor_position_rad_{{axis}}\", unit = \"rad\"{position} }}\n\
             torque = {{ column = \"motor_torque_nm_{{axis}}\", {torque} }}\n\
             [identification]{}",
            identification.replace("method = \"didim\"", "method = \"idim-ls\"")
        )
    };
    let newton_metres = "unit = \"Nm\"";
    let amperes = "unit = \"A\", per_ampere = [1.0, 1.2, 1.0, 1.0, 1.0, 1.0]";
    fs::write(&cell, data(["", amperes])).unwrap();
    assert_corrected(&cell, &table, "torque-gain", "data.torque.per_ampere[2]", 1.0);
    let factor = format!("{newton_metres}, factor = [1.0, 1.2, 1.0, 1.0, 1.0, 1.0]");
    fs::write(&cell, data(["", &factor])).unwrap();
    assert_corrected(&cell, &table, "torque-gain", "data.torque.factor[2]", 1.0);
    let sign = format!("{newton_metres}, sign = [1, 1, 1, -1, 1, 1]");
    fs::write(&cell, data(["", &sign])).unwrap();
    assert_corrected(&cell, &table, "wrong-signs-of-joint", "data.torque.sign[4]", 1.0);
    fs::write(&cell, data([", zero = [0, 1.9, 0, 0, 0, 0]", newton_metres])).unwrap();
    assert_zero_corrected(&cell, &table, "data.position.zero[2]");
    // Gear ratios that are too large: another reading of the signal, and a contradicted value.
    for (factor, key) in [
        ("[1.0, 1.0, 1.25, 1.0, 1.0, 1.0]", "data.position.factor[3]"),
        ("[1.0, 1.1, 1.0, 1.0, 1.0, 1.0]", "data.position.factor[2]"),
    ] {
        fs::write(&cell, data([&format!(", factor = {factor}"), newton_metres])).unwrap();
        assert_corrected(&cell, &table, "position-scale", key, 1.0);
    }

    // A column whose scale no key has had: there is one to add.
    let text = fs::read_to_string(&table).unwrap();
    fs::write(&table, column_times(&text, "motor_torque_nm_2", 1.2)).unwrap();
    fs::write(&cell, data(["", newton_metres])).unwrap();
    assert_corrected(&cell, &table, "torque-gain", "data.torque.factor", 1.0 / 1.2);
}

/// Returns a table with a column multiplied by a number.
fn column_times(text: &str, column: &str, factor: f64) -> String {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let scaled = lines.map(|line| {
        let fields = line.split(',').zip(&names).map(|(field, name)| match *name == column {
            true => (factor * field.parse::<f64>().unwrap()).to_string(),
            false => field.to_owned(),
        });
        fields.collect::<Vec<_>>().join(",")
    });
    let scaled: Vec<String> = core::iter::once(names.join(",")).chain(scaled).collect();
    scaled.join("\n")
}

/// A table in SI units, for a cell whose drives have their own keys: these do not change it.
#[test]
fn a_table_of_a_cell_with_a_bus_gets_the_values_that_the_data_ask_for() {
    let (installation, log) = recorded();
    let (cell, table) = (installation.cell(), installation.path("arm.csv"));
    succeed(&[&"convert", &"--cell", &cell, &log, &table]);
    let [shipped, right] = [&cell, &table].map(|file| fs::read_to_string(file).unwrap());
    for (code, column, factor, key) in [
        ("torque-gain", "motor_torque_nm_2", 1.2, "table.torque.factor"),
        ("wrong-signs-of-joint", "motor_torque_nm_2", -1.0, "table.torque.sign"),
        ("position-scale", "motor_position_rad_2", 1.25, "table.position.factor"),
    ] {
        fs::write(&cell, &shipped).unwrap();
        fs::write(&table, column_times(&right, column, factor)).unwrap();
        assert_corrected(&cell, &table, code, key, 1.0 / factor);
    }
    // A zero that the table has already is changed, and not added to.
    fs::write(&table, &right).unwrap();
    fs::write(&cell, &shipped).unwrap();
    write(&cell, "table.position.zero", &json("[0.0, 1.9, 0.0, 0.0, 0.0, 0.0]"));
    assert_zero_corrected(&cell, &table, "table.position.zero[2]");
}

/// The cell of the arm with two links, with further keys of `[urdf]` and `[data]`, each with its
/// newline.
pub(crate) fn two_link_cell(urdf: &str, data: &str) -> String {
    format!(
        "name = \"two\"\nrobot = \"arm.urdf\"\n[urdf]\ndrive_inertia = false\n\
         gear_ratios = [1.0, 1.0]\nfriction = {{ viscous = true, coulomb = true, offset = \
         true, sign = {{ model = \"tanh\", width_rad_s = 0.02 }} }}\n{urdf}[data]\n\
         rate_hz = 200.0\ntorque_valid = \"instant\"\nside = \"joint\"\n{data}\
         time = {{ column = \"t\", unit = \"s\" }}\n\
         position = {{ column = \"q{{axis}}\", unit = \"rad\" }}\n\
         torque = {{ column = \"f{{axis}}\", unit = \"Nm\" }}\n[identification]\n\
         method = \"idim-ls\"\nposition_filter.cutoff_hz = 20.0\n\
         decimation_filter.factor = 10\n"
    )
}

/// An upright arm whose cell says that it hangs on its side: the key belongs to the cell, and
/// gravity to the base link of the URDF, whose axes are not those of the model's base frame.
#[test]
fn the_mounting_of_a_urdf_gets_the_gravity_that_the_data_ask_for() {
    let folder = folder(["t", "q1", "q2", "f1", "f2"], RAD);
    let [cell, log] = ["cell.toml", "log.csv"].map(|name| folder.path().join(name));
    let with_gravity = |gravity: &str| {
        fs::write(&cell, two_link_cell(gravity, "")).unwrap();
        identify(&cell, &log)
    };
    let found = |result: &Value| settings(result, "gravity-direction", "urdf.gravity_m_s2");
    let wrong = with_gravity("gravity_m_s2 = [0.0, -9.81, 0.0]\n");
    let [named] = &found(&wrong)[..] else { panic!("{:#}", wrong["verdict"]["findings"]) };
    assert_eq!((&named["set"]["file"], &named["set"]["line"]), (&"cell.toml".into(), &7.into()));
    let [x, y, z] = [0, 1, 2].map(|axis| named["set"]["value"][axis].as_f64().unwrap());
    assert!((z + 9.81).abs() < 1e-9 && x.abs() + y.abs() < 1e-9, "{named}");

    let corrected = with_gravity(&format!("gravity_m_s2 = {}\n", named["set"]["value"]));
    let upright = with_gravity("");
    assert!(found(&corrected).is_empty() && found(&upright).is_empty());
    let error = |of: &Value| of["relative_error"].as_f64().unwrap();
    assert!((error(&corrected) - error(&upright)).abs() < 1e-9);
    assert!(error(&corrected) < 0.01 && error(&wrong) > 0.1);
}

/// A spring that pulls with 80 % of what the cell says.
#[test]
fn a_known_torque_gets_the_factor_that_the_data_ask_for() {
    let stiffness = 20.0;
    let sprung = two_link_table(|_, row| row[4] -= 0.8 * stiffness * row[2]);
    let [cell, log] = ["cell.toml", "log.csv"].map(|name| sprung.path().join(name));
    let largest = stiffness * core::f64::consts::PI;
    let spring = format!(
        "joints.elbow.known_torque = {{ position_deg = [-180, 180], torque_nm = [-{largest}, \
         {largest}] }}\n"
    );
    fs::write(&cell, two_link_cell(&spring, "")).unwrap();
    assert_corrected(&cell, &log, "known-torque", "urdf.joints.elbow.known_torque.factor", 0.8);
}

/// All torques are 1.2 times too large, and a spring of known size shows it. One number stands for
/// the gains of all joints, and stays one.
#[test]
fn the_gain_of_all_joints_is_corrected_by_one_number() {
    let spring = |position: f64| 40.0 * (3.0 * position).sin();
    let scaled = two_link_table(|_, row| {
        row[4] -= spring(row[2]);
        row[3] *= 1.2;
        row[4] *= 1.2;
    });
    let [cell, log] = ["cell.toml", "log.csv"].map(|name| scaled.path().join(name));
    let degrees: Vec<f64> = (-36..=36).map(|step| 5.0 * f64::from(step)).collect();
    let torques: Vec<f64> = degrees.iter().map(|of| spring(of.to_radians())).collect();
    let elbow = format!(
        "joints.elbow.known_torque = {{ position_deg = {degrees:?}, torque_nm = {torques:?} }}\n"
    );
    let amperes = ("unit = \"Nm\"", "unit = \"A\", per_ampere = 1.0");
    let tolerances = "tolerances = { known_torque = 0.001 }\n";
    let text = changed(&two_link_cell(&elbow, ""), &[amperes]) + tolerances;
    fs::write(&cell, text).unwrap();
    let before = identify(&cell, &log);
    let gains = settings(&before, "torque-gain", "data.torque.per_ampere");
    let is_common = |of: &&Value| of["set"]["value"].is_number() && of.get("subject").is_none();
    let common: Vec<&Value> = gains.iter().filter(is_common).collect();
    let [found] = common[..] else { panic!("{:#}", before["verdict"]["findings"]) };
    assert_eq!(found["set"]["key"], "data.torque.per_ampere");
    let value = found["set"]["value"].as_f64().unwrap();
    assert!((value * 1.2 - 1.0).abs() < 0.02, "{value}");
    write(&cell, "data.torque.per_ampere", &found["set"]["value"]);
    let after = identify(&cell, &log);
    assert!(settings(&after, "torque-gain", "").is_empty(), "{:#}", after["verdict"]["findings"]);
    let error = |of: &Value| of["relative_error"].as_f64().unwrap();
    assert!(error(&after) < error(&before), "{} {}", error(&after), error(&before));
}
