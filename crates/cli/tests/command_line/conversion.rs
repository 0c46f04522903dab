//! CSV to log and back.

use didim::analysis::read_log;
use didim::cell::Cell;
use didim_formats::{Measurement, list_bag, read_csv};

use super::support::{Folder, cia402_cell, data, didim, head, packed_cell, shipped};

fn cell(path: &str) -> Cell {
    Cell::read(path.as_ref()).unwrap()
}

fn csv(path: &str) -> Measurement {
    read_csv(path.as_ref(), None).unwrap()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |largest, (a, b)| f64::max(largest, (a - b).abs()))
}

/// A log holds whole units of its signals: half a unit of each gain is what a value may move, and
/// a little for the rounding of doubles.
#[track_caller]
fn assert_within_quantisation(cell: &Cell, before: &Measurement, after: &Measurement) {
    let half = |unit: f64| 0.5 * unit.abs() * (1.0 + 1e-9) + 1e-12;
    let (before, after) = (&before.signals, &after.signals);
    assert!((before.sample_rate_hz / after.sample_rate_hz - 1.0).abs() < 1e-9);
    let references = before.reference_rad.as_ref().zip(after.reference_rad.as_ref());
    let (reference_before, reference_after) = references.unwrap();
    let mut largest: f64 = 0.0;
    for axis in 0..cell.bus().unwrap().layout.axes() {
        let rad = cell.bus().unwrap().scales.position_rad(axis, 1.0)
            - cell.bus().unwrap().scales.position_rad(axis, 0.0);
        let nm = cell.bus().unwrap().scales.torque_nm(axis, 1.0);
        for (unit, before, after) in [
            (rad, &before.position_rad[axis], &after.position_rad[axis]),
            (nm, &before.torque_nm[axis], &after.torque_nm[axis]),
            (rad, &reference_before[axis], &reference_after[axis]),
        ] {
            let difference = largest_difference(before, after);
            assert!(difference <= half(unit), "axis {axis}: {difference} of a unit of {unit}");
            largest = largest.max(difference / unit.abs());
        }
    }
    // The values were not on the grid before: otherwise nothing is tested.
    assert!(largest > 0.4, "{largest} of a unit");
}

/// The recording with values between the units of the frames.
fn off_grid(folder: &Folder, rows: usize) -> String {
    let mut text = String::new();
    for (k, line) in head(&data().packed_csv, rows + 1).lines().enumerate() {
        let fields = line.split(',').enumerate().map(|(column, field)| match (k, column) {
            (0, _) | (_, 0) => field.to_owned(),
            _ => (field.parse::<f64>().unwrap() * 1.003 + 1e-5 * (k % 7) as f64).to_string(),
        });
        text += &fields.collect::<Vec<_>>().join(",");
        text += "\n";
    }
    folder.file("before.csv", &text)
}

#[test]
fn table_to_log_to_table_moves_no_value_by_more_than_half_a_unit() {
    let folder = Folder::new();
    let before = off_grid(&folder, 10_000);
    let (log, after) = (folder.path("between.log"), folder.path("after.csv"));
    didim(&["convert", "--cell", &packed_cell(), &before, &log]).done();
    didim(&["convert", "--cell", &packed_cell(), &log, &after]).done();
    assert_within_quantisation(&cell(&packed_cell()), &csv(&before), &csv(&after));

    // Once on the grid, nothing moves any more: not by a bit.
    let again = folder.path("again.log");
    didim(&["convert", "--cell", &packed_cell(), &after, &again]).done();
    assert!(std::fs::read(&log).unwrap() == std::fs::read(&again).unwrap());
}

#[test]
fn log_to_table_to_log_is_the_same_log() {
    let folder = Folder::new();
    let log = folder.path("again.log");
    didim(&["convert", "--cell", &packed_cell(), &data().packed_csv, &log]).done();
    assert!(std::fs::read(&data().packed_log).unwrap() == std::fs::read(&log).unwrap());
}

/// A viewer of robots' data finds the joints in a recording, without knowing the bus.
#[test]
fn a_recording_has_the_curves_of_the_joints_next_to_its_frames() {
    let folder = Folder::new();
    let recording = folder.path("arm.mcap");
    didim(&["convert", "--cell", &packed_cell(), &data().packed_log, &recording]).done();
    let log = read_log(data().packed_log.as_ref(), &cell(&packed_cell()), &[]).unwrap();
    let samples = log.into_whole().unwrap().signals.position_rad[0].len();
    let topics = list_bag(recording.as_ref()).unwrap().topics;
    let joint_states = topics.iter().find(|topic| topic.name == "/joint_states").unwrap();
    assert_eq!(joint_states.messages, samples);
    assert!(
        joint_states
            .joints
            .iter()
            .map(String::as_str)
            .eq(["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6"])
    );
    // Its frames are read back as they were, and nothing counts as passed over.
    let again = folder.path("again.log");
    didim(&["convert", "--cell", &packed_cell(), &recording, &again]).done();
    assert!(std::fs::read(&data().packed_log).unwrap() == std::fs::read(&again).unwrap());
}

