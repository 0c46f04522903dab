//! A friction sweep in words: its speeds, and which friction terms it tells apart.

use didim_core::excitation::{Sweep, SweptJoint, Term};
use didim_core::robot::{JointKind, ParameterKind, Robot};

use super::design::{Checked, conditions};
use crate::offline::Assignment;
use crate::text::significant;

/// What is swept and what that tells, for the header of a file and for people.
pub fn sweep_lines(
    robot: &Robot,
    assignment: &Assignment,
    sweep: &Sweep,
    told: &[SweptJoint],
) -> Vec<String> {
    let units = |joint: usize| match robot.chain()[joint].kind {
        JointKind::Revolute => ["rad/s", "rad", "N·m"],
        JointKind::Prismatic => ["m/s", "m", "N"],
    };
    let mut lines = vec![
        "Sweep: one joint after the other, there and back at constant speeds, all others at rest:"
            .to_owned(),
    ];
    for pass in &sweep.passes {
        let [speed, [low, high]] =
            [[pass.speed; 2], pass.between].map(|of| of.map(|of| significant(of, 3)));
        let [per_s, unit, _] = units(pass.joint);
        let (joint, speed) = (pass.joint + 1, &speed[0]);
        lines.push(format!("  joint {joint}: {speed} {per_s} between {low} and {high} {unit}"));
    }
    // Where noise is assumed, so are standard deviations.
    let figures = match assignment.measured_noise {
        true => {
            ", with the standard deviation of the largest torque of each: beside fc, fv and off alone, and in brackets if the joint had all of \
             them at once"
        }
        false => "",
    };
    lines.push(format!("Friction terms that it tells apart{figures}:"));
    for SweptJoint { joint, stribeck, terms } in told {
        let [per_s, _, torque] = units(*joint);
        let named = |kind: ParameterKind| match kind {
            ParameterKind::Fs => {
                format!("{} (of {} {per_s})", kind.symbol(), significant(*stribeck, 2))
            }
            kind => kind.symbol().to_owned(),
        };
        let number = |of: Option<f64>| of.map_or_else(|| "–".to_owned(), |of| significant(of, 2));
        let (told, not): (Vec<&Term>, Vec<&Term>) = terms.iter().partition(|of| of.alone.is_some());
        let told = told.into_iter().map(|of| {
            let deviations = match assignment.measured_noise {
                true => format!(" {} ({}) {torque}", number(of.alone), number(of.beside_all)),
                false => String::new(),
            };
            named(of.kind) + &deviations
        });
        let words: Vec<String> = told.collect();
        let not: Vec<String> = not.into_iter().map(|of| named(of.kind)).collect();
        let not = if not.is_empty() { String::new() } else { format!("; NOT {}", not.join(", ")) };
        lines.push(format!("  joint {}: {}{not}", joint + 1, words.join(", ")));
    }
    lines
}

/// The same with the noise that it is of, and what of the limits it uses.
pub fn sweep_text(assignment: &Assignment, checked: Checked<'_>, lines: &[String]) -> String {
    let (length, conditions) =
        (significant(checked.duration_s, 4), conditions(assignment, checked.used));
    format!("{length} s\n{}\n\n{conditions}", lines.join("\n"))
}
