//! The first and the last part of the report. The first part describes the arm, the verdict and the
//! quality of the result. The last part describes how the result was found.

use didim_dynamics::robot::JointIndex;
use didim_identification::identification::{ConvergenceStep, Estimate, Method, Use};
use maud::{Markup, html};

use super::super::convergence::draw_panel;
use super::super::names::name_joints;
use super::super::uses::{self, Headline, has_refused_use, shown_notes};
use super::page::to_sentence;
use super::{Report, chart, number_text, percent_text, provenance, section};
use crate::text::few_listed;

pub(super) fn heading(report: &Report<'_>) -> Markup {
    let estimate = &report.identification.estimate;
    let method = estimate.method.parse::<Method>().ok().map(Method::long_name);
    html! {
        header {
            p.kind { "Identification of dynamic parameters" }
            h1 { (estimate.robot) }
            p {
                "Cell " strong { (report.cell.name) } ", method " strong { (estimate.method) }
                @if let Some(method) = method { " (" (method) ")" }
            }
            p { "Recorded: " (provenance::recording_date(report.origin)) }
        }
    }
}

pub(super) fn verdict_section(report: &Report<'_>) -> Markup {
    let estimate = &report.identification.estimate;
    let (verdict, robot) = (&estimate.verdict, &report.cell.robot);
    let headline = Headline::new(estimate, robot);
    let notes = shown_notes(estimate).map(|note| name_joints(&note.to_string(), robot));
    let notes: Vec<String> = notes.collect();
    let reasons = verdict.reasons.iter().map(|of| name_joints(&of.to_string(), robot));
    // Green only if no use is refused.
    let class = match (verdict.applicable, has_refused_use(estimate)) {
        (true, false) => "applicable",
        (true, true) => "partly",
        (false, _) => "refused",
    };
    html! {
        section.verdict.(class) {
            h2 { span.what { "Verdict" } (headline.usable) }
            @for sentence in &headline.refused { p.no { (sentence) "." } }
            @if !verdict.reasons.is_empty() {
                p { "Against the uses that the cell requires:" }
                ul { @for reason in reasons { li { (to_sentence(&reason)) } } }
            }
            div.scroll { table.uses {
                thead { tr {
                    th scope="col" { "Use" }
                    th scope="col" { "Usable" }
                    th scope="col" { "Because" }
                } }
                tbody { @for line in uses::lines(estimate, robot) { tr {
                    th scope="row" { (line.usage) }
                    td.refused[line.answer == "no"] { (line.answer) }
                    td { (line.because) }
                } } }
            } }
            (missing_section(report))
            @if !notes.is_empty() {
                p { "Notes on the result:" }
                ul { @for note in notes { li { (to_sentence(&note)) } } }
            }
            (next_step(estimate))
        }
    }
}

/// Names the next step: improve what is refused, or test and use the result.
fn next_step(estimate: &Estimate) -> Markup {
    match has_refused_use(estimate) {
        true => html! {
            p {
                "Next: " code { "didim advise" } " lists motions for what is missing, and "
                code { "didim design" } " designs one of all joints."
            }
        },
        false => html! {
            p {
                "Next: " code { "didim predict" } " tests the result with another recording, and "
                code { "didim export" } " writes it as a model for other tools."
            }
        },
    }
}

/// Share of a joint's highest speed below which the joint hardly moves \[1\].
const BARELY_MOVING_SHARE: f64 = 0.1;

/// If a use is refused, lists the parameters whose statistical uncertainty is too large, and the
/// joints that hardly moved.
fn missing_section(report: &Report<'_>) -> Markup {
    let estimate = &report.identification.estimate;
    let refused =
        Use::ALL.iter().any(|of| estimate.verdict.uses.get(*of).applicable == Some(false));
    let limit = report.cell.options.limits.parameter_uncertainty;
    let uncertain: Vec<&str> = (estimate.parameters.iter())
        .filter(|of| of.relative_standard_deviation > limit)
        .map(|of| of.name.as_str())
        .collect();
    if !refused || uncertain.is_empty() {
        return html! {};
    }
    let limits = report.cell.robot.limits();
    let still: Vec<String> = (0..)
        .zip(estimate.reached_per_joint.iter().zip(limits))
        .filter(|(_, (reached, limits))| {
            limits
                .velocity_max
                .is_some_and(|most| reached.highest_speed() < BARELY_MOVING_SHARE * most)
        })
        .map(|(joint, _): (usize, _)| report.cell.robot.joint_label(JointIndex::new(joint)))
        .collect();
    html! {
        p {
            "Noise alone leaves these uncertain by more than " (percent_text(limit, 2)) ": "
            (few_listed(uncertain)) "."
            @if !still.is_empty() {
                " Joints that stayed below a tenth of their highest speed: " (still.join(", ")) "."
            }
            " " code { "didim advise" } " with this result lists motions that identify them, \
                and the standard deviations to expect."
        }
    }
}

