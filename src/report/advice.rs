//! Insufficient parameters of a result as text: the motion that each joint needs, its duration and
//! its effect.

use std::fmt::Write as _;

use didim_dynamics::robot::{JointIndex, JointKind, Robot};
use didim_identification::excitation::{self, Advice, JointExcitation};

use super::design::closing_warning;
use crate::analysis::{AdviceForResult, Assignment, TaskParameter};
use crate::text::{align_table, significant_digits, to_uncertainty};

/// Maximum number of digits of a value.
const MAX_DIGITS: usize = 5;
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
    text + "\n" + &MissingAdvice::new(robot, assignment, advised).text()
}

/// A motion that improves parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionAdvice {
    /// The motion: its length, the joints that move and those that rest.
    pub motion: String,
    /// Its effect on the parameters that it improves most, one a line.
    pub effects: Vec<String>,
}

/// Insufficient parameters of a result and the motions that improve them, without the verdict.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MissingAdvice {
    /// Sentence above the table.
    pub introduction: String,
    /// Insufficient parameters: cells in the order of [`Self::HEADER`].
    pub rows: Vec<Vec<String>>,
    /// Range of motion of the joints with insufficient parameters, one joint a line.
    pub joints: Vec<String>,
    /// The motions, the most helpful first.
    pub motions: Vec<MotionAdvice>,
    /// Parameters that stay uncertain, and the conditions of these figures.
    pub remarks: Vec<String>,
}

impl MissingAdvice {
    /// Header of the table. Standard deviations are statistical.
    pub const HEADER: [&str; 8] =
        ["parameter", "value", "σ now", "relative", "σ then", "relative", "unit", "of"];
    /// Meaning of the columns.
    pub const LEGEND: &str = "σ: statistical standard deviations";

    /// Creates the advice for a result.
    pub fn new(robot: &Robot, assignment: &Assignment, advised: &AdviceForResult) -> Self {
        let AdviceForResult { advice, sufficient_uncertainty: enough, .. } = advised;
        let percent = format!("{} %", significant_digits(100.0 * enough, 2));
        let has_missing = !advice.missing_parameters.is_empty();
        let introduction = match has_missing {
            false => {
                format!("noise leaves no identifiable parameter uncertain by more than {percent}")
            }
            true => format!("noise leaves these parameters uncertain by more than {percent}:"),
        };
        let joints = if has_missing { joints(robot, assignment, advised) } else { Vec::new() };
        let mut before = &advice.deviations;
        let mut motions = Vec::new();
        for piece in &advice.motions {
            let effects = improvements(assignment, advice, before, &piece.deviations);
            motions.push(MotionAdvice { motion: motion_text(robot, piece), effects });
            before = &piece.deviations;
        }
        let remarks = remarks(assignment, advised, before);
        Self { introduction, rows: rows(assignment, advice), joints, motions, remarks }
    }

    /// Returns advice that says only why there is none.
    pub fn from_problem(problem: String) -> Self {
        Self { introduction: problem, ..Self::default() }
    }

    /// Returns the advice as text for a terminal.
    pub fn text(&self) -> String {
        let mut text = format!("{}\n", self.introduction);
        if !self.rows.is_empty() {
            text += &align_table(&Self::HEADER, &self.rows);
            let _ = writeln!(text, "{}", Self::LEGEND);
        }
        for line in &self.joints {
            let _ = writeln!(text, "{line}");
        }
        for (number, MotionAdvice { motion, effects }) in (1..).zip(&self.motions) {
            let _ = writeln!(text, "\n{number}. {motion}");
            for effect in effects {
                let _ = writeln!(text, "   {effect}");
            }
        }
        text.push('\n');
        self.remarks.iter().for_each(|line| text += &format!("{line}\n"));
        text
    }
}

fn rows(assignment: &Assignment, advice: &Advice) -> Vec<Vec<String>> {
    let then = advice.motions.last().map(|piece| &piece.deviations);
    let row = |&k: &usize| {
        let TaskParameter { name, unit, value, description, .. } = &assignment.parameters[k];
        let value = value.unwrap_or(f64::NAN);
        let share = |deviation: f64| {
            let relative = significant_digits(100.0 * deviation / value.abs(), 2);
            [significant_digits(deviation, 2), format!("{relative} %")]
        };
        let now = share(advice.deviations[k]);
        let then = then.map_or_else(|| ["–".into(), "–".into()], |of| share(of[k]));
        let words = [name.clone(), to_uncertainty(value, advice.deviations[k], MAX_DIGITS)];
        let last = [(*unit).to_owned(), description.clone().unwrap_or_default()];
        words.into_iter().chain(now).chain(then).chain(last).collect()
    };
    advice.missing_parameters.iter().map(row).collect()
}

