//! Effects of alternative models.

use didim_core::identification::ModelCheck;
use maud::{Markup, html};

use super::{Report, number, probability};

/// The largest shifts first.
pub(super) fn section(report: &Report<'_>) -> Markup {
    let limits = &report.cell.options.limits;
    let mut checks: Vec<&ModelCheck> = report.identification.estimate.model_checks.iter().collect();
    checks.sort_by(|a, b| b.shift_deviations.abs().total_cmp(&a.shift_deviations.abs()));
    if checks.is_empty() {
        return html! {};
    }
    let content = html! {
        div.scroll { table {
            thead { tr {
                th scope="col" { "Assumption that is relaxed" }
                th scope="col" { "Parameter that changes most" }
                th.number scope="col" { "Change [σ]" }
                th.number scope="col" { "Probability" }
                th scope="col" { "Matters" }
            } }
            tbody { @for check in checks { tr.matters[limits.fails(check)] {
                th scope="row" { (check.alternative) }
                td { (check.parameter) }
                td.number { (number(check.shift_deviations, 2)) }
                td.number { (check.probability.map_or("–".to_owned(), probability)) }
                td { (if limits.fails(check) { "yes" } else { "no" }) }
            } } }
        } }
    };
    let explanation = format!(
        "Each assumption of the model in turn is relaxed by parameters of its own. It matters \
         where the data support them, with a probability of a right model below {}, and a \
         parameter would change by more than {} standard deviations ({} for assumptions about the \
         positions).",
        number(limits.model_probability, 1),
        limits.model_shift_deviations,
        limits.position_filter_deviations
    );
    super::section("Model checks", &explanation, &content)
}
