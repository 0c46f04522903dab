//! An estimate as tables for people.

use core::fmt::Write as _;
use didim_dynamics::robot::{JointIndex, Robot};

use didim_identification::identification::{Estimate, ParameterEstimate};

use super::names::name_joints;
use super::uses::{Headline, UseLine, shown_notes};
use super::{convergence, uses};
use crate::text::{align_table, significant_digits, to_uncertainty};

/// True value of a parameter, if known: from a simulated arm.
pub type TruthOf<'a> = &'a dyn Fn(&str) -> Option<f64>;

/// Formats one line per parameter: value, unit, statistical and combined uncertainty, and both
/// uncertainties relative to the value.
pub fn parameter_table(estimate: &Estimate) -> String {
    let has_names = estimate.parameters.iter().any(|p| p.description.is_some());
    let mut rows: Vec<Vec<String>> = estimate
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
    let mut header =
        vec!["parameter", "value", "unit", "± statistical", "± combined", "relative", "combined"];
    // The names of joints and links stand last, for they are as long as a user made them.
    if has_names {
        header.push("of");
        for (row, p) in rows.iter_mut().zip(&estimate.parameters) {
            row.push(p.description.clone().unwrap_or_default());
        }
    }
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
            to_uncertainty(1e6 * delay.delay_s, 1e6 * delay.standard_deviation_s, 4),
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
            let label = format!("joint {}", robot.joint_label(JointIndex::new(joint)));
            // A joint without a recorded torque has no figures.
            if relative.is_nan() && rms.is_nan() {
                return core::iter::once(label).chain(vec!["–".to_owned(); 4]).collect();
            }
            vec![
                label,
                format!("{:.2} %", 100.0 * relative),
                significant_digits(*rms, 3),
                format!("{durbin_watson:.2}"),
                delay,
            ]
        })
        .collect();
    let header =
        ["", "relative error", "rms [N·m]", "Durbin–Watson", "torque delay ± statistical [µs]"];
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
    text + "\n" + &verdict_text(estimate, robot)
}

/// Formats the verdict: a sentence, a line for each use, and the reasons against the required uses,
/// the most probable cause first.
fn verdict_text(estimate: &Estimate, robot: &Robot) -> String {
    let mut text = format!("{}\n\n", Headline::new(estimate, robot).text());
    text += &uses_table(estimate, robot);
    text += match estimate.verdict.applicable {
        true => "\nverdict: applicable\n",
        false => "\nverdict: NOT applicable\n",
    };
    for reason in &estimate.verdict.reasons {
        text += &format!("  - {}\n", name_joints(&reason.to_string(), robot));
    }
    for note in shown_notes(estimate) {
        text += &format!("  note: {}\n", name_joints(&note.to_string(), robot));
    }
    text
}

/// Formats a table with a line for each use.
fn uses_table(estimate: &Estimate, robot: &Robot) -> String {
    let lines: Vec<UseLine> = uses::lines(estimate, robot).collect();
    let name = |line: &UseLine| line.usage.to_string();
    let width = lines.iter().map(|line| name(line).chars().count()).max().unwrap_or(0);
    let mut text = format!("{:width$}  usable     because\n", "use");
    for line in &lines {
        let _ = writeln!(text, "{:width$}  {:9}  {}", name(line), line.answer, line.because);
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
