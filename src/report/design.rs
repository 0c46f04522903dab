//! A designed motion in words: what it tells, and what a person who runs it has to know.

use didim_core::excitation::{
    CHECK_HZ, Course as _, Design, LEAST_GAP_M, LimitKind, Nearest, Other, Predicted, Swept, Used,
};
use didim_core::identification::{KnownLoad, Payload, Uncertain};

use super::payload::{AXES, ENTRIES};
use crate::offline::{Assignment, Foretold, Lacking, WantedLoad, foretold_line};
use crate::text::{aligned, significant};

/// The header of a file: the arm, the limits, what was checked and what was not, and what is [foretold](foretold_lines) of the motion.
/// `keeps_time` says whether the arm follows it in time.
pub fn design_header(
    robot: &str,
    assignment: &Assignment,
    checked: Checked<'_>,
    foretold: &[String],
    keeps_time: bool,
) -> Vec<String> {
    let Checked { duration_s, used, nearest } = checked;
    // A sweep ends where its passes do, which is no round number.
    let duration_s = (1e3 * duration_s).round() / 1e3;
    let mut lines = vec![format!(
        "Motion for the robot {robot}, {duration_s} s, designed by didim. FIRST RUN IT AT 10 % SPEED."
    )];
    lines.extend(collision_words(assignment, nearest));
    let kinds = |limited: bool| {
        let has = |kind: &LimitKind| used.iter().any(|used| used.kind == *kind) == limited;
        let names: Vec<String> =
            LimitKind::ALL.iter().filter(|of| has(of)).map(ToString::to_string).collect();
        names.join(", ")
    };
    lines.push(format!("Checked at {CHECK_HZ} points per second: {}.", kinds(true)));
    let unchecked = kinds(false);
    if !unchecked.is_empty() {
        lines.push(format!("NOT checked, for no limit or no parameters are known: {unchecked}."));
    }
    if !keeps_time {
        lines.push(
            "The controller makes the time law: speeds, accelerations and torques are its own, and nothing is \
             foretold of what the motion tells."
                .into(),
        );
    }
    if let Some(moving) = moving(assignment) {
        lines.push(format!("{moving} at rest."));
    }
    if let Some(load) = &assignment.load {
        lines.push(format!("Torques are those with {}.", expected(load.expected)));
    }
    if !assignment.task.bounds.limits_torques() {
        lines.push("Without parameters the torque that the motion takes is not known.".into());
    }
    lines.push("Limits used (SI units):".into());
    lines.extend(used.iter().map(limit));
    if keeps_time {
        lines.extend_from_slice(foretold);
    }
    lines
}

/// A motion that was found to be within the limits.
#[derive(Clone, Copy, Debug)]
pub struct Checked<'a> {
    /// Its length \[s\].
    pub duration_s: f64,
    /// How much of each limit it uses.
    pub used: &'a [Used],
    /// The narrowest gap along it, where shapes are stated.
    pub nearest: Option<Nearest>,
}

impl<'a> From<&'a Design> for Checked<'a> {
    fn from(design: &'a Design) -> Self {
        Self { duration_s: design.series.duration_s, used: &design.used, nearest: design.nearest }
    }
}

impl<'a> From<&'a Swept> for Checked<'a> {
    fn from(Swept { sweep, used, nearest }: &'a Swept) -> Self {
        Self { duration_s: sweep.duration_s(), used, nearest: *nearest }
    }
}

/// The standard deviation that each parameter would have, for the header of a file; nothing where noise is assumed.
pub fn foretold_lines(assignment: &Assignment, deviations: &[f64]) -> Vec<String> {
    if !assignment.measured_noise {
        return Vec::new();
    }
    let intro = "Standard deviations with this motion and what was known before it; `didim identify --designed` holds \
                 the result against them:";
    let of_each = assignment.parameters.iter().zip(deviations);
    let of_each = of_each.map(|(own, of)| foretold_line(&own.name, *of, own.unit));
    core::iter::once(intro.to_owned()).chain(of_each).collect()
}

