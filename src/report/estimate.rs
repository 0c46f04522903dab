//! An estimate as tables for people.

use core::fmt::Write as _;
use didim_dynamics::robot::{JointIndex, Robot};

use didim_identification::identification::{Estimate, ParameterEstimate};

use super::uses::UseLine;
use super::{convergence, uses};
use crate::text::{align_table, significant_digits, to_uncertainty};

/// True value of a parameter, if known: from a simulated arm.
pub type TruthOf<'a> = &'a dyn Fn(&str) -> Option<f64>;

/// Formats one line per parameter: value, unit, statistical and combined uncertainty, and both
/// uncertainties relative to the value.
pub fn parameter_table(estimate: &Estimate) -> String {
    let rows: Vec<Vec<String>> = estimate
        .parameters
        .iter()
        .map(|p| {
            let share = 100.0 * p.combined_standard_deviation / p.value.abs();
            vec![
                p.name.clone(),
                value_text(p),
                p.unit.to_owned(),
                significant_digits(p.standard_deviation, 2),
                significant_digits(p.combined_standard_deviation, 2),
                relative_text(p),
                format!("{} %", significant_digits(share, 2)),
            ]
        })
        .collect();
    let header =
        ["parameter", "value", "unit", "± statistical", "± combined", "relative", "combined"];
    let mut text = align_table(&header, &rows);
    if !estimate.nominal.is_empty() {
        let _ = writeln!(text, "kept at their nominal values: {}", fixed_parameters(estimate));
    }
    text
}

/// Lists the parameters that were not identified and are fixed at their nominal values.
pub(super) fn fixed_parameters(estimate: &Estimate) -> String {
    let parameters = estimate
        .nominal
        .iter()
        .map(|p| format!("{} {} {}", p.name, significant_digits(p.value, 4), p.unit));
    parameters.collect::<Vec<_>>().join(", ")
}

/// Formats the parameters next to their true values: true value, estimate, unit, relative standard
/// deviation, and the error in standard deviations.
pub fn truth_table(estimate: &Estimate, truth: TruthOf<'_>) -> String {
    let rows: Vec<Vec<String>> = estimate
        .parameters
        .iter()
        .map(|p| {
            let (true_value, deviation) = match truth(&p.name) {
                Some(t) => (
                    significant_digits(t, 4),
                    format!("{:+.1}", (p.value - t) / p.standard_deviation),
                ),
                None => ("–".to_owned(), "–".to_owned()),
            };
            vec![
                p.name.clone(),
                true_value,
                value_text(p),
                p.unit.to_owned(),
                relative_text(p),
                deviation,
            ]
        })
        .collect();
    align_table(&["parameter", "truth", "estimate", "unit", "relative σ", "deviation [σ]"], &rows)
}

/// Formats errors per joint, conditioning, convergence and the verdict with its reasons.
pub fn summary(estimate: &Estimate, robot: &Robot) -> String {
    let delays = estimate.torque_delay_per_joint.iter().map(|delay| match delay {
        Some(delay) => format!(
            "{} ± {}",
            significant_digits(1e6 * delay.delay_s, 3),
            significant_digits(1e6 * delay.standard_deviation_s, 2)
        ),
        None => "–".to_owned(),
    });
    let joints: Vec<Vec<String>> = estimate
        .relative_error_per_joint
        .iter()
        .zip(&estimate.rms_error_per_joint_nm)
        .zip(&estimate.durbin_watson_per_joint)
        .zip(delays)
        .enumerate()
        .map(|(joint, (((relative, rms), durbin_watson), delay))| {
            vec![
                format!("joint {}", robot.joint_label(JointIndex::new(joint))),
                format!("{:.2} %", 100.0 * relative),
                significant_digits(*rms, 3),
                format!("{durbin_watson:.2}"),
                delay,
            ]
        })
        .collect();
    let header = ["", "relative error", "rms [N·m]", "Durbin–Watson", "torque delay [µs]"];
    let mut text = align_table(&header, &joints);
    if !estimate.convergence.is_empty() {
        text += "\n";
        text += &convergence::table(&estimate.convergence);
    }
    text += &format!(
        "\n{} on {}: {} samples, {} rows, relative error {:.2} %, condition number {:.1}\n",
        estimate.method,
        estimate.robot,
        estimate.samples,
        estimate.rows,
        100.0 * estimate.relative_error,
        estimate.condition_number
    );
    text += "\n";
    text += &uses_table(estimate);
    text += "\n";
    if estimate.verdict.applicable {
        text += "verdict: applicable\n";
    } else {
        text += "verdict: NOT applicable\n";
    }
    for reason in &estimate.verdict.reasons {
        text += &format!("  - {reason}\n");
    }
    for note in &estimate.verdict.notes {
        text += &format!("  note: {note}\n");
    }
    text
}

/// Formats a table of the uses. Below each row is the meaning of its figure.
fn uses_table(estimate: &Estimate) -> String {
    let lines: Vec<UseLine> = uses::lines(estimate).collect();
    let row = |line: &UseLine| {
        vec![line.usage.to_string(), line.answer.into(), line.figure.clone(), line.limit.clone()]
    };
    let rows: Vec<Vec<String>> = lines.iter().map(row).collect();
    let table = align_table(&["use", "usable", "figure", "limit"], &rows);
    let mut shown = table.lines();
    let mut text = shown.next().map_or(String::new(), |header| format!("{header}\n"));
    for (row, UseLine { meaning, .. }) in shown.zip(&lines) {
        let _ = write!(text, "{row}\n    {meaning}\n");
    }
    text
}

/// Formats a value with the digits that its uncertainty justifies: down to a tenth of the standard
/// deviation.
pub fn value_text(p: &ParameterEstimate) -> String {
    short_value(p, 7)
}

/// Formats a value like [`value_text`], but with a maximum number of digits.
pub fn short_value(p: &ParameterEstimate, most: usize) -> String {
    to_uncertainty(p.value, p.standard_deviation, most)
}

fn relative_text(p: &ParameterEstimate) -> String {
    format!("{} %", significant_digits(100.0 * p.relative_standard_deviation, 2))
}
