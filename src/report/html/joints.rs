//! The torques and residuals of each joint.

use didim_dynamics::robot::{JointIndex, Robot};
use didim_identification::identification::{Estimate, TorqueDelay};
use didim_identification::regression::{RobustLoss, autocorrelation};
use maud::{Markup, html};

use super::super::{TorquePanel, figure, joint_panels};
use super::{Report, chart, number_text, percent_text, probability, section, with_real_minus};
use crate::text::to_uncertainty;

/// Plots measured and predicted torque over time, with the errors of each joint.
pub(super) fn torque_section(report: &Report<'_>) -> Markup {
    let estimate = &report.identification.estimate;
    let has_curves = !report.identification.fit.time_s.is_empty();
    let content = html! {
        @if has_curves {
            (torque_panels(&joint_panels(report.identification, &report.cell.robot)))
        }
        div.scroll { table {
            thead { tr {
                th scope="col" { "Joint" }
                th.number scope="col" { "Relative error" }
                th.number scope="col" { "RMS error" }
                th.number scope="col" { "Uncertainty of prediction" }
            } }
            tbody { @for (k, joint) in report.cell.robot.chain().iter().enumerate() { tr {
                th scope="row" { (report.cell.robot.joint_label(JointIndex::new(k))) }
                td.number {
                    (text_at(&estimate.relative_error_per_joint, k, |v| percent_text(v, 3)))
                }
                td.number {
                    (text_at(&estimate.rms_error_per_joint_nm, k, |v| number_text(v, 3)))
                    " " (joint.kind.torque_unit())
                }
                td.number {
                    (text_at(&estimate.relative_prediction_deviation_per_joint, k, |v| {
                        percent_text(v, 2)
                    }))
                }
            } } }
        } }
    };
    let curves = if has_curves {
        "Both sides of the fitted equation, over the samples that count. Below, on a separate \
         axis, the residual with a band of two standard deviations. A pattern outside the band is \
         model error."
    } else {
        "A stored result has no curves. They can be drawn while its recording is kept."
    };
    let explanation = format!(
        "{curves} The uncertainty of the prediction is the standard deviation of the torque from \
         that of the parameters, relative to the torque."
    );
    section("Torque, measured and predicted", &explanation, &content)
}

