//! A robot file with other nominal values.

use std::fmt::Write as _;

use didim_dynamics::robot::Robot;

use super::model::{ExportError, ExportModel};
use crate::urdf::WRITTEN_BY;

/// Writes the robot file with these parameters as its nominal values, and with the current friction
/// of the robot. Everything else stays, except comments within `[nominal]`.
///
/// # Errors
/// [`ExportError::RobotFile`].
pub fn to_robot_file(model: &ExportModel<'_>, text: &str) -> Result<String, ExportError> {
    let robot = model.robot;
    let wrong = |problem: String| ExportError::RobotFile { problem };
    let original = Robot::from_toml(text).map_err(|error| wrong(error.to_string()))?;
    let mut out: String = model.origin.iter().map(|line| format!("# {line}\n")).collect();
    let other_friction = original.own_friction() != robot.own_friction();
    let (mut is_nominal, mut found, mut joints) = (false, false, 0);
    if !model.origin.is_empty() {
        out.push('\n');
    }
    for line in without_former_remarks(text) {
        let plain = line.trim_start();
        if plain.starts_with('[') {
            is_nominal = header(plain) == "[nominal]";
            found |= is_nominal;
        }
        let is_friction = joints > 0 && other_friction && plain.starts_with("friction =");
        if is_nominal || is_friction {
            continue;
        }
        out.push_str(line);
        out.push('\n');
        if header(plain) == "[[joint]]" {
            joints += 1;
            if other_friction {
                // Writing to a String cannot fail.
                let _ = writeln!(out, "{}", robot.own_friction_toml(joints - 1));
            }
        }
    }
    if original.nominal().is_some() && !found {
        return Err(ExportError::NoTable);
    }
    out.truncate(out.trim_end().len());
    out.push_str("\n\n[nominal]\n");
    for (name, value) in robot.parameters().names().iter().zip(model.standard_parameters) {
        let _ = writeln!(out, "{name} = {value:?}");
    }
    if text.contains("\r\n") {
        out = out.replace('\n', "\r\n");
    }
    let read = Robot::from_toml(&out).map_err(|error| wrong(error.to_string()))?;
    let values = read.nominal().map_or(&[][..], |nominal| nominal.standard_parameters());
    if values != model.standard_parameters || read.own_friction() != robot.own_friction() {
        return Err(wrong("they are not read back".to_owned()));
    }
    Ok(out)
}

/// Returns the lines of a file without the remarks of an earlier export.
fn without_former_remarks(text: &str) -> impl Iterator<Item = &str> {
    let is_own = text.lines().next().is_some_and(|first| first == format!("# {WRITTEN_BY}"));
    let remarks = text.lines().take_while(|line| is_own && line.starts_with('#')).count();
    text.lines().skip(if is_own { remarks + 1 } else { 0 })
}

/// Returns the header of a table without spaces and without the rest of the line.
fn header(line: &str) -> String {
    let close = if line.starts_with("[[") { "]]" } else { "]" };
    let end = line.find(close).map_or(0, |at| at + close.len());
    line[..end].chars().filter(|letter| !letter.is_whitespace()).collect()
}
