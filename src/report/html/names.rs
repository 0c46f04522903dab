//! Meanings of the parameter names that occur in a report.

use didim_dynamics::robot::ParameterKind;
use maud::{Markup, html};

use super::super::names::{NAME_PARTS, kind_meaning};
use super::Report;

pub(super) fn section(report: &Report<'_>) -> Markup {
    let estimate = &report.identification.estimate;
    let named = |name: &str| {
        estimate.parameters.iter().any(|p| p.name == name || p.name == format!("{name}r"))
    };
    let parameters = report.cell.robot.parameters();
    let parameters = parameters.names().iter().zip(parameters.parameters());
    let mut kinds: Vec<ParameterKind> =
        parameters.filter(|(name, _)| named(name)).map(|(_, own)| own.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let content = html! {
        div.scroll { table.names {
            thead { tr { th scope="col" { "Name" } th scope="col" { "Meaning" } } }
            tbody {
                @for kind in &kinds { tr {
                    th scope="row" { (kind.symbol()) }
                    td { (without_markup(kind_meaning(*kind))) }
                } }
                @for [part, meaning] in NAME_PARTS { tr {
                    th scope="row" { (without_markup(part)) }
                    td { (without_markup(meaning)) }
                } }
            }
        } }
    };
    let explanation = "A name is a symbol and the number of a link, joint or motor, and may end in \
        r. Links have frames of modified Denavit–Hartenberg parameters; the z axis of a link's \
        frame is the axis of its joint.";
    super::section("Names of parameters", explanation, &content)
}

/// Removes the markup that the manual uses.
fn without_markup(text: &str) -> String {
    text.replace('`', "")
}
