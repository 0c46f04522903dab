//! `didim convert`: converts between a table, a candump log and an MCAP recording of a cell's bus,
//! and from an EtherCAT capture.

use std::path::{Path, PathBuf};

use clap::Args;
use didim_drivers::frame::Frame;
use didim_drivers::layout::{CompiledLayout, Quantity, Role};
use didim_drivers::source::{CandumpWriter, InterfaceName, StampDigits};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::robot::Transmission;
use didim_sim::{CYCLE_FRAMES, CycleEncoder};

use super::convert_frames::{write_candump, write_mcap};
use crate::CliError;
use crate::input::{count_error, parse_positive, read_input};
use crate::names::{DEFAULT_CELL, RESULT_FILE};
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{check_outputs, print, write_whole};
use crate::stream::InputFileOrStream;
use didim::analysis::check_cell_rate;
use didim::cell::Cell;
use didim::live::recording::is_mcap;
use didim_formats::{Measurement, Side, is_parquet, write_csv};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell with the layout and gains for the frames of the log
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The input: a table (CSV, Parquet), a candump log, an MCAP recording or an EtherCAT capture
    /// (pcap, pcapng)
    input: PathBuf,
    /// The output: a CSV experiment (*.csv), an MCAP recording (*.mcap) or a candump log
    output: PathBuf,
    /// Samples per second of a table without a time_s column
    #[arg(long, value_name = "HZ", value_parser = parse_positive, allow_negative_numbers = true)]
    sample_rate: Option<f64>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let cell = Cell::read(&arguments.cell).map_err(CliError::from_configuration)?;
    let output = &arguments.output;
    check_outputs([output], &[&arguments.input, &arguments.cell, &cell.robot_file])?;
    let opened = InputFileOrStream::open(&arguments.input)?;
    let (input, shown) = (opened.path(), opened.displayed_path());
    let ends = |path: &Path, end| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(end));
    let (from_table, to_csv) = (ends(shown, "csv") || is_parquet(input), ends(output, "csv"));
    let (from_mcap, to_mcap) = (is_mcap(input), ends(output, "mcap"));
    // Frames stay unchanged if no experiment is read or written.
    if to_mcap || (from_mcap && !to_csv) {
        if from_table {
            return Err(CliError::Usage(
                "convert the table to a candump log first, then that to an MCAP recording".into(),
            ));
        }
        if arguments.sample_rate.is_some() {
            return Err(CliError::Usage("--sample-rate is for tables only".into()));
        }
        if to_mcap {
            opened.with_displayed_path(write_mcap(input, output, &cell))?;
        } else {
            opened.with_displayed_path(write_candump(input, output))?;
        }
        return print_written(arguments, "replay");
    }
    // A corrected table would be corrected again when it is read.
    let cell = cell.without_table_corrections();
    let record = read_input(&opened, &cell, arguments.sample_rate, &[])?;
    let notes = record.notes();
    let Some(measurement) = record.into_whole() else {
        let why = format!("{}; convert whole pieces, one by one", notes.join("; "));
        return Err(CliError::in_file(shown, why));
    };
    for note in notes {
        tracing::warn!("{}: {note}", shown.display());
    }
    if to_csv {
        write_whole(output, |out| {
            write_csv(&measurement, out, output).map_err(CliError::from_failure)
        })?;
    } else {
        write_log(&cell, measurement, shown, output)?;
    }
    print_written(arguments, if to_csv { "identify" } else { "replay" })
}

/// Prints the file that was written, and the command that reads it.
fn print_written(arguments: &Arguments, reader: &str) -> Result<(), CliError> {
    print(&format!("{} written\n", arguments.output.display()))?;
    let next = NextCommand::new(reader).with_option("--cell", &arguments.cell);
    let next = match reader {
        "identify" => {
            next.with_option("--input", &arguments.output).with_option("--out", RESULT_FILE)
        }
        _ => next.with_argument(&arguments.output),
    };
    print_note(&next.to_string());
    Ok(())
}

