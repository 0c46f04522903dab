//! The verdict for each use, as text: a sentence, and a line for each use.

use didim_dynamics::robot::{JointIndex, Robot};
use didim_identification::feasibility::Judgement;
use didim_identification::identification::{
    Estimate, Finding, FindingCode, Note, Severity, Use, UseVerdict,
};

use super::short_finding::{first_clause, limit_text, short_text};
use crate::text::significant_digits;

/// Largest relative difference of a figure from the parameter or joint that it is taken from.
const SAME_FIGURE: f64 = 1e-9;

/// Findings that have no remedy. JSON has them.
const NOT_SHOWN: [FindingCode; 2] =
    [FindingCode::ColouredResiduals, FindingCode::PositionNoiseUnchecked];

/// One line of the table of uses.
pub(super) struct UseLine {
    pub(super) usage: Use,
    /// `yes`, `no`, `undecided`, or `–` if the use has figures and no verdict.
    pub(super) answer: &'static str,
    /// The deciding figure with its limit; for a refused use the cause.
    pub(super) because: String,
}

/// Verdict of a result as a sentence for each answer.
pub(super) struct Headline {
    /// `Usable for monitoring and prediction`; `Not usable` if there is no such use.
    pub(super) usable: String,
    /// `Not for physical values: fv_m6 ± 50 %`, one for each cause.
    pub(super) refused: Vec<String>,
}

impl Headline {
    /// Creates the headline of a result.
    pub(super) fn new(estimate: &Estimate, robot: &Robot) -> Self {
        let findings = estimate.verdict.findings();
        let answer = |usage: &Use| estimate.verdict.uses.get(*usage).applicable;
        let usable: Vec<&str> = (Use::ALL.iter())
            .filter(|usage| answer(usage) == Some(true))
            .map(|usage| use_name(*usage))
            .collect();
        // Uses with the same cause share a sentence.
        let mut causes: Vec<(&str, String, Vec<&str>)> = Vec::new();
        for usage in Use::ALL {
            let verdict = estimate.verdict.uses.get(usage);
            let start = match verdict.applicable {
                Some(false) => "Not for",
                None if !verdict.reasons.is_empty() => "Undecided for",
                _ => continue,
            };
            let cause = cause_of(usage, &findings).map(|main| short_text(main, robot));
            let cause = cause.map_or_else(String::new, |cause| format!(": {cause}"));
            match causes.iter_mut().find(|(other, text, _)| *other == start && *text == cause) {
                Some((_, _, uses)) => uses.push(use_name(usage)),
                None => causes.push((start, cause, vec![use_name(usage)])),
            }
        }
        let refused = causes.into_iter();
        let refused = refused.map(|(start, cause, uses)| format!("{start} {}{cause}", and(&uses)));
        Self {
            usable: match usable.is_empty() {
                true => "Not usable".to_owned(),
                false => format!("Usable for {}", and(&usable)),
            },
            refused: refused.collect(),
        }
    }

    /// Formats all sentences as one line.
    pub(super) fn text(&self) -> String {
        let refused = self.refused.iter().map(|sentence| format!(" {sentence}."));
        format!("{}.{}", self.usable, refused.collect::<String>())
    }
}

/// Lists every use of a result.
pub(super) fn lines<'a>(
    estimate: &'a Estimate,
    robot: &'a Robot,
) -> impl Iterator<Item = UseLine> + 'a {
    let findings = estimate.verdict.findings();
    Use::ALL.into_iter().map(move |usage| {
        let verdict = estimate.verdict.uses.get(usage);
        let (answer, is_refused) = match verdict.applicable {
            Some(true) => ("yes", false),
            Some(false) => ("no", true),
            None if verdict.reasons.is_empty() => ("–", false),
            None => ("undecided", true),
        };
        let because = match is_refused {
            true => refusal_text((usage, verdict), &findings, robot),
            false => figure_text(usage, verdict, estimate, robot),
        };
        UseLine { usage, answer, because }
    })
}

/// Returns the notes that a reader can act on.
pub(super) fn shown_notes(estimate: &Estimate) -> impl Iterator<Item = &Note> {
    estimate.verdict.notes.iter().filter(|note| !NOT_SHOWN.contains(&note.code()))
}

/// True if a use of the result is refused.
pub(super) fn has_refused_use(estimate: &Estimate) -> bool {
    Use::ALL.iter().any(|usage| estimate.verdict.uses.get(*usage).applicable == Some(false))
}

