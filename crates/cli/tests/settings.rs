//! Values that findings ask to write: where they are written, the finding is gone and the error no
//! larger. Of drives on a bus, and of the columns of a table.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use crate::new::{RAD, folder};
use crate::program::{Installation, json, repository, succeed};
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
            Err(_) => at.get_mut(part).unwrap(),
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

/// Identifies with a wrong cell, writes what its finding says, and identifies again.
fn assert_corrected(cell: &Path, input: &Path, code: &str, begin: &str, right: f64) {
    let before = identify(cell, input);
    let found = settings(&before, code, begin);
    // Others may follow from the first.
    assert!(!found.is_empty(), "{begin}: {:#}", before["verdict"]["findings"]);
    let set = &found[0]["set"];
    let (key, line) = (set["key"].as_str().unwrap(), set["line"].as_u64().unwrap());
    assert_eq!(set["file"], "cell.toml");
    let text = fs::read_to_string(cell).unwrap();
    let line = text.lines().nth(usize::try_from(line).unwrap() - 1).unwrap();
    let parts: Vec<&str> = key.split(['.', '[', ']']).collect();
    assert!(parts.iter().any(|part| !part.is_empty() && line.contains(part)), "{key}: {line}");
    let said = found[0]["message"].as_str().unwrap();
    assert!(said.contains(&format!("`cell.toml:{} {key}`: ", set["line"])), "{said}");
    let axis = begin.split(['[', ']']).nth(1).map_or(2, |number| number.parse().unwrap());
    let value = match &set["value"] {
        Value::Array(list) => list[axis - 1].as_f64().unwrap(),
        value => value.as_f64().unwrap(),
    };
    assert!((value - right).abs() < 0.02 * right.abs().max(1.0), "{key}: {value}, not {right}");
    write(cell, key, &set["value"]);
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

    // A column whose scale no key has had: there is one to add.
    let text = fs::read_to_string(&table).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let scaled = lines.map(|line| {
        let fields = line.split(',').zip(&names).map(|(field, name)| match *name {
            "motor_torque_nm_2" => (1.2 * field.parse::<f64>().unwrap()).to_string(),
            _ => field.to_owned(),
        });
        fields.collect::<Vec<_>>().join(",")
    });
    let scaled: Vec<String> = core::iter::once(names.join(",")).chain(scaled).collect();
    fs::write(&table, scaled.join("\n")).unwrap();
    fs::write(&cell, data(["", newton_metres])).unwrap();
    assert_corrected(&cell, &table, "torque-gain", "data.torque.factor", 1.0 / 1.2);
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
