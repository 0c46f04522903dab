//! The friction laws that the data chose.

use maud::{Markup, html};

use super::Report;
use crate::report::friction::{effect, gains};

/// What was changed, and what each change gained; nothing where the robot file's laws stand.
pub(super) fn section(report: &Report<'_>) -> Markup {
    let Some(chosen) = &report.identification.estimate.friction else { return html! {} };
    let content = html! {
        p { (effect(chosen)) "." }
        div.scroll { table {
            thead { tr {
                th scope="col" { "Joint" }
                th scope="col" { "Friction" }
                th.number scope="col" { "Held-out error" }
                th.number scope="col" { "With it" }
            } }
            tbody { @for [joint, change, before, after] in gains(chosen) { tr {
                th scope="row" { (joint) }
                td { (change) }
                td.number { (before) }
                td.number { (after) }
            } } }
        } }
    };
    let explanation = "Chosen by how well each law predicts pieces of the motion that it was not \
                       fitted to; none that makes the torque elsewhere less certain is taken, ties \
                       of 0.1 points aside.";
    super::section("Friction laws", explanation, &content)
}
