//! A designed motion as text: the parameters that it identifies, and notes for the person who runs
//! it.

use didim_dynamics::robot::NamedFrame;
use didim_identification::excitation::{
    CHECK_HZ, Course as _, Design, LimitKind, MIN_GAP_M, Nearest, Neighbour, Predicted,
    SweepDesign, UsedLimit, WallKind,
};
use didim_identification::identification::{DeclaredLoad, KnownLoad, Payload, UncertainValue};

use super::payload::{AXIS_NAMES, FrameView, INERTIA_NAMES};
use crate::analysis::{
    Assignment, ExpectedParameter, Floor, ShapeProblem, TaskParameter, UnreadShape, WantedLoad,
    expectation_line,
};
use crate::text::{align_table, significant_digits, to_uncertainty};

/// Maximum number of digits of a value.
const MAX_DIGITS: usize = 5;

/// Returns the header of a motion file: the arm, the limits, the checks, and the [expected
/// deviations](prediction_lines). `keeps_time` is true if the arm follows the motion in time.
pub fn design_header(
    robot: &str,
    assignment: &Assignment,
    checked: CheckedMotion<'_>,
    deviations: &[String],
    keeps_time: bool,
) -> Vec<String> {
    let CheckedMotion { duration_s, used, narrowest_gap: nearest } = checked;
    // A constant-speed sweep ends with its passes, so its duration is no round number.
    let duration_s = (1e3 * duration_s).round() / 1e3;
    let mut lines = vec![format!(
        "Motion for the robot {robot}, {duration_s} s, designed by didim. FIRST RUN IT AT 10 % \
        SPEED."
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
            "The controller plans the timing: it decides speeds, accelerations and torques, so \
                no standard deviations are predicted."
                .into(),
        );
    }
    if let Some(moving) = moving_joints_text(assignment) {
        lines.push(format!("{moving} at rest."));
    }
    if let Some(load) = &assignment.load {
        lines.push(format!(
            "Torques are those with {}.",
            load_sentence(load.expected_load, &load.frame)
        ));
    }
    if !assignment.task.bounds.limits_torques() {
        lines.push("Without parameters the torques of the motion are unknown.".into());
    }
    lines.push("Limits used (SI units):".into());
    lines.extend(used.iter().map(|used| limit_text(used, &assignment.joint_labels)));
    if keeps_time {
        lines.extend_from_slice(deviations);
    }
    lines
}

/// A motion that has been checked against the limits.
#[derive(Clone, Copy, Debug)]
pub struct CheckedMotion<'a> {
    /// Its length \[s\].
    pub duration_s: f64,
    /// Used share of each limit.
    pub used: &'a [UsedLimit],
    /// Narrowest gap along the motion, if shapes are configured.
    pub narrowest_gap: Option<Nearest>,
}

impl<'a> From<&'a Design> for CheckedMotion<'a> {
    fn from(design: &'a Design) -> Self {
        Self {
            duration_s: design.series.duration_s,
            used: &design.used,
            narrowest_gap: design.narrowest_gap,
        }
    }
}

impl<'a> From<&'a SweepDesign> for CheckedMotion<'a> {
    fn from(SweepDesign { sweep, used, narrowest_gap: nearest }: &'a SweepDesign) -> Self {
        Self { duration_s: sweep.duration_s(), used, narrowest_gap: *nearest }
    }
}

/// Formats the predicted standard deviation of each parameter for the header of a file. Returns no
/// lines if the noise is assumed.
pub fn prediction_lines(assignment: &Assignment, deviations: &[f64]) -> Vec<String> {
    if !assignment.measured_noise {
        return Vec::new();
    }
    let intro = "Standard deviations from this motion and the result before it; `didim identify \
        --designed` compares the new result with them:";
    let of_each = assignment.parameters.iter().zip(deviations);
    let of_each = of_each.map(|(own, of)| expectation_line(&own.name, *of, own.unit));
    core::iter::once(intro.to_owned()).chain(of_each).collect()
}

