//! A motion as a program for KUKA.

use core::fmt::Write as _;

use super::file::{MotionFile, PROGRAM_HZ, identifier, to_degrees};

/// Writes the axis positions of a spline block; the controller chooses the speed along them.
pub(super) fn write(file: &MotionFile<'_>, name: &str) -> String {
    let name = identifier(name);
    let mut text = format!("DEF {name}()\n") + &file.header_comments(";");
    text += "; The controller makes the time law. First with a program override of 10 %.\n";
    text += "BAS(#INITMOV, 0)\n";
    for axis in 1..=6 {
        let _ = writeln!(text, "$VEL_AXIS[{axis}] = 30");
    }
    let mut points = file.times_s(PROGRAM_HZ).map(|time_s| {
        let position = file.motion.state(time_s).position;
        let axes = to_degrees(&position[..6]).enumerate();
        let axes: Vec<String> = axes.map(|(k, q)| format!("A{} {q:.6}", k + 1)).collect();
        format!("{{{}}}", axes.join(", "))
    });
    if let Some(start) = points.next() {
        let _ = writeln!(text, "PTP {start}\nPTP_SPLINE");
    }
    for point in points {
        let _ = writeln!(text, "  SPTP {point}");
    }
    text + "ENDSPLINE\nEND\n"
}
