//! CSV experiments that are damaged or of another robot: exit code 1.

use super::support::{Configuration, Folder, cia402_cell, data, didim, head, packed_cell};

/// A second of the recording with its motion, as CSV rows of fields; the header first.
fn table() -> Vec<Vec<String>> {
    let text = head(&data().packed_csv, 1 + 8_000);
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

fn text_of_all() -> String {
    std::fs::read_to_string(&data().packed_csv).unwrap()
}

fn text(table: &[Vec<String>]) -> String {
    table.iter().map(|row| row.join(",") + "\n").collect()
}

fn column(table: &[Vec<String>], name: &str) -> usize {
    table[0].iter().position(|found| found == name).unwrap()
}

#[track_caller]
fn refused_with(options: &[&str], corrupt: impl FnOnce(&mut Vec<Vec<String>>), says: &[&str]) {
    let mut table = table();
    corrupt(&mut table);
    let folder = Folder::new();
    let input = folder.file("damaged.csv", &text(&table));
    let figure = folder.path("out.svg");
    let cell = packed_cell();
    let says = [&["damaged.csv"], says].concat();
    let identify = ["identify", "--cell", &cell, "--input", &input, "--json", "--figure", &figure];
    didim(&[&identify, options].concat()).refused(1, &says);
    assert_eq!(folder.names(), ["damaged.csv"]);
}

#[track_caller]
fn refused(corrupt: impl FnOnce(&mut Vec<Vec<String>>), says: &[&str]) {
    refused_with(&[], corrupt, says);
}

#[test]
fn values_that_are_no_numbers() {
    // NaN and an empty field are a loss (formats).
    for value in ["inf", "x", "1,5"] {
        let says: &[&str] = match value {
            "1,5" => &["line 701", "20 fields", "has 19", "decimals with a point"],
            _ => &["line 701", "`motor_torque_nm_3`", "not a finite number"],
        };
        refused(
            |table: &mut Vec<Vec<String>>| {
                let column = column(table, "motor_torque_nm_3");
                table[700][column] = value.to_owned();
            },
            says,
        );
    }
}

#[test]
fn columns_that_are_missing_or_not_known() {
    fn remove(name: &'static str) -> impl Fn(&mut Vec<Vec<String>>) {
        move |table: &mut Vec<Vec<String>>| {
            let column = column(table, name);
            table.iter_mut().for_each(|row| drop(row.remove(column)));
        }
    }
    refused(remove("motor_torque_nm_3"), &["`motor_torque_nm_3` is missing", "1 to 6"]);
    refused(remove("motor_position_rad_6"), &["`motor_position_rad_6` is missing"]);
    refused(remove("time_s"), &["no time_s column", "--sample-rate HZ"]);
    fn rename(from: &'static str, to: &'static str) -> impl Fn(&mut Vec<Vec<String>>) {
        move |table: &mut Vec<Vec<String>>| {
            let column = column(table, from);
            table[0][column] = to.to_owned();
        }
    }
    refused(rename("motor_torque_nm_3", "motor_torque_3"), &["`motor_torque_3` is not known"]);
    refused(
        rename("motor_position_rad_1", "motor_position_deg_1"),
        &["`motor_position_deg_1` is not known", "motor_position_rad_1"],
    );
    refused(rename("motor_torque_nm_3", "joint_torque_nm_3"), &["mixes motor_ and joint_"]);
    refused(|table| table.truncate(1), &["fewer than two samples"]);
    refused(Vec::clear, &["damaged.csv"]);
}

#[test]
fn time_that_does_not_advance_evenly() {
    refused(|table| table.swap(3_000, 3_001), &["time goes back", "row 3001"]);
    refused_with(&["--sample-rate", "4000"], |_| (), &["5000.0", "4000", "leave the option out"]);
}

/// Rows are missing: the whole pieces are identified together, as they are from files of their own.
#[test]
fn a_table_with_a_gap_is_cut_there() {
    let table_text = text_of_all();
    let rows: Vec<&str> = table_text.split_inclusive('\n').collect();
    let (header, end) = (rows[0], rows.len());
    let folder = Folder::new();
    fn file(name: &str, parts: &[&[&str]], folder: &Folder, header: &&str) -> String {
        let rows = parts.iter().copied().flatten().copied();
        folder.file(name, &std::iter::once(*header).chain(rows).collect::<String>())
    }
    let middle = end / 2;
    let cut = file("cut.csv", &[&rows[1..middle], &rows[middle + 7..end]], &folder, &header);
    let (first, second) = (
        file("first.csv", &[&rows[1..middle]], &folder, &header),
        file("second.csv", &[&rows[middle + 7..end]], &folder, &header),
    );
    fn identify(inputs: &[&str]) -> crate::command_line::support::Outcome {
        let mut arguments = vec!["identify", "--json", "--cell"];
        let cell = packed_cell();
        arguments.push(&cell);
        inputs.iter().for_each(|input| arguments.extend(["--input", input]));
        didim(&arguments)
    }
    let outcome = identify(&[&cut]);
    assert!(outcome.stderr.contains("samples are missing"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("2 whole pieces: 0.000 to "), "{}", outcome.stderr);
    fn parameters(json: String) -> serde_json::Value {
        let result: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(result["recordings"].as_array().unwrap().len(), 2);
        result["parameters"].clone()
    }
    let both = parameters(identify(&[&first, &second]).done());
    let of_cut = parameters(outcome.done());
    assert!(both.as_array().unwrap().len() > 10);
    // The rows around the gap are the same to the bit, its times are rounded.
    for (a, b) in both.as_array().unwrap().iter().zip(of_cut.as_array().unwrap()) {
        let number = |one: &serde_json::Value, key: &str| one[key].as_f64().unwrap();
        let difference =
            (number(a, "value") - number(b, "value")).abs() / number(a, "standard_deviation");
        assert!(difference < 1e-3, "{a} {b}");
    }
    let csv = folder.path("out.csv");
    let says = ["cut.csv", "samples are missing", "convert whole pieces"];
    didim(&["convert", "--cell", &packed_cell(), &cut, &csv]).refused(1, &says);
}

#[test]
fn a_robot_that_was_not_recorded() {
    let three = |table: &mut Vec<Vec<String>>| {
        let keep: Vec<bool> =
            table[0].iter().map(|name| !name.ends_with(['4', '5', '6'])).collect();
        for row in table {
            let mut keep = keep.iter();
            row.retain(|_| *keep.next().unwrap());
        }
    };
    refused(three, &["position", "3 axes", "6"]);
    refused(
        |table: &mut Vec<Vec<String>>| {
            three(table);
            for name in &mut table[0] {
                *name = name.replace("motor_", "joint_");
            }
        },
        &["3 joints", "\"tx40\" has 6", "choose the robot"],
    );

    let folder = Folder::new();
    let mut table = table();
    three(&mut table);
    let input = folder.file("three.csv", &text(&table));
    let output = folder.path("out.log");
    didim(&["convert", "--cell", &packed_cell(), &input, &output])
        .refused(1, &["three.csv", "3 axes", "6"]);
    assert_eq!(folder.names(), ["three.csv"]);
}

#[test]
fn motion_that_shows_nothing() {
    refused(
        |table: &mut Vec<Vec<String>>| {
            for axis in 1..=6 {
                let column = column(table, &format!("motor_position_rad_{axis}"));
                table[1..].iter_mut().for_each(|row| row[column] = "0.25".to_owned());
            }
        },
        &["does not excite", "zz1r", "fv1", "fc6", "move the joints"],
    );

    // One joint at rest: only its own parameters are named.
    let one_rests = |table: &mut Vec<Vec<String>>| {
        let column = column(table, "motor_position_rad_4");
        table[1..].iter_mut().for_each(|row| row[column] = "0.25".to_owned());
    };
    let mut results = String::new();
    let mut table = table();
    one_rests(&mut table);
    let folder = Folder::new();
    let input = folder.file("rests.csv", &text(&table));
    results += &didim(&["identify", "--cell", &packed_cell(), "--input", &input])
        .refused(1, &["rests.csv", "does not excite", "fv4", "fc4"]);
    assert!(!results.contains("zz1r") && !results.contains("fv5"), "{results}");
}

#[test]
fn parameters_that_the_motion_does_not_show_separate() {
    // At rest, gravity is as constant as an offset.
    let configuration = Configuration::new();
    let cell = configuration.packed_cell();
    let cell_text = std::fs::read_to_string(&cell).unwrap();
    let start = cell_text.find("parameters = [").unwrap();
    let end = start + cell_text[start..].find("\n]\n").unwrap() + 3;
    let listed = "parameters = [\"mx2r\", \"my2\", \"off2\"]\n";
    std::fs::write(&cell, format!("{}{listed}{}", &cell_text[..start], &cell_text[end..])).unwrap();
    let mut table = table();
    for axis in 1..=6 {
        let column = column(&table, &format!("motor_position_rad_{axis}"));
        table[1..].iter_mut().for_each(|row| row[column] = "20".to_owned());
    }
    let folder = Folder::new();
    let input = folder.file("rest.csv", &text(&table));
    didim(&["identify", "--cell", &cell, "--input", &input, "--json"])
        .refused(1, &["rest.csv", "does not distinguish mx2r, my2, off2", "leave some out"]);
}

#[test]
fn a_recording_at_another_rate_than_the_bus() {
    let folder = Folder::new();
    let input = folder.file("fast.csv", &text(&table()));
    let output = folder.path("out.log");
    didim(&["convert", "--cell", &cia402_cell(), &input, &output])
        .refused(1, &["fast.csv", "samples/s", "500", "resample"]);
    assert_eq!(folder.names(), ["fast.csv"]);
    // By which part of a sample the torque is late is known at the rate of the bus only.
    didim(&["identify", "--cell", &cia402_cell(), "--input", &input])
        .refused(1, &["fast.csv", "samples/s", "500", "resample"]);
}

#[test]
fn values_that_no_frame_can_carry() {
    let mut table = table();
    let column = column(&table, "motor_torque_nm_2");
    table[4_001][column] = "1e6".to_owned();
    let folder = Folder::new();
    let input = folder.file("huge.csv", &text(&table));
    let output = folder.path("out.log");
    didim(&["convert", "--cell", &packed_cell(), &input, &output])
        .refused(1, &["huge.csv", "sample 4000", "Torque_2", "gains"]);
    assert_eq!(folder.names(), ["huge.csv"]);
}