/// Formats the expected accuracy of `didim payload` for a load, from a simulated recording. The
/// lines are for the header of a file and for people.
pub fn load_lines(wanted: &WantedLoad, simulated: &Payload) -> Vec<String> {
    let mut lines = vec![format!(
        "Standard deviations that `didim payload` finds for {}, from a simulated recording of \
            this motion:",
        load_sentence(wanted.expected_load, &wanted.frame)
    )];
    let mut line = |what: String, found: UncertainValue, unit: &str| {
        lines.push(format!("  {what}: {} {unit}", significant_digits(found.standard_deviation, 3)));
    };
    let load = FrameView::new(simulated, DeclaredLoad::default(), &wanted.frame);
    if let Some(found) = simulated.load.mass_kg {
        line("mass".to_owned(), found, "kg");
    }
    for (axis, found) in AXIS_NAMES.iter().zip(*load.centre_m) {
        found.into_iter().for_each(|found| line(format!("centre {axis}"), found, "m"));
    }
    for (entry, found) in INERTIA_NAMES.iter().zip(*load.inertia_kg_m2) {
        found.into_iter().for_each(|found| line(format!("inertia {entry}"), found, "kg·m²"));
    }
    if !load.not_identifiable.is_empty() {
        for of in load.parameters {
            line(format!("sum {}", of.name), of.found, of.unit);
        }
        lines.push(format!(
            "The moving joints identify only sums of {}; one joint before them has to move too.",
            load.not_identifiable.join(" ")
        ));
    }
    if !load.without_effect.is_empty() {
        let none = load.without_effect.join(" ");
        lines.push(format!("No motion of this arm identifies {none} of a load."));
    }
    lines
}

/// Describes a given load, whose centre is in the frame of the last link, in another frame.
pub fn load_sentence(load: KnownLoad, frame: &NamedFrame) -> String {
    let [x, y, z] = frame.point_in_frame(load.centre_m).map(|of| significant_digits(of, 3));
    let mass = significant_digits(load.mass_kg, 3);
    format!("a load of {mass} kg with its centre at {x}, {y}, {z} m in the frame of {}", frame.name)
}

/// Lists the joints that move, if some do not.
fn moving_joints_text(assignment: &Assignment) -> Option<String> {
    let moving = &assignment.task.moving_joints;
    let joints = |moves: bool| -> Vec<String> {
        let labels = assignment.joint_labels.iter().zip(moving);
        labels.filter(|(_, of)| **of == moves).map(|(label, _)| label.clone()).collect()
    };
    let standing = joints(false);
    let words =
        || format!("Joints that move: {}; {}", joints(true).join(", "), standing.join(", "));
    (!standing.is_empty()).then(words)
}

/// Formats a table of the expected and the achieved standard deviations, and the rms of their
/// ratio.
pub fn expectation_text(parameters: &[ExpectedParameter]) -> String {
    let rows: Vec<_> = parameters
        .iter()
        .map(|of: &ExpectedParameter| {
            let [expected, achieved] =
                [of.expected, of.achieved].map(|value| significant_digits(value, 3));
            vec![
                of.name.clone(),
                expected,
                achieved,
                of.unit.clone(),
                format!("{:.2}", deviation_ratio(of)),
            ]
        })
        .collect();
    let table = align_table(&["parameter", "σ expected", "σ achieved", "unit", "times"], &rows);
    format!("\n{table}σ: statistical standard deviations\n\n{}\n", expectation_summary(parameters))
}

/// Returns the ratio of the achieved to the expected standard deviation.
pub(super) fn deviation_ratio(of: &ExpectedParameter) -> f64 {
    of.achieved / of.expected
}

/// Summarises the ratio of achieved to expected standard deviations in one sentence.
pub(super) fn expectation_summary(parameters: &[ExpectedParameter]) -> String {
    let square: f64 = parameters.iter().map(|of| deviation_ratio(of).powi(2)).sum();
    let rms = (square / parameters.len() as f64).sqrt();
    let off = |of: &ExpectedParameter| deviation_ratio(of).ln().abs();
    let farthest = parameters.iter().max_by(|a, b| off(a).total_cmp(&off(b)));
    let farthest = farthest.map_or_else(String::new, |of| {
        format!("; farthest {}, {:.2} times", of.name, deviation_ratio(of))
    });
    format!(
        "standard deviations: {rms:.2} times the expected ones, rms of {}{farthest}",
        parameters.len()
    )
}

