//! Predicted standard deviations of a designed motion, and the achieved ones.

use maud::{Markup, html};

use super::super::design::{deviation_ratio, expectation_summary};
use super::{number_text, section as framed};
use crate::analysis::ExpectedParameter;

pub(super) fn section(expected: &[ExpectedParameter]) -> Markup {
    if expected.is_empty() {
        return html! {};
    }
    // The summary comes first, because on a phone the last columns of the table are outside the
    // screen.
    let content = html! {
        p { "In all, " (expectation_summary(expected)) "." }
        div.scroll { table {
            thead { tr {
                th scope="col" { "Parameter" }
                th.number scope="col" { "Times" }
                th.number scope="col" { "σ expected" }
                th.number scope="col" { "σ achieved" }
                th scope="col" { "Unit" }
            } }
            tbody { @for of in expected { tr {
                th scope="row" { (of.name) }
                td.number { (format!("{:.2}", deviation_ratio(of))) }
                td.number { (number_text(of.expected, 3)) }
                td.number { (number_text(of.achieved, 3)) }
                td.unit { (of.unit) }
            } } }
        } }
    };
    let explanation = "The head of the designed motion predicts standard deviations from the \
        noise of the previous result. The table compares them with those of this result.";
    framed("Expected and achieved standard deviations", explanation, &content)
}
