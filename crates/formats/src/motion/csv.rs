//! A motion as a table.

use core::fmt::Write as _;

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use nalgebra::DMatrix;

use super::error::MotionError;
use super::file::{MotionFile, TABLE_HZ};

const POSITION_PREFIX: &str = "joint_position_rad_";

/// Largest accepted table \[bytes\]: hours of motion.
const MOST_BYTES: u64 = 256 << 20;

/// Writes `time_s`, then positions, velocities and accelerations of all joints.
pub(super) fn write(file: &MotionFile<'_>) -> String {
    let n = file.motion.joints();
    let mut text = file.header_comments("#") + "time_s";
    for what in [POSITION_PREFIX, "joint_velocity_rad_s_", "joint_acceleration_rad_s2_"] {
        for joint in 1..=n {
            let _ = write!(text, ",{what}{joint}");
        }
    }
    text.push('\n');
    for time_s in file.times_s(TABLE_HZ) {
        let state = file.motion.state(time_s);
        let _ = write!(text, "{time_s:.6}");
        for value in [&state.position, &state.velocity, &state.acceleration]
            .into_iter()
            .flat_map(|of| &of[..n])
        {
            let _ = write!(text, ",{value:.9}");
        }
        text.push('\n');
    }
    text
}

/// Positions at uniform times.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionPoints {
    /// Points per second \[Hz\].
    pub rate_hz: f64,
    /// A row per point, a column per joint \[rad\].
    pub positions: DMatrix<f64>,
}

/// Reads a table as this module writes it: `time_s` in uniform steps, and `joint_position_rad_1` up
/// to the last joint. Other columns, and lines that begin with `#`, are ignored.
///
/// # Errors
/// [`MotionError::Unreadable`].
pub fn read_motion(path: &Path) -> Result<MotionPoints, MotionError> {
    let points = read_bounded(path).and_then(|text| parse_points(&text));
    points.map_err(|problem| MotionError::Unreadable { file: path.to_path_buf(), problem })
}

fn read_bounded(path: &Path) -> Result<String, String> {
    let said = |error: std::io::Error| error.to_string();
    let mut text = String::new();
    let file = File::open(path).map_err(said)?;
    let read = file.take(MOST_BYTES + 1).read_to_string(&mut text).map_err(said)?;
    if read as u64 > MOST_BYTES {
        return Err("it has more than 256 MiB, and a motion has not; name the table of one".into());
    }
    Ok(text)
}

fn parse_points(text: &str) -> Result<MotionPoints, String> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.starts_with('#'));
    let (_, names) = lines.next().ok_or("it is empty")?;
    let names: Vec<&str> = names.split(',').map(str::trim).collect();
    let place = |wanted: &str| names.iter().position(|name| *name == wanted);
    let time = place("time_s").ok_or("it has no column time_s")?;
    let joints: Vec<usize> =
        (1..).map_while(|joint| place(&format!("{POSITION_PREFIX}{joint}"))).collect();
    if joints.is_empty() {
        return Err(format!("it has no column {POSITION_PREFIX}1"));
    }
    let (mut times, mut positions) = (Vec::new(), Vec::new());
    for (line, text) in lines {
        let cells: Vec<&str> = text.split(',').collect();
        let number = |place: usize| {
            let cell = cells.get(place).map(|cell| cell.trim()).unwrap_or_default();
            let number = cell.parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| {
                format!("line {}: `{cell}` in {} is no number", line + 1, names[place])
            })
        };
        times.push(number(time)?);
        for joint in &joints {
            positions.push(number(*joint)?);
        }
    }
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return Err("it has no points".to_owned());
    };
    let step_s = (last - first) / (times.len() - 1).max(1) as f64;
    let even =
        |(k, time_s): (usize, &f64)| (time_s - first - k as f64 * step_s).abs() < 0.01 * step_s;
    if times.len() < 2 || !times.iter().enumerate().all(even) {
        return Err("time_s must rise in even steps".to_owned());
    }
    let positions = DMatrix::from_row_slice(times.len(), joints.len(), &positions);
    Ok(MotionPoints { rate_hz: 1.0 / step_s, positions })
}
