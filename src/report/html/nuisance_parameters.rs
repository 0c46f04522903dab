//! Estimates of the nuisance parameters, which the model takes as known.

use didim_identification::identification::{NuisanceEstimate, Quantity};
use maud::{Markup, html};

use super::{Report, number_text, percent_text};

/// Number of nuisance parameters to show.
const MAX_SHOWN: usize = 10;

/// Lists the nuisance parameters, those with the largest torques first.
pub(super) fn section(report: &Report<'_>) -> Markup {
    let nuisance_parameters = report.identification.estimate.nuisance_parameters.iter();
    let shown: Vec<&NuisanceEstimate> = nuisance_parameters.take(MAX_SHOWN).collect();
    if shown.is_empty() {
        return html! {};
    }
    let content = html! {
        div.scroll { table {
            thead { tr {
                th scope="col" { "Nuisance parameter" }
                th.number scope="col" { "Torque [N·m]" }
                th scope="col" { "At joint" }
                th.number scope="col" { "Relative to torque" }
                th.number scope="col" { "Deviation" }
                th.number scope="col" { "Tolerance" }
            } }
            tbody { @for found in shown { tr {
                th scope="row" { (found.nuisance) }
                td.number { (number_text(found.torque_nm, 3)) }
                td { (found.joint) }
                td.number { (percent_text(found.relative_torque, 2)) }
                td.number { (found.quantity.map_or("–".to_owned(), difference_text)) }
                td.number {
                    (found.quantity.map_or("–".to_owned(), |q| quantity_text(q.configured, q.unit)))
                }
            } } }
        } }
    };
    let explanation = "The configured values and the friction model may be wrong. These \
        nuisance parameters are estimated together with the parameters, each within its \
        tolerance. The parameters above do not change; their combined uncertainty includes the \
        effect. The ten largest are shown.";
    super::section("Nuisance parameters", explanation, &content)
}

fn difference_text(found: Quantity) -> String {
    let (value, sd) = (found.value, found.standard_deviation);
    format!("{} ± {}", quantity_text(value, ""), quantity_text(sd, found.unit))
}

/// Formats a value with its unit, such as `0.0012 deg`. A ratio has no unit.
fn quantity_text(value: f64, unit: &str) -> String {
    let number = number_text(value, 2);
    if unit.is_empty() || unit == "1" { number } else { format!("{number} {unit}") }
}