/// Returns the finding that decides against a use: the one that exceeds its limit most, if several
/// have the same code.
fn cause_of(usage: Use, findings: &[Finding]) -> Option<&Finding> {
    let mut blocking = blocking(usage, findings);
    let first = blocking.next()?;
    let excess =
        |of: &Finding| of.figure.zip(of.limit).map_or(0.0, |(figure, limit)| figure / limit);
    let others = blocking.filter(|other| other.code == first.code);
    Some(others.fold(
        first,
        |worst, other| {
            if excess(other) > excess(worst) { other } else { worst }
        },
    ))
}

fn blocking(usage: Use, findings: &[Finding]) -> impl Iterator<Item = &Finding> {
    let of_use = findings.iter().filter(move |found| found.uses.contains(&usage));
    of_use.filter(|found| found.severity == Severity::Blocking)
}

/// Describes why a use is refused: the cause with its limit, the number of further causes, and a
/// possible explanation.
fn refusal_text(
    (usage, verdict): (Use, &UseVerdict),
    findings: &[Finding],
    robot: &Robot,
) -> String {
    let Some(main) = cause_of(usage, findings) else {
        // A result of a version without findings has sentences.
        let sentence = verdict.reasons.first().map(|reason| first_clause(&reason.to_string()));
        return sentence.unwrap_or_else(|| "–".to_owned());
    };
    let mut text = short_text(main, robot);
    if let Some(limit) = limit_text(main) {
        text += &format!(" (limit {limit})");
    }
    let more = blocking(usage, findings).count() - 1;
    if more > 0 {
        text += &format!("; {more} more");
    }
    let explains =
        |found: &&Finding| found.severity == Severity::Explanatory && found.uses.contains(&usage);
    if let Some(explanation) = findings.iter().find(explains) {
        text += &format!("; perhaps: {}", short_text(explanation, robot));
    }
    text
}

/// Describes the deciding figure of a use that is not refused.
fn figure_text(usage: Use, verdict: &UseVerdict, estimate: &Estimate, robot: &Robot) -> String {
    let share = |value: f64| format!("{} %", significant_digits(100.0 * value, 3));
    let limit = verdict.limit.map(|limit| format!(" (limit {})", share(limit)));
    let limit = limit.unwrap_or_default();
    let Some(figure) = verdict.figure else { return "–".to_owned() };
    match usage {
        Use::Monitoring => format!("torque ± {} along the motion{limit}", share(figure)),
        Use::Prediction => format!("torque ± {} outside the recorded motion{limit}", share(figure)),
        Use::ContactDetection => format!(
            "99.9 % of held-out residuals below {} {}{}",
            significant_digits(figure, 3),
            verdict.unit,
            joint_of_quantile(verdict, figure, robot)
        ),
        Use::PhysicalValues => {
            let is_same = |value: f64| (value - figure).abs() <= SAME_FIGURE * figure.abs();
            let worst = estimate.parameters.iter().find(|parameter| {
                is_same(parameter.combined_standard_deviation / parameter.value.abs())
            });
            let name = worst.map_or("parameters", |parameter| parameter.name.as_str());
            format!("{name} ± {}{limit}", share(figure))
        }
        Use::RigidBody => rigid_body_text(estimate),
    }
}

/// Names the joint whose quantile is the figure.
fn joint_of_quantile(verdict: &UseVerdict, figure: f64, robot: &Robot) -> String {
    let quantiles = &verdict.quantiles_per_joint;
    let is_same = |value: f64| (value - figure).abs() <= SAME_FIGURE * figure.abs();
    let joint = quantiles.iter().position(|of| is_same(of.of_999));
    let joint = joint.filter(|joint| *joint < robot.joints()).map(JointIndex::new);
    joint.map_or_else(String::new, |joint| format!(" (joint {})", robot.joint_label(joint)))
}

/// Describes a usable rigid body. The distance from physically consistent parameters is the square
/// root of their cost.
fn rigid_body_text(estimate: &Estimate) -> String {
    let consistent = estimate.link_bodies.as_ref();
    match consistent.filter(|of| of.judgement != Judgement::Infeasible) {
        Some(consistent) => format!(
            "physically consistent parameters at {} σ (limit {} σ)",
            significant_digits(consistent.cost.max(0.0).sqrt(), 2),
            significant_digits(consistent.cost_limit.sqrt(), 2)
        ),
        None => "mass matrix positive definite".to_owned(),
    }
}

/// Returns the name of a use in a sentence.
fn use_name(usage: Use) -> &'static str {
    match usage {
        Use::Monitoring => "monitoring",
        Use::Prediction => "prediction",
        Use::ContactDetection => "contact detection",
        Use::PhysicalValues => "physical values",
        Use::RigidBody => "rigid-body models",
    }
}

/// `monitoring, prediction and physical values`
fn and(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
