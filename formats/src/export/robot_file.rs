//! A robot file with other nominal values.

use std::fmt::Write as _;

use didim_core::robot::Robot;

use super::model::{ExportError, ExportModel};

/// The text of the robot's file with these parameters as its nominal values, and with the friction that the robot has now;
/// everything else as it was.
///
/// # Errors
/// [`ExportError::RobotFile`].
pub fn to_robot_file(model: &ExportModel<'_>, text: &str) -> Result<String, ExportError> {
    let robot = model.robot;
    let wrong = |problem: String| ExportError::RobotFile { problem };
    let stated = Robot::from_toml(text).map_err(|error| wrong(error.to_string()))?;
    let mut out: String = model.origin.iter().map(|line| format!("# {line}\n")).collect();
    let other_friction = stated.own_friction() != robot.own_friction();
    let (mut is_nominal, mut joints) = (false, 0);
    for line in text.lines() {
        let plain = line.trim_start();
        if plain.starts_with('[') {
            is_nominal = plain.starts_with("[nominal]");
        }
        let is_friction = joints > 0 && other_friction && plain.starts_with("friction =");
        if is_nominal || is_friction {
            continue;
        }
        out.push_str(line);
        out.push('\n');
        if plain.starts_with("[[joint]]") {
            joints += 1;
            if other_friction {
                // Writing to a String cannot fail.
                let _ = writeln!(out, "{}", robot.own_friction_toml(joints - 1));
            }
        }
    }
    out.push_str("\n[nominal]\n");
    for (name, value) in robot.parameters().names().iter().zip(model.standard) {
        let _ = writeln!(out, "{name} = {value:?}");
    }
    let read = Robot::from_toml(&out).map_err(|error| wrong(error.to_string()))?;
    let values = read.nominal().map_or(&[][..], |nominal| nominal.standard());
    if values != model.standard || read.own_friction() != robot.own_friction() {
        return Err(wrong("they are not read back".to_owned()));
    }
    Ok(out)
}
