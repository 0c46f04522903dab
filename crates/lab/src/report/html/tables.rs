//! Tables, and a drawing of the singular values.

use maud::{Markup, html};

use super::chart::Decades;
use crate::report::{Table, View};
use didim::report::html::page::{number_text, section as in_section, with_real_minus};

pub(super) fn section(view: &View<'_>) -> Markup {
    html! {
        @for of in view.tables() { (in_section(&of.title, &of.note, &table(&of))) }
    }
}

fn table(of: &Table) -> Markup {
    // A table with two columns has words, a table with more columns has numbers.
    let numbers = of.header.len() > 2;
    html! {
        div.scroll { table.compared {
            thead { tr { @for name in &of.header { th.number[numbers] scope="col" { (name) } } } }
            tbody { @for row in &of.rows { tr {
                @if let Some((name, cells)) = row.split_first() {
                    th scope="row" { (name.text) }
                    @for cell in cells {
                        td.number[numbers].marked[cell.is_marked] { (signed_text(&cell.text)) }
                    }
                }
            } } }
        } }
    }
}

/// Replaces the hyphens of a number by minus signs. A name with a hyphen does not change.
fn signed_text(text: &str) -> String {
    let number = text.starts_with(|c: char| c == '-' || c.is_ascii_digit());
    if number { with_real_minus(text) } else { text.to_owned() }
}

pub(super) fn singular_values(view: &View<'_>) -> Markup {
    let results =
        || view.comparison.methods.iter().filter_map(|of| Some((of.trial, of.estimate.as_ref()?)));
    let Some(scale) =
        Decades::from_values(results().map(|(_, estimate)| estimate.unweighted_singular_values))
    else {
        return html! {};
    };
    let content = html! {
        div.scroll { table {
            thead { tr {
                th scope="col" { "Method" }
                th.number scope="col" { "μ min" }
                th.plot scope="col" { (scale.labels()) }
                th.number scope="col" { "μ max" }
                th.number scope="col" { "Condition number" }
            } }
            tbody { @for (trial, estimate) in results() { tr {
                @let values = estimate.unweighted_singular_values;
                th scope="row" { (trial) }
                td.number { (number_text(values.min, 4)) }
                td.plot { (scale.range(values, trial.method)) }
                td.number { (number_text(values.max, 4)) }
                td.number { (number_text(estimate.unweighted_condition_number, 4)) }
            } } }
        } }
    };
    let explanation = "Of the observation matrix, or of the sensitivities of the output, without \
        weights. Those of CLOE are positions for each unit of a parameter, the others torques.";
    in_section("Singular values", explanation, &content)
}
