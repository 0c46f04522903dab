//! What a result lacks, in words: which joint moves how for how long, and what that brings.

use std::fmt::Write as _;

use didim_core::excitation::{self, Advice, Swing};
use didim_core::robot::{JointKind, Robot};

use super::design::warning;
use crate::offline::{Advised, Assignment, Lacking};
use crate::text::{aligned, significant};

/// What is printed of the parameters that a piece helps most.
const MOST_SHOWN: usize = 6;
/// A deviation that gets smaller by less than this is not worth a word.
const WORTH: f64 = 1.2;

/// The advice for a result of an arm.
pub fn advice_text(robot: &Robot, assignment: &Assignment, advised: &Advised) -> String {
    let mut text = String::new();
    for judged in advised.uses.iter().filter(|of| of.applicable.is_some() || !of.reasons.is_empty())
    {
        let answer = match judged.applicable {
            Some(true) => "yes",
            Some(false) => "no",
            None => "cannot be told",
        };
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{}: {answer}", judged.of);
        for reason in &judged.reasons {
            let _ = writeln!(text, "  {reason}");
        }
    }
    text + "\n" + &lacking_text(robot, assignment, advised)
}

/// The same without the verdict.
pub fn lacking_text(robot: &Robot, assignment: &Assignment, advised: &Advised) -> String {
    let Advised { advice, enough, .. } = advised;
    let mut text = String::new();
    let percent = format!("{} %", significant(100.0 * enough, 2));
    let count = advice.lacking.len();
    let _ = match count {
        0 => writeln!(
            text,
            "noise leaves no parameter that motions can tell uncertain by more than {percent}"
        ),
        _ => writeln!(text, "noise leaves these parameters uncertain by more than {percent}:"),
    };
    if count > 0 {
        text += &table(assignment, advice);
        text += &joints(robot, assignment, advised);
    }
    let mut before = &advice.deviations;
    for (number, piece) in (1..).zip(&advice.pieces) {
        text += &piece_text(number, robot, piece);
        text += &brought(assignment, advice, before, &piece.deviations);
        before = &piece.deviations;
    }
    text += &left(assignment, advised, before);
    text
}

fn table(assignment: &Assignment, advice: &Advice) -> String {
    let then = advice.pieces.last().map(|piece| &piece.deviations);
    let row = |&k: &usize| {
        let Lacking { name, unit, value, .. } = &assignment.parameters[k];
        let value = value.unwrap_or(f64::NAN);
        let share = |deviation: f64| {
            let relative = significant(100.0 * deviation / value.abs(), 2);
            [significant(deviation, 2), format!("{relative} %")]
        };
        let now = share(advice.deviations[k]);
        let then = then.map_or_else(|| ["–".into(), "–".into()], |of| share(of[k]));
        let words = [name.clone(), significant(value, 3)];
        words.into_iter().chain(now).chain(then).chain([(*unit).to_owned()]).collect()
    };
    let rows: Vec<Vec<String>> = advice.lacking.iter().map(row).collect();
    aligned(&["parameter", "value", "σ now", "relative", "σ then", "relative", "unit"], &rows)
}

/// How far the joints went whose parameters are lacking.
fn joints(robot: &Robot, assignment: &Assignment, advised: &Advised) -> String {
    let mut text = String::new();
    let joint_of = |k: &usize| robot.parameters().parameters()[assignment.task.columns[*k]].joint;
    for ((joint, reached), limits) in advised.reached.iter().enumerate().zip(robot.limits()) {
        let own: Vec<&str> = (advised.advice.lacking.iter())
            .filter(|k| joint_of(k) == joint)
            .map(|k| assignment.parameters[*k].name.as_str())
            .collect();
        if own.is_empty() {
            continue;
        }
        let kind = robot.chain()[joint].kind;
        let [low, high] = reached.position.map(|at| place(kind, at));
        let _ = writeln!(
            text,
            "joint {} never moved faster than {} ({}), nor accelerated by more than {}, and stayed between {low} \
             and {high}: {}",
            joint + 1,
            speed(kind, reached.speed()),
            limits.velocity_max.map_or_else(
                || "its limit is unknown".to_owned(),
                |most| format!("{} of its limit", share(reached.speed() / most)),
            ),
            acceleration(kind, reached.hardest()),
            own.join(", ")
        );
    }
    text
}

