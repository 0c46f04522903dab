//! The comparison of a result with the baseline, for the report that a service stores.

use maud::html;

use super::page::{to_sentence, with_code};
use super::{percent_text, section};
use crate::archive::drift::{DriftStatus, ParameterDrift};

/// Largest number of parameters in the table. They are those with the largest shares of their
/// bands.
const MAX_ROWS: usize = 10;

/// Creates the section with the alarms, and the parameters that have changed most.
pub fn baseline_section(drift: &DriftStatus) -> String {
    let share = |of: &&ParameterDrift| of.band_share.unwrap_or(0.0);
    let mut parameters: Vec<&ParameterDrift> = drift.parameters.iter().collect();
    parameters.sort_by(|one, other| share(other).total_cmp(&share(one)));
    let more = parameters.len().saturating_sub(MAX_ROWS);
    parameters.truncate(MAX_ROWS);
    let is_described = parameters.iter().any(|of| of.description.is_some());
    let content = html! {
        @for alarm in &drift.alarms { p.alarm { strong { "Alarm: " } (alarm.sentence()) "." } }
        @if drift.compared && drift.alarms.is_empty() { p { "No alarm is raised." } }
        @if let Some(why) = &drift.why_not {
            p { "The result is not compared. " (to_sentence(why)) }
        }
        @if drift.reconfigured { p { "The configuration has changed since the baseline." } }
        @if !parameters.is_empty() {
            div.scroll { table {
                thead { tr {
                    th scope="col" { "Parameter" }
                    th.number scope="col" { "Change" }
                    th.number scope="col" { "In σ" }
                    th.number scope="col" { "Share of the band" }
                    @if is_described { th scope="col" { "Quantity" } }
                } }
                tbody { @for of in parameters { tr {
                    th scope="row" { (of.parameter) }
                    td.number { (of.relative_change.map_or("–".into(), |by| percent_text(by, 2))) }
                    td.number { (of.deviation_sigma.map_or("–".into(), |by| format!("{by:.1}"))) }
                    td.number.refused[share(&of) > 1.0] {
                        (of.band_share.map_or("–".into(), |share| percent_text(share, 2)))
                    }
                    @if is_described {
                        td { (with_code(of.description.as_deref().unwrap_or_default())) }
                    }
                } } }
            } }
        }
        @if more > 0 { p { "The other " (more) " parameters have smaller shares of their bands." } }
    };
    let explanation = format!(
        "Changes since result {} of {}. A parameter is outside its band above 100 %.",
        drift.baseline,
        drift.time.minute()
    );
    section("Comparison with the baseline", &explanation, &content).into_string()
}