/// States in one line which links are checked against what.
pub fn collision_statement(assignment: &Assignment) -> String {
    let links = &assignment.checked_links;
    let moving = links.names.len().saturating_sub(1);
    let Some(shapes) = assignment.task.bounds.separated_shapes() else {
        let remedy = match (links.unread.is_empty(), links.is_urdf) {
            (false, _) => unread_text(&links.unread),
            (true, true) => "the URDF has no shapes; state <collision>".to_owned(),
            (true, false) => "no shapes are known; state `capsules` in the robot file".to_owned(),
        };
        return format!("NO collision check: {remedy}");
    };
    let is_checked =
        |link: &usize| !shapes.links_without_shape.contains(link) && links.is_read(*link);
    let checked = (1..=moving).filter(is_checked).count();
    let floor = match (shapes.has_wall(WallKind::Floor), links.floor) {
        (true, Floor::Height(height_m)) => format!("the floor at z = {height_m} m"),
        (true, _) => "the floor (mounting plane)".to_owned(),
        (false, _) => "NO floor".to_owned(),
    };
    let inside = if shapes.has_wall(WallKind::Side) { " and the box" } else { "" };
    let unread = match links.unread.is_empty() {
        true => String::new(),
        false => format!("; NOT checked: {}", unread_text(&links.unread)),
    };
    format!("{checked} of {moving} links checked against each other and {floor}{inside}{unread}")
}

/// Lists the shapes that are not checked, with a remedy.
fn unread_text(unread: &[UnreadShape]) -> String {
    let mut parts = Vec::new();
    let missing = |of: &&UnreadShape| matches!(of.problem, ShapeProblem::MissingMesh(_));
    let missing: Vec<&UnreadShape> = unread.iter().filter(missing).collect();
    if let Some(UnreadShape { problem: ShapeProblem::MissingMesh(name), .. }) = missing.first() {
        let links = names_once(missing.iter().map(|of| of.link.as_str()));
        parts.push(format!(
            "meshes not found ({links}; {name}), give the folder of their packages by \
             --package-path"
        ));
    }
    let other = unread.iter().filter_map(|of| match &of.problem {
        ShapeProblem::MissingMesh(_) => None,
        ShapeProblem::UnreadableMesh(problem) => Some(format!("{} ({problem})", of.link)),
        ShapeProblem::Unreadable => {
            Some(format!("{} (a shape of no size or of an unknown kind)", of.link))
        }
    });
    parts.extend(other);
    parts.join("; ")
}

/// Joins names with commas, each once.
fn names_once<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut listed: Vec<&str> = Vec::new();
    for name in names {
        if !listed.contains(&name) {
            listed.push(name);
        }
    }
    listed.join(", ")
}

/// Describes the collision checks, the narrowest gap, and the parts that were not checked.
fn collision_words(assignment: &Assignment, nearest: Option<Nearest>) -> Vec<String> {
    let mut lines = vec![format!("Collision: {}.", collision_statement(assignment))];
    if assignment.task.bounds.separated_shapes().is_none() {
        lines.push(
            "Collision NOT checked: neither of the arm with itself nor with anything around it."
                .into(),
        );
        return lines;
    }
    let names = &assignment.checked_links.names;
    let near = nearest.map_or_else(String::new, |of| {
        let pair = pair_text(names, of.link, of.neighbour);
        format!(" Nearest: {pair}, {:.0} mm.", 1e3 * of.gap_m)
    });
    lines.push(format!(
        "Collision checked at {CHECK_HZ} points per second by convex shapes, at least {:.0} mm \
         apart.{near}",
        1e3 * MIN_GAP_M
    ));
    lines.push(
        "Collision NOT checked: links that a joint connects, the base with floor and box, tool, \
         load, cables, and anything else around the arm."
            .to_owned(),
    );
    lines.extend(left_out_text(assignment));
    lines
}

/// Lists the links without a shape and the excluded pairs.
fn left_out_text(assignment: &Assignment) -> Vec<String> {
    let Some(shapes) = assignment.task.bounds.separated_shapes() else { return Vec::new() };
    let names = &assignment.checked_links.names;
    let shapeless = shapes.links_without_shape.iter().map(|link| link_text(names, *link));
    let pairs = |pairs: &[(usize, Neighbour)]| {
        pairs.iter().map(|(of, other)| pair_text(names, *of, *other)).collect::<Vec<_>>()
    };
    let touching = match assignment.task.first_posture {
        Some(_) => "their shapes overlap in the first posture",
        None => "their shapes overlap in the middle of the joints' ranges",
    };
    let lists = [
        ("they have no shape", shapeless.collect()),
        ("their shapes are near in every posture", pairs(&shapes.always_near)),
        (touching, pairs(&shapes.touching_at_reference)),
    ];
    let lines = lists
        .into_iter()
        .filter(|(_, list)| !list.is_empty())
        .map(|(reason, list)| format!("Collision NOT checked, for {reason}: {}.", list.join("; ")));
    lines.collect()
}

