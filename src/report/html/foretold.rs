//! Standard deviations that a designed motion was foretold to bring, and those that came.

use maud::{Markup, html};

use super::super::design::{foretold_summary, times};
use super::{number, section as framed};
use crate::offline::Foretold;

pub(super) fn section(foretold: &[Foretold]) -> Markup {
    if foretold.is_empty() {
        return html! {};
    }
    let content = html! {
        table {
            thead { tr {
                th scope="col" { "Parameter" }
                th.number scope="col" { "Foretold" }
                th.number scope="col" { "Achieved" }
                th scope="col" { "Unit" }
                th.number scope="col" { "Times" }
            } }
            tbody { @for of in foretold { tr {
                th scope="row" { (of.name) }
                td.number { (number(of.foretold, 3)) }
                td.number { (number(of.achieved, 3)) }
                td.unit { (of.unit) }
                td.number { (number(times(of), 3)) }
            } } }
        }
        p { (foretold_summary(foretold)) "." }
    };
    let explanation = "The standard deviations that the head of the designed motion foretells, by the noise of the \
                       result before it, and those of this result.";
    framed("What the motion was foretold to tell", explanation, &content)
}