/// How well `didim payload` would find a load, by a recording that was simulated, for the header of a file and for people.
pub fn load_lines(wanted: &WantedLoad, simulated: &Payload) -> Vec<String> {
    let mut lines = vec![format!(
        "Standard deviations of what `didim payload` finds of {}, by a simulated recording of this motion:",
        expected(wanted.expected)
    )];
    let mut line = |what: String, found: Uncertain, unit: &str| {
        lines.push(format!("  {what}: {} {unit}", significant(found.standard_deviation, 3)));
    };
    let load = &simulated.load;
    if let Some(found) = load.mass_kg {
        line("mass".to_owned(), found, "kg");
    }
    for (axis, found) in AXES.iter().zip(load.centre_m) {
        found.into_iter().for_each(|found| line(format!("centre {axis}"), found, "m"));
    }
    for (entry, found) in ENTRIES.iter().zip(load.inertia_kg_m2) {
        found.into_iter().for_each(|found| line(format!("inertia {entry}"), found, "kg·m²"));
    }
    if !simulated.not_told.is_empty() {
        for of in &simulated.parameters {
            line(format!("sum {}", of.name), of.found, of.unit);
        }
        lines.push(format!(
            "The joints that move do not tell {} by themselves, only the sums; one joint before them has to move too.",
            simulated.not_told.join(" ")
        ));
    }
    if !simulated.without_effect.is_empty() {
        let none = simulated.without_effect.join(" ");
        lines.push(format!("No motion of this arm shows {none} of a load."));
    }
    lines
}

fn expected(load: KnownLoad) -> String {
    let [x, y, z] = load.centre_m.map(|of| significant(of, 3));
    let mass = significant(load.mass_kg, 3);
    format!("a load of {mass} kg with its centre at {x}, {y}, {z} m in the frame of the last link")
}

/// Which joints move, where not all do.
fn moving(assignment: &Assignment) -> Option<String> {
    let moving = &assignment.task.moving;
    let joints = |moves: bool| -> Vec<String> {
        let of = (1..).zip(moving).filter(|(_, of)| **of == moves);
        of.map(|(joint, _)| joint.to_string()).collect()
    };
    let standing = joints(false);
    let words =
        || format!("Joints that move: {}; {}", joints(true).join(", "), standing.join(", "));
    (!standing.is_empty()).then(words)
}

/// What a motion was foretold to tell, beside what came of it, as a table; and how far apart they are altogether.
pub fn foretold_text(foretold: &[Foretold]) -> String {
    let row = |of: &Foretold| {
        let [foretold, achieved] = [of.foretold, of.achieved].map(|value| significant(value, 3));
        vec![of.name.clone(), foretold, achieved, of.unit.clone(), format!("{:.2}", times(of))]
    };
    let rows: Vec<_> = foretold.iter().map(row).collect();
    let table = aligned(&["parameter", "σ foretold", "σ achieved", "unit", "times"], &rows);
    format!("\n{table}\n{}\n", foretold_summary(foretold))
}

/// So many times the foretold standard deviation came out.
pub(super) fn times(of: &Foretold) -> f64 {
    of.achieved / of.foretold
}

/// In one sentence how far they are apart.
pub(super) fn foretold_summary(foretold: &[Foretold]) -> String {
    let square: f64 = foretold.iter().map(|of| times(of).powi(2)).sum();
    let rms = (square / foretold.len() as f64).sqrt();
    let off = |of: &Foretold| times(of).ln().abs();
    let farthest = foretold.iter().max_by(|a, b| off(a).total_cmp(&off(b)));
    let farthest = farthest
        .map_or_else(String::new, |of| format!("; farthest {}, {:.2} times", of.name, times(of)));
    format!(
        "standard deviations: {rms:.2} times what was foretold, rms of {}{farthest}",
        foretold.len()
    )
}

