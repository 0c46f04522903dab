//! A constant-speed sweep for friction as text: its speeds, and the friction terms that it
//! distinguishes.

use didim_dynamics::robot::{JointKind, ParameterKind, Robot};
use didim_identification::excitation::{FrictionTermPrediction, Sweep, SweptJoint};

use super::design::{CheckedMotion, conditions_text};
use crate::analysis::Assignment;
use crate::text::significant_digits;

/// Describes the constant-speed sweeps and the terms that they identify. The lines are for the
/// header of a file and for people.
pub fn sweep_lines(
    robot: &Robot,
    assignment: &Assignment,
    sweep: &Sweep,
    reported: &[SweptJoint],
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
            [[pass.speed; 2], pass.end_positions].map(|of| of.map(|of| significant_digits(of, 3)));
        let [per_s, unit, _] = units(pass.joint.position());
        let (joint, speed) = (robot.joint_label(pass.joint), &speed[0]);
        lines.push(format!("  joint {joint}: {speed} {per_s} between {low} and {high} {unit}"));
    }
    // If the noise is assumed, the standard deviations are assumed as well.
    let figures = match assignment.measured_noise {
        true => {
            ", with the standard deviation of the largest torque of each: next to fc, fv and off \
            alone, and in brackets if the joint had all of them at once"
        }
        false => "",
    };
    lines.push(format!("Friction terms that it tells apart{figures}:"));
    for SweptJoint { joint, stribeck_speed: stribeck, terms } in reported {
        let [per_s, _, torque] = units(joint.position());
        let named = |kind: ParameterKind| match kind {
            ParameterKind::Fs => {
                format!("{} (of {} {per_s})", kind.symbol(), significant_digits(*stribeck, 2))
            }
            kind => kind.symbol().to_owned(),
        };
        let number =
            |of: Option<f64>| of.map_or_else(|| "–".to_owned(), |of| significant_digits(of, 2));
        let (term_line, not): (Vec<&FrictionTermPrediction>, Vec<&FrictionTermPrediction>) =
            terms.iter().partition(|of| of.separate_deviation.is_some());
        let term_lines = term_line.into_iter().map(|of| {
            let deviations = match assignment.measured_noise {
                true => format!(
                    " {} ({}) {torque}",
                    number(of.separate_deviation),
                    number(of.joint_deviation)
                ),
                false => String::new(),
            };
            named(of.kind) + &deviations
        });
        let words: Vec<String> = term_lines.collect();
        let not: Vec<String> = not.into_iter().map(|of| named(of.kind)).collect();
        let not = if not.is_empty() { String::new() } else { format!("; NOT {}", not.join(", ")) };
        let joint = robot.joint_label(*joint);
        lines.push(format!("  joint {joint}: {}{not}", words.join(", ")));
    }
    lines
}

/// Formats these lines, the noise that they assume, and the used share of the limits.
pub fn sweep_text(assignment: &Assignment, checked: CheckedMotion<'_>, lines: &[String]) -> String {
    let (length, conditions) =
        (significant_digits(checked.duration_s, 4), conditions_text(assignment, checked.used));
    format!("{length} s\n{}\n\n{conditions}", lines.join("\n"))
}