/// Writes the frames that the cell's drives would have sent, in candump format. Every value is
/// rounded to the unit of its signal.
fn write_log(
    cell: &Cell,
    measurement: Measurement,
    input: &Path,
    output: &Path,
) -> Result<(), CliError> {
    let refused = |message: String| CliError::in_file(input, message);
    let bus = cell.bus().map_err(CliError::from_configuration)?;
    check_cell_rate(&measurement, cell).map_err(|error| count_error(input, error))?;
    if measurement.axes() != bus.layout.axes() {
        return Err(refused(format!(
            "the measurement has {} axes, the cell's bus {}; choose the cell that was recorded",
            measurement.axes(),
            bus.layout.axes()
        )));
    }
    if bus.layout.has_reference() && measurement.signals.reference_rad.is_none() {
        return Err(refused(
            "the cell's frames carry a reference and the measurement has none; leave `reference` \
             out of the cell's layout, or add the columns"
                .to_owned(),
        ));
    }
    if let Some(signal) = reading_of_samples(&bus.layout) {
        return Err(refused(format!(
            "the cell's frames carry `{signal}` in addition to positions, and the measurement has \
            none; leave `temperature`, `supply_voltage` and `mode` out of the cell's layout"
        )));
    }
    let measurement = to_motor_side(measurement, cell.robot.transmission());
    let encoder = CycleEncoder::new(bus.layout.clone(), bus.scales.clone());
    let name = [InterfaceName::new("can0").map_err(CliError::from_failure)?];
    write_whole(output, |out| {
        let mut writer = CandumpWriter::new(out, &name, StampDigits::Nanoseconds);
        let mut frames: Vec<Frame> = Vec::with_capacity(CYCLE_FRAMES);
        for k in 0..measurement.samples() {
            frames.clear();
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                clippy::cast_precision_loss,
                reason = "nanoseconds of a measurement are far fewer than 2^52"
            )]
            let stamp_ns = (k as f64 * bus.layout.period_ns()).round() as u64;
            encoder
                .encode(&encoder.cycle_of(&measurement.signals, k), stamp_ns, &mut frames)
                .map_err(|error| refused(format!("sample {k}: {error}")))?;
            for frame in &frames {
                writer.write(frame).map_err(CliError::from_failure)?;
            }
        }
        writer.finish().map_err(CliError::from_failure)?;
        Ok(())
    })
}

/// Returns the name of an additional reading in a frame that every sample needs, if there is one.
/// The frame cannot be encoded, because a measurement has no value for this reading.
fn reading_of_samples(layout: &CompiledLayout) -> Option<&str> {
    let needed = layout.messages().iter().filter(|message| message.role != Role::Reading);
    let mut signals = needed.flat_map(|message| &message.extractions);
    let reading = signals.find(|of| matches!(of.quantity, Quantity::Reading(_)))?;
    Some(&reading.signal.name)
}

fn to_motor_side(mut measurement: Measurement, transmission: &Transmission) -> Measurement {
    if measurement.side == Side::Motor {
        return measurement;
    }
    let axes = measurement.axes();
    let convert = |columns: &mut Vec<Vec<f64>>, rule: fn(&Transmission, &[f64], &mut [f64])| {
        let [mut joint, mut motor] = [[0.0; MAX_JOINTS]; 2];
        for k in 0..columns.first().map_or(0, Vec::len) {
            for (value, column) in joint.iter_mut().zip(columns.iter()) {
                *value = column[k];
            }
            rule(transmission, &joint[..axes], &mut motor[..axes]);
            for (column, value) in columns.iter_mut().zip(&motor) {
                column[k] = *value;
            }
        }
    };
    let signals = &mut measurement.signals;
    convert(&mut signals.position_rad, Transmission::motor_position);
    convert(&mut signals.torque_nm, Transmission::motor_torque);
    if let Some(reference) = &mut signals.reference_rad {
        convert(reference, Transmission::motor_position);
    }
    measurement.side = Side::Motor;
    measurement
}
