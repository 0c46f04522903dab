//! Standard deviations that a designed motion was foretold to bring, and those that came.

use maud::{Markup, html};

use super::super::design::{foretold_summary, times};
use super::{number, section as framed};
use crate::offline::Foretold;

pub(super) fn section(foretold: &[Foretold]) -> Markup {
    if foretold.is_empty() {
        return html! {};
    }
    // What matters first: on a telephone the end of the table is beyond the edge.
    let content = html! {
        p { "In all, " (foretold_summary(foretold)) "." }
        div.scroll { table {
            thead { tr {
                th scope="col" { "Parameter" }
                th.number scope="col" { "Times" }
                th.number scope="col" { "σ foretold" }
                th.number scope="col" { "σ achieved" }
                th scope="col" { "Unit" }
            } }
            tbody { @for of in foretold { tr {
                th scope="row" { (of.name) }
                td.number { (format!("{:.2}", times(of))) }
                td.number { (number(of.foretold, 3)) }
                td.number { (number(of.achieved, 3)) }
                td.unit { (of.unit) }
            } } }
        } }
    };
    let explanation = "The standard deviations that the head of the designed motion foretells, by the noise of the \
                       result before it, and those of this result.";
    framed("What the motion was foretold to tell", explanation, &content)
}
