//! All estimates with their intervals, compared with those of IDIM-LS.

use didim_identification::identification::{Method, ParameterEstimate};
use maud::{Markup, html};

use super::{ComparisonReport, chart, css_class};
use crate::comparison::{Framework, Trial, title};
use crate::report::View;
use didim::report::estimate::value_text;
use didim::report::html::page::{number_text, section as in_section, with_real_minus};

pub(super) fn section(report: &ComparisonReport<'_>) -> Markup {
    let view = &report.view;
    let Some(reference) = view.comparison.reference() else { return html! {} };
    let frameworks: Vec<Framework> = [Framework::Decimated, Framework::Strict]
        .into_iter()
        .filter(|framework| !of_framework(view, *framework).is_empty())
        .collect();
    if frameworks.is_empty() {
        return html! {};
    }
    let has_truth = view.comparison.truth.is_some();
    let content = html! {
        (legend(view, has_truth))
        div.scroll { table.intervals {
            thead { tr {
                th scope="col" { "Parameter" }
                th.number scope="col" { "IDIM-LS" }
                th scope="col" { "Unit" }
                th.number.aside scope="col" { "σ" }
                @if has_truth { th.number.aside scope="col" { "Truth" } }
                @for framework in &frameworks {
                    th.plot scope="col" {
                        @match framework {
                            Framework::Decimated => "Decimated [σ of IDIM-LS]",
                            Framework::Strict => "Strict [σ of IDIM-LS]",
                        }
                        (chart::interval_labels())
                    }
                }
            } }
            tbody { @for p in &reference.parameters { tr {
                th scope="row" { (p.name) }
                td.number {
                    @if p.value.is_finite() { (with_real_minus(&value_text(p))) } @else { "–" }
                }
                td { (p.unit) }
                td.number.aside { (number_text(p.standard_deviation, 2)) }
                @let truth = view.comparison.truth_of(&p.name);
                @if has_truth {
                    td.number.aside { (truth.map_or("–".into(), |truth| number_text(truth, 4))) }
                }
                @for framework in &frameworks {
                    td.plot { (chart::intervals(p, truth, &estimates(view, *framework, &p.name))) }
                }
            } } }
        } }
    };
    let explanation = "Each estimate with 3 standard deviations to either side, in standard \
                       deviations of IDIM-LS from its estimate; the band is 3 of those. An arrow \
                       stands for an estimate off the scale. The numbers are in the tables below.";
    in_section("Estimates", explanation, &content)
}

/// Returns the methods of a framework that have a result, without the reference.
fn of_framework(view: &View<'_>, framework: Framework) -> Vec<Method> {
    view.comparison
        .results(framework)
        .filter(|of| of.trial != Trial::REFERENCE && of.estimate.is_some())
        .map(|of| of.trial.method)
        .collect()
}

/// Returns the estimates of one parameter by these methods.
fn estimates<'a>(
    view: &View<'a>,
    framework: Framework,
    name: &str,
) -> Vec<(Method, &'a ParameterEstimate)> {
    let comparison = view.comparison;
    of_framework(view, framework)
        .into_iter()
        .filter_map(|method: Method| {
            let estimate = comparison.estimate(Trial { method, framework })?;
            Some((method, estimate.parameters.iter().find(|p| p.name == name)?))
        })
        .collect()
}

fn legend(view: &View<'_>, has_truth: bool) -> Markup {
    let mut methods = of_framework(view, Framework::Decimated);
    for method in of_framework(view, Framework::Strict) {
        if !methods.contains(&method) {
            methods.push(method);
        }
    }
    html! {
        p.legend aria-hidden="true" {
            @for method in methods {
                span { (chart::legend_mark(&css_class(method))) (title(method)) }
            }
            @if has_truth { span { (chart::truth_key()) "truth" } }
        }
    }
}
