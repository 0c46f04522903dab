//! Torque gains as text.

use didim_dynamics::robot::Robot;
use didim_identification::identification::{PayloadLimits, Scale};

use super::payload::deviation_heading;
use crate::analysis::{FoundGain, FoundGains};
use crate::text::{align_table, significant_digits, to_uncertainty};

/// Maximum number of digits of a value.
const MAX_DIGITS: usize = 5;

/// Formats the gains with the configured ones, the arm's parameters with these gains, lines for the
/// cell file, and notes.
pub fn gains_text(found: &FoundGains, robot: &Robot) -> String {
    let none = || "–".to_owned();
    let rows = found.gains.iter().zip(&found.relative_error_per_joint);
    let rows: Vec<Vec<String>> = rows
        .map(|(gain, error)| {
            let shown = |show: &dyn Fn(f64, f64) -> String| {
                gain.found.map_or_else(none, |of| show(of.value, of.standard_deviation))
            };
            vec![
                robot.joint_label(gain.joint),
                significant_digits(gain.configured, MAX_DIGITS),
                shown(&|value, sigma| to_uncertainty(value, sigma, MAX_DIGITS)),
                shown(&|_, sigma| significant_digits(sigma, 2)),
                gain.unit.to_owned(),
                shown(&|value, _| significant_digits(value / gain.configured, 4)),
                format!("{:.2} %", 100.0 * error),
            ]
        })
        .collect();
    let header = [
        "joint",
        "stated",
        "found",
        deviation_heading(false),
        "unit",
        "found / stated",
        "not explained",
    ];
    let mut text = align_table(&header, &rows);

    text += &match found.scale {
        Scale::Load(_) => "\nparameters of the arm without the load, with these gains\n".to_owned(),
        Scale::Reference(joint) => format!(
            "\nparameters of the arm in units of drive {}: the true ones are these times true \
            over stated gain of this joint\n",
            robot.joint_label(joint)
        ),
    };
    let rows: Vec<Vec<String>> = (found.parameters.iter())
        .map(|of| {
            let (value, sigma) = (of.found.value, of.found.standard_deviation);
            let value = to_uncertainty(value, sigma, MAX_DIGITS);
            let description = robot.parameter_description(&of.name).unwrap_or_default();
            let sigma = significant_digits(sigma, 2);
            vec![of.name.clone(), value, sigma, of.unit.to_owned(), description]
        })
        .collect();
    text += &align_table(&["name", "value", deviation_heading(false), "unit", "of"], &rows);

    let lines = |gain: &FoundGain| Some((gain.joint, gain.cell_line.clone()?));
    let lines: Vec<_> = found.gains.iter().filter_map(lines).collect();
    if !lines.is_empty() {
        text += "\nfor the cell file, under [[bus.drives]]\n";
        lines
            .into_iter()
            .for_each(|(joint, line)| text += &format!("{line} # {}\n", robot.joint_label(joint)));
    }
    text += "\n";
    notes(found, robot).into_iter().for_each(|note| text += &format!("note: {note}\n"));
    text
}

fn joints<'a>(robot: &Robot, gains: impl Iterator<Item = &'a FoundGain>) -> Option<String> {
    let joints: Vec<String> = gains.map(|gain| robot.joint_label(gain.joint)).collect();
    (!joints.is_empty()).then(|| joints.join(", "))
}

fn notes(found: &FoundGains, robot: &Robot) -> Vec<String> {
    let mut notes = Vec::new();
    let mut add_note = |gains: Option<String>, what: &str| {
        notes.extend(gains.map(|gains| format!("joints {gains}: {what}")));
    };
    add_note(
        joints(robot, found.gains.iter().filter(|gain| gain.found.is_none())),
        "the recordings do not identify the gain, so the configured value stays; parameters of \
            these joints alone are not identifiable either",
    );
    let against = |gain: &&FoundGain| gain.found.is_some_and(|of| of.value < 0.0);
    add_note(
        joints(robot, found.gains.iter().filter(against)),
        "the sign is opposite to the \
        configured one",
    );
    add_note(
        joints(robot, found.gains.iter().filter(|gain| gain.key.is_none())),
        "the cell file has no torque gain; multiply by this factor at the conversion to N·m",
    );
    if let Scale::Reference(joint) = found.scale {
        notes.push(format!(
            "without a load, gains and parameters are proportional to the configured gain of \
                joint {}, which is unchecked; a second recording with a known load \
                (--loaded) identifies it; σ includes noise only, no model error",
            robot.joint_label(joint)
        ));
        return notes;
    }
    notes.push(match &found.centre {
        Some(centre) => format!(
            "the recordings {} the stated centre for the stated mass: χ² {} of {} (by chance with \
            a probability of {})",
            if centre.is_significant(&PayloadLimits::default()) {
                "contradict"
            } else {
                "agree with"
            },
            significant_digits(centre.chi_squared, 3),
            centre.degrees_of_freedom,
            significant_digits(centre.probability, 2)
        ),
        None => "the recordings do not identify the centre of the load; the configured centre \
            is assumed"
            .to_owned(),
    });
    notes.push(
        "gains and parameters are proportional to the configured mass, which is unchecked; σ \
            includes noise only, no errors of the model or of the load"
            .to_owned(),
    );
    notes
}