/// What of collisions was checked, how near the arm comes, and what was not.
fn collision_words(assignment: &Assignment, nearest: Option<Nearest>) -> Vec<String> {
    let mut lines = Vec::new();
    let link = |number: usize| match number {
        0 => "the base".to_owned(),
        number => format!("link {number}"),
    };
    let pair = |of: usize, other: Other| match other {
        Other::Link(other) => format!("{} and {}", link(of), link(other)),
        Other::Side => format!("{} and the box", link(of)),
    };
    match assignment.task.bounds.shapes() {
        None => lines.push(
            "Collision NOT checked: neither of the arm with itself nor with anything around it."
                .into(),
        ),
        Some(shapes) => {
            let inside =
                if shapes.boxed { ", and all links but the base inside the box" } else { "" };
            let near = nearest.map_or_else(String::new, |of| {
                format!(" Nearest: {}, {:.0} mm.", pair(of.link, of.other), 1e3 * of.gap_m)
            });
            lines.push(format!(
                "Collision checked at {CHECK_HZ} points per second by the stated shapes, {:.0} mm apart: links that no \
                 joint connects{inside}.{near}",
                1e3 * LEAST_GAP_M
            ));
            lines.push(format!(
                "Collision NOT checked: links that a joint connects, tool, load, cables, and anything {}.",
                if shapes.boxed { "inside the box" } else { "around the arm" }
            ));
            if !shapes.shapeless.is_empty() {
                let links: Vec<String> = shapes.shapeless.iter().map(|of| link(*of)).collect();
                lines.push(format!(
                    "Collision NOT checked, for they have no shape: {}.",
                    links.join(", ")
                ));
            }
            if !shapes.always_near.is_empty() {
                let pairs: Vec<String> =
                    shapes.always_near.iter().map(|(of, other)| pair(*of, *other)).collect();
                lines.push(format!(
                    "Collision NOT checked, for their shapes are near in every posture: {}.",
                    pairs.join("; ")
                ));
            }
        }
    }
    if !assignment.unread_shapes.is_empty() {
        lines.push(format!(
            "Collision NOT checked, for their collision shapes are meshes, or cannot be read: {}.",
            assignment.unread_shapes.join(", ")
        ));
    }
    lines
}

/// The last line of what is printed.
pub(super) fn warning(assignment: &Assignment) -> &'static str {
    match assignment.task.bounds.shapes() {
        None => "collision NOT checked; first run it at 10 % speed\n",
        Some(_) => {
            "collision checked by the stated shapes alone, as the head of a file says; first run it at 10 % speed\n"
        }
    }
}

fn limit(used: &Used) -> String {
    let of = if used.of_motor { "motor" } else { "joint" };
    let [lowest, highest] = [used.lowest, used.highest].map(|value| significant(value, 5));
    format!(
        "  {of} {} {}: {lowest} to {highest}, {:.0} % used",
        used.joint,
        used.kind,
        100.0 * used.share
    )
}

/// What the motion is foretold to tell, as a table.
pub fn design_text(assignment: &Assignment, design: &Design, told: &Predicted) -> String {
    parameters_text(assignment, told) + &conditions(assignment, &design.used)
}

/// The noise that figures are of, the limits that a motion uses, and what was not checked: the end of what is printed.
pub fn conditions(assignment: &Assignment, used: &[Used]) -> String {
    let rows_per_s = significant(assignment.task.noise.rows_per_s, 3);
    let mut text = if assignment.measured_noise {
        format!("noise: the residuals of the result, {rows_per_s} rows per second\n")
    } else {
        format!(
            "noise: ASSUMED, 1 % of each joint's torque limit in {rows_per_s} independent rows per second; \
             compare motions by these σ, and take none for the uncertainty of a result\n"
        )
    };
    let most = |kind: LimitKind| {
        let of_kind = used.iter().filter(|used| used.kind == kind);
        of_kind.map(|used| used.share).max_by(f64::total_cmp)
    };
    let shares = LimitKind::ALL.into_iter().map(|kind| match most(kind) {
        Some(share) => format!("{kind} {:.0} %", 100.0 * share),
        None => format!("{kind} not limited"),
    });
    let shares: Vec<String> = shares.collect();
    text += &format!("of the limits it uses: {}\n", shares.join(", "));
    if let Some(moving) = moving(assignment) {
        text += &format!("{} at rest\n", moving.to_lowercase());
    }
    text + warning(assignment)
}

/// Of each parameter what is known and what would be.
fn parameters_text(assignment: &Assignment, told: &Predicted) -> String {
    let number = |value: Option<f64>| value.map_or_else(|| "–".into(), |of| significant(of, 3));
    let row = |(own, deviation): (&Lacking, &f64)| {
        let share = own.value.map(|value| 100.0 * deviation / value.abs());
        vec![
            own.name.clone(),
            number(own.value),
            number(own.standard_deviation),
            significant(*deviation, 3),
            own.unit.to_owned(),
            share.map_or_else(|| "–".into(), |share| format!("{} %", significant(share, 2))),
        ]
    };
    let rows: Vec<_> = assignment.parameters.iter().zip(&told.deviations).map(row).collect();
    let table = aligned(&["parameter", "value", "σ now", "σ then", "unit", "relative"], &rows);
    let condition = significant(told.condition_number, 3);
    format!(
        "{table}\ncondition number of the base columns of inertia along this motion: {condition} (unweighted, no friction)\n"
    )
}
