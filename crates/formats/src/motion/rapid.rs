//! A motion as a module for ABB.

use core::fmt::Write as _;

use super::file::{MotionFile, PROGRAM_HZ, identifier, list, to_degrees};

/// Writes absolute joint moves with zones between them; the controller chooses the speed along
/// them.
pub(super) fn write(file: &MotionFile<'_>, name: &str) -> String {
    let name = identifier(name);
    let mut text = format!("MODULE {name}_module\n") + &file.header_comments("  !");
    text += "  ! The controller makes the time law. First with a speed of 10 %.\n";
    let _ = writeln!(text, "  PROC {name}()");
    let points: Vec<f64> = file.times_s(PROGRAM_HZ).collect();
    for (k, &time_s) in points.iter().enumerate() {
        let position = file.motion.state(time_s).position;
        let zone = if k == 0 || k + 1 == points.len() { "fine" } else { "z10" };
        let axes = list(to_degrees(&position[..6]), 6);
        let _ = writeln!(
            text,
            "    MoveAbsJ [[{axes}], [9E9, 9E9, 9E9, 9E9, 9E9, 9E9]]\\NoEOffs, v500, {zone}, tool0;"
        );
    }
    text + "  ENDPROC\nENDMODULE\n"
}