fn piece_text(number: usize, robot: &Robot, piece: &excitation::Advised) -> String {
    let swings = &piece.swings;
    let kind = |joint: usize| robot.chain()[joint].kind;
    let says = |swing: &Swing| {
        let Swing { joint, to, times } = *swing;
        let [fastest, hardest] = swings.peaks(swing);
        format!(
            "joint {} from {} to {} and back, {times} times (up to {}, {})",
            joint + 1,
            place(kind(joint), swings.posture[joint]),
            place(kind(joint), to),
            speed(kind(joint), fastest),
            acceleration(kind(joint), hardest)
        )
    };
    let moving: Vec<String> = swings.swings.iter().map(says).collect();
    let resting: Vec<String> = (swings.posture.iter().enumerate())
        .filter(|(joint, _)| swings.swings.iter().all(|of| of.joint != *joint))
        .map(|(joint, at)| format!("{} at {}", joint + 1, place(kind(joint), *at)))
        .collect();
    let rest = match resting.is_empty() {
        true => String::new(),
        false => format!(", joints at rest: {}", resting.join(", ")),
    };
    format!("\n{number}. {} s: {}{rest}\n", swings.duration_s, moving.join(", with "))
}

/// Those that a piece helps most.
fn brought(assignment: &Assignment, advice: &Advice, before: &[f64], after: &[f64]) -> String {
    let mut helped: Vec<(usize, f64)> = (advice.lacking.iter())
        .map(|&k| (k, before[k] / after[k]))
        .filter(|(_, times)| *times >= WORTH)
        .collect();
    helped.sort_by(|a, b| b.1.total_cmp(&a.1));
    let more = helped.len().saturating_sub(MOST_SHOWN);
    let says = |&(k, _): &(usize, f64)| {
        let Lacking { name, unit, value, .. } = &assignment.parameters[k];
        let relative = |deviation: f64| share(deviation / value.unwrap_or(f64::NAN).abs());
        format!(
            "   would bring σ of {name} from {} to {} {unit} ({} to {})\n",
            significant(before[k], 2),
            significant(after[k], 2),
            relative(before[k]),
            relative(after[k])
        )
    };
    let mut text: String = helped.iter().take(MOST_SHOWN).map(says).collect();
    if more > 0 {
        let _ = writeln!(text, "   and {more} others less");
    }
    text
}

/// What stays open, and what no motion changes.
fn left(assignment: &Assignment, advised: &Advised, then: &[f64]) -> String {
    let Advised { advice, enough, .. } = advised;
    let name = |k: usize| assignment.parameters[k].name.as_str();
    let mut text = String::from("\n");
    let value = |k: usize| assignment.parameters[k].value.unwrap_or(f64::NAN).abs();
    let open: Vec<String> = (advice.lacking.iter())
        .filter(|&&k| then[k] > enough * value(k))
        .map(|&k| format!("{} ({})", name(k), share(then[k] / value(k))))
        .collect();
    if !open.is_empty() {
        let _ = writeln!(
            text,
            "still uncertain after that: {}; `didim design` moves all joints at once for them (--parameters)",
            open.join(", ")
        );
    }
    if !advice.small.is_empty() {
        let names: Vec<&str> = advice.small.iter().map(|k| name(*k)).collect();
        let _ = writeln!(
            text,
            "too small beside the noise for any of these motions, even if all others were known: {}; take a less noisy \
             record, or leave them out",
            names.join(", ")
        );
    }
    if !advised.not_by_noise.is_empty() {
        let of = |(k, combined): &(usize, f64)| format!("{} ({})", name(*k), share(*combined));
        let names: Vec<String> = advised.not_by_noise.iter().map(of).collect();
        let _ = writeln!(
            text,
            "uncertain by what is stated and what the model lacks, not by noise, which more of the same does not change: {}",
            names.join(", ")
        );
    }
    let [now, after] = advice.torque.map(share);
    let _ =
        write!(text, "what noise leaves open of the torques of all motions that were tried: {now}");
    let _ = match advice.pieces.is_empty() {
        true => writeln!(text),
        false => writeln!(text, ", and {after} with all of this"),
    };
    let noise = if assignment.measured_noise { "the residuals of the result" } else { "ASSUMED" };
    let _ = writeln!(text, "noise: {noise}; each σ is with the result and all pieces before it");
    if !advice.pieces.is_empty() {
        text += warning(assignment);
    }
    text
}

fn share(of: f64) -> String {
    format!("{} %", significant(100.0 * of, 2))
}

fn place(kind: JointKind, at: f64) -> String {
    match kind {
        JointKind::Revolute => format!("{:.0}°", at.to_degrees()),
        JointKind::Prismatic => format!("{:.0} mm", 1e3 * at),
    }
}

fn speed(kind: JointKind, of: f64) -> String {
    let unit = if kind == JointKind::Revolute { "rad/s" } else { "m/s" };
    format!("{} {unit}", significant(of, 2))
}

fn acceleration(kind: JointKind, of: f64) -> String {
    format!("{}²", speed(kind, of))
}