/// Formats the range of motion of the joints with insufficient parameters.
fn joints(robot: &Robot, assignment: &Assignment, advised: &AdviceForResult) -> Vec<String> {
    let mut lines = Vec::new();
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
        lines.push(format!(
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
        ));
    }
    lines
}

/// Describes a motion.
fn motion_text(robot: &Robot, piece: &excitation::Advised) -> String {
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
    format!("{} s: {}{rest}", excitations.duration_s, moving.join(", with "))
}

/// Describes the effect on the parameters that a motion improves most, one a line.
fn improvements(
    assignment: &Assignment,
    advice: &Advice,
    before: &[f64],
    after: &[f64],
) -> Vec<String> {
    let mut helped: Vec<(usize, f64)> = (advice.missing_parameters.iter())
        .map(|&k| (k, before[k] / after[k]))
        .filter(|(_, times)| *times >= MIN_IMPROVEMENT)
        .collect();
    helped.sort_by(|a, b| b.1.total_cmp(&a.1));
    let more = helped.len().saturating_sub(MAX_SHOWN);
    let mut lines: Vec<String> = helped
        .iter()
        .take(MAX_SHOWN)
        .map(|&(k, _): &(usize, f64)| {
            let TaskParameter { name, unit, value, .. } = &assignment.parameters[k];
            let relative = |deviation: f64| share_text(deviation / value.unwrap_or(f64::NAN).abs());
            format!(
                "would bring σ of {name} from {} to {} {unit} ({} to {})",
                significant_digits(before[k], 2),
                significant_digits(after[k], 2),
                relative(before[k]),
                relative(after[k])
            )
        })
        .collect();
    if more > 0 {
        lines.push(format!("and {more} others less"));
    }
    lines
}

/// Describes the parameters that stay uncertain, and those that no motion improves.
fn remarks(assignment: &Assignment, advised: &AdviceForResult, then: &[f64]) -> Vec<String> {
    let AdviceForResult { advice, sufficient_uncertainty: enough, .. } = advised;
    let name = |k: usize| assignment.parameters[k].name.as_str();
    let mut lines = Vec::new();
    let value = |k: usize| assignment.parameters[k].value.unwrap_or(f64::NAN).abs();
    let undetermined: Vec<String> = (advice.missing_parameters.iter())
        .filter(|&&k| then[k] > enough * value(k))
        .map(|&k| format!("{} ({})", name(k), share_text(then[k] / value(k))))
        .collect();
    if !undetermined.is_empty() {
        lines.push(format!(
            "still uncertain after these motions: {}; `didim design --parameters` moves all \
                joints at once for them",
            undetermined.join(", ")
        ));
    }
    if !advice.small_parameters.is_empty() {
        let names: Vec<&str> = advice.small_parameters.iter().map(|k| name(*k)).collect();
        lines.push(format!(
            "too small compared with the noise for all of these motions, even if all others \
                were known: {}; record with less noise, or leave them out",
            names.join(", ")
        ));
    }
    if !advised.not_by_noise.is_empty() {
        let share_of =
            |(k, combined): &(usize, f64)| format!("{} ({})", name(*k), share_text(*combined));
        let names: Vec<String> = advised.not_by_noise.iter().map(share_of).collect();
        lines.push(format!(
            "limited by model error and configured values; more data of this kind will not \
                help: {}",
            names.join(", ")
        ));
    }
    let [now, after] = advice.torque.map(share_text);
    let with_motions = match advice.motions.is_empty() {
        true => String::new(),
        false => format!(", and {after} with all of this"),
    };
    lines.push(format!(
        "torque uncertainty from noise, over all tried motions: {now}{with_motions}"
    ));
    let noise = if assignment.measured_noise { "the residuals of the result" } else { "ASSUMED" };
    lines.push(format!("noise: {noise}; each σ is with the result and all pieces before it"));
    if !advice.motions.is_empty() {
        lines.extend(closing_warning(assignment).lines().map(str::to_owned));
    }
    lines
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
