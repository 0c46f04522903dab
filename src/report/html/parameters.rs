//! The parameters with their uncertainty, and the composition of regrouped ones.

use didim_dynamics::robot::JointIndex;
use didim_identification::identification::ParameterEstimate;
use maud::{Markup, html};

use super::super::estimate::{fixed_parameters, value_text};
use super::chart::Scale;
use super::{Report, number_text, percent_text, with_real_minus};
use crate::cell::Cell;

/// Relative standard deviation above which a parameter could be zero.
const ZERO_DEVIATIONS: f64 = 0.5;

pub(super) fn section(report: &Report<'_>) -> Markup {
    let parameters = &report.identification.estimate.parameters;
    let nominal = |name: &str| nominal_value(report.cell, name);
    let has_nominal = parameters.iter().any(|p| nominal(&p.name).is_some());
    let scale = Scale::covering_scale(
        parameters.iter().flat_map(|p| [p.relative_standard_deviation, relative_classical(p)]),
    );
    let columns = if has_nominal { 10 } else { 8 };
    let table = html! {
        table.parameters {
            thead { tr {
                th scope="col" { "Parameter" }
                th.number scope="col" { "Value" }
                th scope="col" { "Unit" }
                th.number scope="col" { "σ (statistical)" }
                th.number.relative scope="col" { "Relative σ (statistical)" }
                th.bar scope="col" { (scale.labels()) }
                th.number scope="col" { "Classical" }
                th.number scope="col" { "Relative σ (combined)" }
                @if has_nominal {
                    th.number scope="col" { "Nominal" }
                    th.number scope="col" { "From nominal" }
                }
            } }
            @for joint in (0..report.cell.robot.joints()).map(JointIndex::new) {
                @let rows = parameters_of_joint(report.cell, parameters, joint);
                @let label = report.cell.robot.joint_label(joint);
                @if !rows.is_empty() { tbody {
                    tr.joint { th scope="rowgroup" colspan=(columns) { "Joint " (label) } }
                    @for (parameter, unit) in rows {
                        (row(parameter, unit, scale, has_nominal.then(|| nominal(&parameter.name))))
                    }
                } }
            }
        }
    };
    let estimate = &report.identification.estimate;
    let content = html! {
        (table)
        @if !estimate.nominal.is_empty() {
            p { "Kept at their nominal values: " (fixed_parameters(estimate)) "." }
        }
        (regrouping_section(report))
        p { a href="#names-of-parameters" { "What the names mean" } }
    };
    let explanation = format!(
        "σ is the standard deviation, corrected for coloured residuals; “classical” is the \
            relative one that assumes white residuals, the mark in the bar. The bars are on a \
            logarithmic scale. “Combined” is the relative uncertainty that includes model error \
            and the tolerances of configured values. A name that ends in r stands for several \
            parameters that no motion distinguishes.{}",
        if has_nominal { " Nominal values are those of the robot file." } else { "" }
    );
    super::section("Parameters", &explanation, &content)
}

fn relative_classical(p: &ParameterEstimate) -> f64 {
    p.classical_standard_deviation / p.value.abs()
}

fn row(p: &ParameterEstimate, unit: &str, scale: Scale, nominal: Option<Option<f64>>) -> Markup {
    let deviation = p.relative_standard_deviation;
    let uncertain = deviation.is_nan() || deviation > ZERO_DEVIATIONS;
    let classical = relative_classical(p);
    html! {
        tr.uncertain[uncertain] {
            th scope="row" { (p.name) }
            td.number.value {
                @if p.value.is_finite() { (with_real_minus(&value_text(p))) } @else { "–" }
            }
            td.unit { (unit) }
            td.number.deviation { (number_text(p.standard_deviation, 2)) }
            td.number.relative { (percent_text(p.relative_standard_deviation, 2)) }
            td.bar { (scale.bar(p.relative_standard_deviation, classical)) }
            td.number.classical { (percent_text(classical, 2)) }
            td.number.combined { (percent_text(p.combined_standard_deviation / p.value.abs(), 2)) }
            @if let Some(nominal) = nominal {
                td.number.nominal { (nominal.map_or("–".into(), |value| number_text(value, 4))) }
                td.number.off {
                    (nominal.map_or("–".into(), |value| difference_text(p.value, value)))
                }
            }
        }
    }
}

/// Formats the signed difference of a value from the nominal one, relative to the nominal one.
fn difference_text(value: f64, nominal: f64) -> String {
    let share = (value - nominal) / nominal.abs();
    let sign = if share > 0.0 { "+" } else { "" };
    if share.is_finite() { format!("{sign}{}", percent_text(share, 2)) } else { "–".to_owned() }
}

/// Returns the parameters of a joint, its link and its motor, each with its unit.
fn parameters_of_joint<'a>(
    cell: &Cell,
    parameters: &'a [ParameterEstimate],
    joint: JointIndex,
) -> Vec<(&'a ParameterEstimate, &'static str)> {
    let table = cell.robot.parameters();
    let described = |p: &ParameterEstimate| table.parameters().get(table.find(&p.name)?).copied();
    let kind = cell.robot.chain().get(joint.position()).map(|described| described.kind);
    let described_parameters = parameters.iter().filter_map(|p| {
        let described = described(p).filter(|described| described.joint == joint)?;
        Some((p, described.kind.unit(kind?)))
    });
    described_parameters.collect()
}

/// Returns the nominal value of a base parameter from the robot file. `None` if the file contains
/// none of its components.
fn nominal_value(cell: &Cell, name: &str) -> Option<f64> {
    let nominal = cell.robot.nominal()?;
    nominal.value(name).or_else(|| {
        let value = *cell.base.to_base(nominal.standard_parameters()).get(cell.base.find(name)?)?;
        (value != 0.0).then_some(value)
    })
}

fn regrouping_section(report: &Report<'_>) -> Markup {
    let regrouped: Vec<(&str, String)> = (report.identification.estimate.parameters.iter())
        .filter(|p| p.regrouped)
        .filter_map(|p| Some((p.name.as_str(), report.cell.base.expression(&p.name)?)))
        .collect();
    if regrouped.is_empty() {
        return html! {};
    }
    html! {
        details {
            summary { "How regrouped parameters are made up" }
            dl.expressions { @for (name, expression) in regrouped {
                div { dt { (name) } dd { "= " (expression.replace('-', "−")) } }
            } }
        }
    }
}