/// Plots measured and predicted torque of each joint over time, under a legend.
pub(super) fn torque_panels(panels: &[TorquePanel<'_>]) -> Markup {
    html! {
        p.legend aria-hidden="true" {
            span { (legend_mark("measured")) "measured" }
            span { (legend_mark("predicted")) "predicted" }
            span { (legend_mark("residual")) "measured − predicted, on the lower axis, with ± 2 σ" }
            @if panels.iter().any(|panel| !panel.downweighted.is_empty()) {
                span {
                    svg viewBox="0 0 20 6" width="20" height="6" {
                        line.downweighted x1="10" x2="10" y1="0" y2="6" {}
                    }
                    "downweighted"
                }
            }
        }
        div.panels {
            @for panel in panels {
                figure {
                    (chart::panel_of_height(
                        figure::TORQUE_PANEL_HEIGHT,
                        &format!(
                            "Torque of joint {}, measured and predicted, and their difference",
                            panel.joint
                        ),
                        |svg| figure::draw_panel(svg, panel),
                    ))
                }
            }
        }
    }
}

fn legend_mark(class: &str) -> Markup {
    html! { svg viewBox="0 0 20 6" width="20" height="6" {
        line.key.(class) x1="0" x2="20" y1="3" y2="3" {}
    } }
}

/// Shows how similar the residuals are to white noise.
pub(super) fn residuals(report: &Report<'_>) -> Markup {
    let (estimate, fit) = (&report.identification.estimate, &report.identification.fit);
    if fit.time_s.is_empty() {
        return html! {};
    }
    let autocorrelations: Vec<Vec<f64>> = (fit.equation_residuals.iter())
        .map(|residual| autocorrelation(residual, fit.white_noise.len()))
        .collect();
    let range = chart::autocorrelation_range(&autocorrelations, &fit.white_noise);
    let loss = report.cell.options.robust.filter(|_| !fit.downweighted.is_empty());
    let content = html! {
        div.panels {
            @for (k, found) in autocorrelations.iter().enumerate() {
                @let name = format!("joint {}", report.cell.robot.joint_label(JointIndex::new(k)));
                figure {
                    (chart::panel(
                        &format!("Autocorrelation of the residual of {name}"),
                        |svg| {
                            chart::draw_autocorrelation(svg, &name, found, &fit.white_noise, range);
                        },
                    ))
                }
            }
        }
        div.scroll { table {
            thead { tr {
                th scope="col" { "Joint" }
                th.number scope="col" { "Durbin–Watson" }
                th.number scope="col" { "Probability of white noise" }
                th.number scope="col" { "Effective rows" }
                @if loss.is_some() { th.number scope="col" { "Downweighted" } }
            } }
            tbody { @for k in 0..autocorrelations.len() { tr {
                th scope="row" { (report.cell.robot.joint_label(JointIndex::new(k))) }
                td.number { (text_at(&estimate.durbin_watson_per_joint, k, |v| number_text(v, 3))) }
                td.number { (text_at(&estimate.whiteness_per_joint, k, probability)) }
                td.number {
                    (text_at(&estimate.effective_rows_per_joint, k, |v| number_text(v, 3)))
                    " of " (fit.time_s.len())
                }
                @if loss.is_some() {
                    td.number {
                        (fit.downweighted.get(k).map_or(0, Vec::len)) " of " (fit.time_s.len())
                    }
                }
            } } }
        } }
    };
    let mut explanation = format!(
        "Autocorrelation over the lag in rows. The band holds 95 % of the values that white noise \
         behind the decimation filter has; its Durbin–Watson statistic is {}. Coloured residuals \
         are usual and do no harm: they are equivalent to fewer rows, and σ is corrected for it.",
        number_text(estimate.durbin_watson_expected, 3)
    );
    if let Some(loss) = loss {
        explanation += &format!(
            " The weights are robust ({}): rows whose residual is reduced to less than a half are \
             downweighted, and the figures here are without these rows.",
            weight_function_name(loss)
        );
    }
    section("Residuals", &explanation, &content)
}

/// Returns the readable name of the weight function.
fn weight_function_name(loss: RobustLoss) -> String {
    match loss {
        RobustLoss::Huber { tuning } => format!("Huber's, tuning constant {tuning}"),
        RobustLoss::Bisquare { tuning } => format!("Tukey's bisquare, tuning constant {tuning}"),
    }
}

/// Shows the delays of the torques relative to their configured times.
pub(super) fn delay_section(estimate: &Estimate, robot: &Robot) -> Markup {
    let reach = chart::delay_reach(estimate.torque_delay_per_joint.iter().flatten());
    let content = html! {
        div.scroll { table {
            thead { tr {
                th scope="col" { "Joint" }
                th.number scope="col" { "Delay" }
                th.number scope="col" { "σ (statistical)" }
                th.bar scope="col" { (chart::delay_labels(reach)) }
            } }
            tbody { @for (k, delay) in estimate.torque_delay_per_joint.iter().enumerate() { tr {
                th scope="row" { (robot.joint_label(JointIndex::new(k))) }
                @if let Some(delay) = delay {
                    td.number { (delay_text(delay)) " µs" }
                    td.number { (number_text(1e6 * delay.standard_deviation_s, 2)) " µs" }
                    td.bar { (chart::delay(*delay, reach)) }
                } @else {
                    td.number { "–" }
                    td.number { "–" }
                    td { "not known from this motion" }
                }
            } } }
        } }
    };
    let explanation = "Delay of each torque beyond that of the cell file, with two standard \
                       deviations to either side; negative means earlier.";
    section("Torque delays", explanation, &content)
}

/// Formats a delay \[µs\] with the digits that its uncertainty allows.
fn delay_text(delay: &TorqueDelay) -> String {
    let [value, deviation] = [delay.delay_s, delay.standard_deviation_s].map(|of_s| 1e6 * of_s);
    with_real_minus(&to_uncertainty(value, deviation, 4))
}

fn text_at(values: &[f64], k: usize, text: impl Fn(f64) -> String) -> String {
    values.get(k).map_or("–".to_owned(), |value| text(*value))
}