fn link_text(names: &[String], number: usize) -> String {
    names.get(number).cloned().unwrap_or_else(|| format!("link {number}"))
}

fn pair_text(names: &[String], link: usize, neighbour: Neighbour) -> String {
    let other = match neighbour {
        Neighbour::Link(other) => link_text(names, other),
        Neighbour::Wall(WallKind::Side) => "the box".to_owned(),
        Neighbour::Wall(WallKind::Floor) => "the floor".to_owned(),
    };
    format!("{} and {other}", link_text(names, link))
}

/// Returns the last lines of the output.
pub(super) fn closing_warning(assignment: &Assignment) -> String {
    let left_out = left_out_text(assignment).into_iter().map(|line| line + "\n");
    left_out.collect::<String>()
        + &format!("{}; first run it at 10 % speed\n", collision_statement(assignment))
}

fn limit_text(used: &UsedLimit, labels: &[String]) -> String {
    let of_joint = labels.get(used.joint.position()).filter(|_| !used.of_motor);
    let label = of_joint.cloned().unwrap_or_else(|| used.joint.to_string());
    let side = if used.of_motor { "motor" } else { "joint" };
    let [lowest, highest] =
        [used.lower_limit, used.upper_limit].map(|value| significant_digits(value, 5));
    format!(
        "  {side} {label} {}: {lowest} to {highest}, {:.0} % used",
        used.kind,
        100.0 * used.used_share
    )
}

/// Formats a table of the expected standard deviations, and the conditions under which they hold.
pub fn design_text(assignment: &Assignment, design: &Design, prediction: &Predicted) -> String {
    parameters_text(assignment, prediction) + &conditions_text(assignment, &design.used)
}

/// Formats the end of the output: the noise that the standard deviations assume, the used limits,
/// and the parts that were not checked.
pub fn conditions_text(assignment: &Assignment, used: &[UsedLimit]) -> String {
    let rows_per_s = significant_digits(assignment.task.noise.rows_per_s, 3);
    let mut text = if assignment.measured_noise {
        format!("noise: the residuals of the result, {rows_per_s} rows per second\n")
    } else {
        format!(
            "noise: ASSUMED, 1 % of each joint's torque limit in {rows_per_s} independent rows \
                per second; use these σ to compare motions, not as the uncertainty of a result\n"
        )
    };
    let most = |kind: LimitKind| {
        let of_kind = used.iter().filter(|used| used.kind == kind);
        of_kind.map(|used| used.used_share).max_by(f64::total_cmp)
    };
    let shares = LimitKind::ALL.into_iter().map(|kind| match most(kind) {
        Some(share) => format!("{kind} {:.0} %", 100.0 * share),
        None => format!("{kind} not limited"),
    });
    let shares: Vec<String> = shares.collect();
    text += &format!("of the limits it uses: {}\n", shares.join(", "));
    if let Some(moving) = moving_joints_text(assignment) {
        text += &format!("{moving} at rest\n");
    }
    text + &closing_warning(assignment)
}

/// Formats the known and the predicted uncertainty of each parameter.
fn parameters_text(assignment: &Assignment, prediction: &Predicted) -> String {
    let number =
        |value: Option<f64>| value.map_or_else(|| "–".into(), |of| significant_digits(of, 3));
    let value = |own: &TaskParameter| match (own.value, own.standard_deviation) {
        (Some(value), Some(deviation)) => to_uncertainty(value, deviation, MAX_DIGITS),
        (value, _) => number(value),
    };
    let rows: Vec<_> = assignment
        .parameters
        .iter()
        .zip(&prediction.deviations)
        .map(|(own, deviation): (&TaskParameter, &f64)| {
            let share = own.value.map(|value| 100.0 * deviation / value.abs());
            vec![
                own.name.clone(),
                value(own),
                number(own.standard_deviation),
                significant_digits(*deviation, 3),
                own.unit.to_owned(),
                share.map_or_else(
                    || "–".into(),
                    |share| format!("{} %", significant_digits(share, 2)),
                ),
                own.description.clone().unwrap_or_default(),
            ]
        })
        .collect();
    let header = ["parameter", "value", "σ now", "σ then", "unit", "relative", "of"];
    let table = align_table(&header, &rows);
    let condition = significant_digits(prediction.condition_number, 3);
    format!(
        "{table}σ: statistical standard deviations\n\n\
        condition number of the base columns of inertia along this motion: {condition} \
        (unweighted, no friction)\n"
    )
}