pub(super) fn key_figures(report: &Report<'_>) -> Markup {
    let estimate = &report.identification.estimate;
    let limits = &report.cell.options.limits;
    let steps = match estimate.iterations {
        1 => "1 least-squares step".to_owned(),
        steps => format!("{steps} least-squares steps"),
    };
    let figures = [
        (
            "Relative error",
            percent_text(estimate.relative_error, 3),
            format!(
                "‖y − Xθ‖ / ‖y‖ over all joints; at most {}",
                percent_text(limits.relative_error, 2)
            ),
        ),
        (
            "Condition number",
            number_text(estimate.condition_number, 4),
            format!("of the weighted {}; at most {}", report.matrix(), limits.condition_number),
        ),
        ("Parameters", estimate.parameters.len().to_string(), "base parameters identified".into()),
        (
            "Rows",
            estimate.rows.to_string(),
            "of the observation matrix, all joints together".into(),
        ),
        ("Samples", estimate.samples.to_string(), "of the measurement, margins included".into()),
        ("Simulations", estimate.simulations.to_string(), format!("of the closed loop; {steps}")),
    ];
    html! {
        section {
            h2 { "Key figures" }
            dl.figures {
                @for (name, value, meaning) in figures {
                    div { dt { (name) } dd.value { (value) } dd.meaning { (meaning) } }
                }
            }
        }
    }
}

/// Shows the convergence, for methods that iterate.
pub(super) fn convergence_section(steps: &[ConvergenceStep]) -> Markup {
    if steps.is_empty() {
        return html! {};
    }
    let content = html! {
        div.columns {
            figure {
                (chart::panel("Convergence over the simulations", |svg| draw_panel(svg, steps)))
            }
            div.scroll { table {
                thead { tr {
                    th scope="col" { "Simulation" }
                    th.number scope="col" { "Relative error" }
                    th.number scope="col" { "Largest step [σ]" }
                    th.number scope="col" { "Halvings" }
                } }
                tbody { @for step in steps { tr {
                    th scope="row" { (step.simulation) }
                    td.number { (percent_text(step.relative_error, 4)) }
                    td.number { (number_text(step.parameter_change, 3)) }
                    td.number { (step.halvings) }
                } } }
            } }
        }
    };
    let explanation = "Each step simulates the closed loop with the parameters of the step before. \
                       The largest step is that of any parameter, in its standard deviations; a \
                       step that could not be simulated was halved.";
    section("Convergence", explanation, &content)
}

pub(super) fn singular_values(report: &Report<'_>) -> Markup {
    let estimate = &report.identification.estimate;
    let (values, unweighted) = (&estimate.singular_values, &estimate.unweighted_singular_values);
    let content = html! {
        div.scroll { table {
            thead { tr {
                th scope="col" { "Of the " (report.matrix()) }
                th.number scope="col" { "Largest" }
                th.number scope="col" { "Smallest" }
                th.number scope="col" { "Condition number" }
            } }
            tbody {
                tr {
                    th scope="row" { "weighted" }
                    td.number { (number_text(values.max, 4)) }
                    td.number { (number_text(values.min, 4)) }
                    td.number { (number_text(estimate.condition_number, 4)) }
                }
                tr {
                    th scope="row" { "not weighted" }
                    td.number { (number_text(unweighted.max, 4)) }
                    td.number { (number_text(unweighted.min, 4)) }
                    td.number { (number_text(estimate.unweighted_condition_number, 4)) }
                }
            }
        } }
    };
    let explanation = "How well the motion distinguishes the parameters. The weights divide the \
                       rows of each joint by its noise level.";
    section("Singular values", explanation, &content)
}
