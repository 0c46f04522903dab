//! Insufficient parameters of a result as text: the motion that each joint needs, its duration and
//! its effect.

use std::fmt::Write as _;

use didim_dynamics::robot::{JointIndex, JointKind, Robot};
use didim_identification::excitation::{self, Advice, JointExcitation};

use super::design::closing_warning;
use crate::analysis::{AdviceForResult, Assignment, TaskParameter};
use crate::text::{align_table, significant_digits};

/// Maximum number of parameters to print per motion. They are those that improve most.
const MAX_SHOWN: usize = 6;
/// Smallest improvement factor of a standard deviation to print.
const MIN_IMPROVEMENT: f64 = 1.2;

/// Formats the advice for a result of an arm.
pub fn advice_text(robot: &Robot, assignment: &Assignment, advised: &AdviceForResult) -> String {
    let mut text = String::new();
    for judged in advised.uses.iter().filter(|of| of.applicable.is_some() || !of.reasons.is_empty())
    {
        let answer = match judged.applicable {
            Some(true) => "yes",
            Some(false) => "no",
            None => "undecided",
        };
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{}: {answer}", judged.usage);
        for reason in &judged.reasons {
            let _ = writeln!(text, "  {reason}");
        }
    }
    text + "\n" + &missing_text(robot, assignment, advised)
}

/// Formats the advice without the verdict.
pub fn missing_text(robot: &Robot, assignment: &Assignment, advised: &AdviceForResult) -> String {
    let AdviceForResult { advice, sufficient_uncertainty: enough, .. } = advised;
    let mut text = String::new();
    let percent = format!("{} %", significant_digits(100.0 * enough, 2));
    let count = advice.missing_parameters.len();
    let _ = match count {
        0 => writeln!(
            text,
            "noise leaves no identifiable parameter uncertain by more than {percent}"
        ),
        _ => writeln!(text, "noise leaves these parameters uncertain by more than {percent}:"),
    };
    if count > 0 {
        text += &table(assignment, advice);
        text += &joints(robot, assignment, advised);
    }
    let mut before = &advice.deviations;
    for (number, piece) in (1..).zip(&advice.motions) {
        text += &piece_text(number, robot, piece);
        text += &improved_text(assignment, advice, before, &piece.deviations);
        before = &piece.deviations;
    }
    text += &remaining_text(assignment, advised, before);
    text
}

fn table(assignment: &Assignment, advice: &Advice) -> String {
    let then = advice.motions.last().map(|piece| &piece.deviations);
    let rows: Vec<Vec<String>> = advice
        .missing_parameters
        .iter()
        .map(|&k: &usize| {
            let TaskParameter { name, unit, value, .. } = &assignment.parameters[k];
            let value = value.unwrap_or(f64::NAN);
            let share = |deviation: f64| {
                let relative = significant_digits(100.0 * deviation / value.abs(), 2);
                [significant_digits(deviation, 2), format!("{relative} %")]
            };
            let now = share(advice.deviations[k]);
            let then = then.map_or_else(|| ["–".into(), "–".into()], |of| share(of[k]));
            let words = [name.clone(), significant_digits(value, 3)];
            words.into_iter().chain(now).chain(then).chain([(*unit).to_owned()]).collect()
        })
        .collect();
    align_table(&["parameter", "value", "σ now", "relative", "σ then", "relative", "unit"], &rows)
}

/// Formats the range of motion of the joints with insufficient parameters.
fn joints(robot: &Robot, assignment: &Assignment, advised: &AdviceForResult) -> String {
    let mut text = String::new();
    let joint_of = |k: &usize| robot.parameters().parameters()[assignment.task.columns[*k]].joint;
    for ((joint, reached), limits) in
        advised.reached_per_joint.iter().enumerate().zip(robot.limits())
    {
        let names: Vec<&str> = (advised.advice.missing_parameters.iter())
            .filter(|k| joint_of(k) == JointIndex::new(joint))
            .map(|k| assignment.parameters[*k].name.as_str())
            .collect();
        if names.is_empty() {
            continue;
        }
        let kind = robot.chain()[joint].kind;
        let [low, high] = reached.position.map(|at| position_text(kind, at));
        let _ = writeln!(
            text,
            "joint {} never moved faster than {} ({}), nor accelerated by more than {}, and stayed \
             between {low} and {high}: {}",
            robot.joint_label(JointIndex::new(joint)),
            speed_text(kind, reached.highest_speed()),
            limits.velocity_max.map_or_else(
                || "its limit is unknown".to_owned(),
                |most| format!("{} of its limit", share_text(reached.highest_speed() / most)),
            ),
            acceleration_text(kind, reached.largest_acceleration()),
            names.join(", ")
        );
    }
    text
}

