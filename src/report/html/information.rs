//! Information on each parameter, by motions or time slices of the recording.

use didim_identification::identification::Information;
use maud::{Markup, html};

use super::{Report, number_text, section as framed};

/// Largest number of rows of a table that is not folded. Convention: a screen.
const MAX_OPEN_ROWS: usize = 24;

/// Creates a table of parameters and motions or time slices. The cells are shaded by the share of
/// the information, and also contain it as a number.
pub(super) fn section(report: &Report<'_>) -> Markup {
    let Information { moves_s, between_rests, shares } = &report.identification.fit.information;
    if moves_s.is_empty() {
        return html! {};
    }
    let parameters = &report.identification.estimate.parameters;
    let table = html! {
        div.scroll { table.information {
            thead { tr {
                th scope="col" {
                    (if *between_rests { "Move" } else { "Slice" }) span.from { "from [s]" }
                }
                @for (k, of) in (1..).zip(moves_s) {
                    @let k: usize = k;
                    th.number scope="col" { (k) span.from { (number_text(of.start, 2)) } }
                }
            } }
            tbody { @for (parameter, shares) in parameters.iter().zip(shares) { tr {
                th scope="row" title=[parameter.description.as_ref()] { (parameter.name) }
                @for share in shares { (share_cell(*share)) }
            } } }
        } }
    };
    let content = match parameters.len() > MAX_OPEN_ROWS {
        true => html! {
            details { summary { "Table of " (parameters.len()) " parameters" } (table) }
        },
        false => table,
    };
    let explanation = format!(
        "Share of the information on each parameter that comes from each {}, in per cent: the \
         squares of the part of its column of the weighted {} that is orthogonal to the other \
         columns. A parameter that depends on a single {} cannot be identified without it.",
        if *between_rests { "move between two rests" } else { "of ten equal slices of the motion" },
        report.matrix(),
        if *between_rests { "move" } else { "slice" },
    );
    framed("Information on each parameter by moves", &explanation, &content)
}

/// Formats a share as a percentage, in a cell with a shade of this strength.
fn share_cell(share: f64) -> Markup {
    if !share.is_finite() {
        return html! { td.number { "–" } };
    }
    let percent = 100.0 * share;
    html! { td.number style=(format!("--share: {percent:.0}%")) { (format!("{percent:.0}")) } }
}