/// A target takes effect at the SYNC after its frame, so that the first cycle of a log has none:
/// the recording begins with the second, with the reference, and says so.
#[test]
fn the_reference_of_the_next_sync_survives() {
    let folder = Folder::new();
    let cell_file = cia402_cell();
    let (table, log) = (folder.path("between.csv"), folder.path("again.log"));
    let first = didim(&["convert", "--cell", &cell_file, &data().cia402_log, &table]);
    assert!(first.stderr.contains("1 sample") && first.stderr.contains("reference"), "{first:?}");
    first.done();
    didim(&["convert", "--cell", &cell_file, &table, &log]).done();
    let cell = cell(&cell_file);
    let [before, after] = [&data().cia402_log, &log]
        .map(|file| read_log(file.as_ref(), &cell, &[]).unwrap().into_whole().unwrap().signals);
    assert_eq!((before.position_rad[0].len(), after.position_rad[0].len()), (3969, 3968));
    // The same drive units, one cycle later.
    for (before, after) in [
        (&before.position_rad, &after.position_rad),
        (&before.torque_nm, &after.torque_nm),
        (&before.reference_rad.unwrap(), &after.reference_rad.unwrap()),
    ] {
        for (before, after) in before.iter().zip(after) {
            assert_eq!(&before[1..], after);
        }
    }
}

/// A table of joint angles and torques makes the log of the motors that turn so.
#[test]
fn joint_side_tables_become_motor_side_logs() {
    let folder = Folder::new();
    let cell = cell(&packed_cell());
    let mut recording = csv(&data().packed_csv);
    let transmission = cell.robot.transmission();
    let signals = &mut recording.signals;
    let reference = signals.reference_rad.as_mut().unwrap();
    for columns in [&mut signals.position_rad, &mut signals.torque_nm, &mut *reference] {
        columns.iter_mut().for_each(|column| column.truncate(5_000));
    }
    let motor = recording.clone();
    let axes = recording.axes();
    for (columns, is_torque) in [
        (&mut recording.signals.position_rad, false),
        (&mut recording.signals.torque_nm, true),
        (recording.signals.reference_rad.as_mut().unwrap(), false),
    ] {
        for k in 0..5_000 {
            let joint_values: Vec<f64> = columns.iter().map(|column| column[k]).collect();
            let mut motor_values = vec![0.0; axes];
            if is_torque {
                transmission.joint_torque(&joint_values, &mut motor_values);
            } else {
                transmission.joint_position(&joint_values, &mut motor_values);
            }
            columns.iter_mut().zip(motor_values).for_each(|(column, value)| column[k] = value);
        }
    }
    recording.side = didim_formats::Side::Joint;
    let (table, log) = (folder.path("joint.csv"), folder.path("motor.log"));
    let file = std::fs::File::create(&table).unwrap();
    didim_formats::write_csv(&recording, file, table.as_ref()).unwrap();
    didim(&["convert", "--cell", &packed_cell(), &table, &log]).done();
    assert_eq!(read_log(log.as_ref(), &cell, &[]).unwrap(), motor.into());
}

/// The same drives described by a DBC file and by their device file: a log gives the same samples,
/// and the simulated drives send the same frames.
#[test]
fn device_files_and_the_dbc_file_read_the_same_samples() {
    let folder = Folder::new();
    let (by_dbc, by_eds) = (folder.path("dbc.csv"), folder.path("eds.csv"));
    let eds = shipped("cells/tx40-cia402-eds.toml");
    let log = &data().cia402_log;
    didim(&["convert", "--cell", &cia402_cell(), log, &by_dbc]).done();
    didim(&["convert", "--cell", &eds, log, &by_eds]).done();
    let text = std::fs::read_to_string(&by_eds).unwrap();
    assert!(text.lines().count() > 3000, "{}", text.lines().count());
    assert!(text == std::fs::read_to_string(&by_dbc).unwrap());

    let sent = folder.path("eds.log");
    didim(&["sim", "--cell", &eds, "--bus", &format!("log:{sent}")]).done();
    assert!(std::fs::read(sent).unwrap() == std::fs::read(log).unwrap());
}