fn piece_text(number: usize, robot: &Robot, piece: &excitation::Advised) -> String {
    let excitations = &piece.excitations;
    let kind = |joint: usize| robot.chain()[joint].kind;
    let moving: Vec<String> = excitations
        .excitations
        .iter()
        .map(|excitation: &JointExcitation| {
            let JointExcitation { joint, reversal_position: to, repetitions: times } = *excitation;
            let [fastest, hardest] = excitations.peaks(excitation);
            format!(
                "joint {} from {} to {} and back, {times} times (up to {}, {})",
                robot.joint_label(joint),
                position_text(kind(joint.position()), excitations.posture[joint]),
                position_text(kind(joint.position()), to),
                speed_text(kind(joint.position()), fastest),
                acceleration_text(kind(joint.position()), hardest)
            )
        })
        .collect();
    let resting: Vec<String> = (excitations.posture.iter().enumerate())
        .filter(|(joint, _)| {
            excitations.excitations.iter().all(|of| of.joint != JointIndex::new(*joint))
        })
        .map(|(joint, at)| {
            let label = robot.joint_label(JointIndex::new(joint));
            format!("{label} at {}", position_text(kind(joint), *at))
        })
        .collect();
    let rest = match resting.is_empty() {
        true => String::new(),
        false => format!(", joints at rest: {}", resting.join(", ")),
    };
    format!("\n{number}. {} s: {}{rest}\n", excitations.duration_s, moving.join(", with "))
}

/// Formats the parameters that a motion improves most.
fn improved_text(
    assignment: &Assignment,
    advice: &Advice,
    before: &[f64],
    after: &[f64],
) -> String {
    let mut helped: Vec<(usize, f64)> = (advice.missing_parameters.iter())
        .map(|&k| (k, before[k] / after[k]))
        .filter(|(_, times)| *times >= MIN_IMPROVEMENT)
        .collect();
    helped.sort_by(|a, b| b.1.total_cmp(&a.1));
    let more = helped.len().saturating_sub(MAX_SHOWN);
    let mut text: String = helped
        .iter()
        .take(MAX_SHOWN)
        .map(|&(k, _): &(usize, f64)| {
            let TaskParameter { name, unit, value, .. } = &assignment.parameters[k];
            let relative = |deviation: f64| share_text(deviation / value.unwrap_or(f64::NAN).abs());
            format!(
                "   would bring σ of {name} from {} to {} {unit} ({} to {})\n",
                significant_digits(before[k], 2),
                significant_digits(after[k], 2),
                relative(before[k]),
                relative(after[k])
            )
        })
        .collect();
    if more > 0 {
        let _ = writeln!(text, "   and {more} others less");
    }
    text
}

/// Formats the parameters that stay uncertain, and those that no motion improves.
fn remaining_text(assignment: &Assignment, advised: &AdviceForResult, then: &[f64]) -> String {
    let AdviceForResult { advice, sufficient_uncertainty: enough, .. } = advised;
    let name = |k: usize| assignment.parameters[k].name.as_str();
    let mut text = String::from("\n");
    let value = |k: usize| assignment.parameters[k].value.unwrap_or(f64::NAN).abs();
    let undetermined: Vec<String> = (advice.missing_parameters.iter())
        .filter(|&&k| then[k] > enough * value(k))
        .map(|&k| format!("{} ({})", name(k), share_text(then[k] / value(k))))
        .collect();
    if !undetermined.is_empty() {
        let _ = writeln!(
            text,
            "still uncertain after these motions: {}; `didim design --parameters` moves all \
                joints at once for them",
            undetermined.join(", ")
        );
    }
    if !advice.small_parameters.is_empty() {
        let names: Vec<&str> = advice.small_parameters.iter().map(|k| name(*k)).collect();
        let _ = writeln!(
            text,
            "too small compared with the noise for all of these motions, even if all others \
                were known: {}; record with less noise, or leave them out",
            names.join(", ")
        );
    }
    if !advised.not_by_noise.is_empty() {
        let share_of =
            |(k, combined): &(usize, f64)| format!("{} ({})", name(*k), share_text(*combined));
        let names: Vec<String> = advised.not_by_noise.iter().map(share_of).collect();
        let _ = writeln!(
            text,
            "limited by model error and configured values; more data of this kind will not \
                help: {}",
            names.join(", ")
        );
    }
    let [now, after] = advice.torque.map(share_text);
    let _ = write!(text, "torque uncertainty from noise, over all tried motions: {now}");
    let _ = match advice.motions.is_empty() {
        true => writeln!(text),
        false => writeln!(text, ", and {after} with all of this"),
    };
    let noise = if assignment.measured_noise { "the residuals of the result" } else { "ASSUMED" };
    let _ = writeln!(text, "noise: {noise}; each σ is with the result and all pieces before it");
    if !advice.motions.is_empty() {
        text += &closing_warning(assignment);
    }
    text
}

fn share_text(of: f64) -> String {
    format!("{} %", significant_digits(100.0 * of, 2))
}

fn position_text(kind: JointKind, at: f64) -> String {
    match kind {
        JointKind::Revolute => format!("{:.0}°", at.to_degrees()),
        JointKind::Prismatic => format!("{:.0} mm", 1e3 * at),
    }
}

fn speed_text(kind: JointKind, of: f64) -> String {
    let unit = if kind == JointKind::Revolute { "rad/s" } else { "m/s" };
    format!("{} {unit}", significant_digits(of, 2))
}

fn acceleration_text(kind: JointKind, of: f64) -> String {
    format!("{}²", speed_text(kind, of))
}
