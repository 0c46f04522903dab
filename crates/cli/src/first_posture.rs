//! Reads the first posture of a designed motion.

use std::path::Path;

use didim::cell::Cell;
use didim::files::read_text;
use didim_dynamics::robot::Robot;
use didim_formats::{Measurement, Side, read_csv};

use super::CliError;
use super::input::read_input;
use super::stream::InputFileOrStream;

/// Reads a posture \[rad or m\] from a file with one number for each joint, or from the first
/// sample of a recording. A recording is read as its cell describes it, or else as a table with
/// didim's own columns.
pub(super) fn read_first_posture(
    file: &Path,
    robot: &Robot,
    cell: Option<&Cell>,
) -> Result<Vec<f64>, CliError> {
    if let Some(angles) = read_angles(file) {
        return match angles.len() == robot.joints() {
            true => Ok(angles),
            false => Err(CliError::in_file(
                file,
                format!(
                    "it has {} numbers, and the arm has {} joints; give one for each joint",
                    angles.len(),
                    robot.joints()
                ),
            )),
        };
    }
    let measurement = match cell {
        Some(cell) => {
            let input = InputFileOrStream::open(file)?;
            let record = read_input(&input, cell, None, &[])?;
            record.segments.into_iter().next().map(|piece| piece.measurement)
        }
        None => Some(read_csv(file, None).map_err(CliError::from_failure)?),
    };
    let posture = measurement.and_then(|of| first_position(&of, robot));
    posture.ok_or_else(|| CliError::in_file(file, "it has no sample of every joint"))
}

/// Reads the numbers of a file that has nothing else; `None` for every other file.
fn read_angles(file: &Path) -> Option<Vec<f64>> {
    let text = read_text(file).ok()?;
    let words = text.split(|of: char| of.is_whitespace() || ",;[]".contains(of));
    let numbers = words.filter(|word| !word.is_empty()).map(|word| word.parse::<f64>().ok());
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    (!numbers.is_empty() && numbers.iter().all(|number| number.is_finite())).then_some(numbers)
}

/// Returns the joint positions of the first sample.
fn first_position(measurement: &Measurement, robot: &Robot) -> Option<Vec<f64>> {
    let positions = &measurement.signals.position_rad;
    let first: Vec<f64> =
        positions.iter().map(|axis| axis.first().copied()).collect::<Option<_>>()?;
    if first.len() != robot.joints() || first.iter().any(|position| !position.is_finite()) {
        return None;
    }
    let mut joints = first.clone();
    if measurement.side == Side::Motor {
        robot.transmission().joint_position(&first, &mut joints);
    }
    Some(joints)
}
