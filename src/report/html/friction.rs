//! The friction laws, and the laws that were chosen from the data.

use didim_dynamics::robot::{JointFriction, JointIndex};
use maud::{Markup, html};

use super::Report;
use crate::report::friction::{effect_sentence, gains_text, law_text, sign_text};

/// Lists the laws of each joint. If laws were chosen from the data, also lists the changes and the
/// gain of each.
pub(super) fn section(report: &Report<'_>) -> Markup {
    let laws = law_list(report);
    let Some(chosen) = &report.identification.estimate.friction else {
        let explanation = match report.cell.overrides_sign {
            true => "As robot file and cell file have them.",
            false => "As the robot file has them.",
        };
        return super::section("Friction laws", explanation, &laws);
    };
    let robot = &report.cell.robot;
    let content = html! {
        p { (effect_sentence(chosen)) "." }
        div.scroll { table {
            thead { tr {
                th scope="col" { "Joint" }
                th scope="col" { "Friction" }
                th.number scope="col" { "Held-out error" }
                th.number scope="col" { "With it" }
            } }
            tbody { @for [joint, change, before, after] in gains_text(chosen, robot) { tr {
                th scope="row" { (joint) }
                td { (change) }
                td.number { (before) }
                td.number { (after) }
            } } }
        } }
        (laws)
    };
    let explanation = "Each law was chosen by cross-validation: by the error on parts of the \
        motion that it was not fitted to. A law that makes the torque outside the motion less \
        certain by more than 0.1 points is rejected.";
    super::section("Friction laws", explanation, &content)
}

/// Lists the sign law of friction and the further friction terms of each joint.
fn law_list(report: &Report<'_>) -> Markup {
    let estimate = &report.identification.estimate;
    let has_sign = report.cell.robot.friction().coulomb;
    let terms_of = |own: &JointFriction| {
        let terms = own.laws.iter().map(|law| law_text(*law));
        let sign = has_sign.then(|| sign_text(own.sign));
        let all_terms: Vec<String> = sign.into_iter().chain(terms).collect();
        if all_terms.is_empty() { "–".to_owned() } else { all_terms.join(", ") }
    };
    html! { div.scroll { table {
        thead { tr { th scope="col" { "Joint" } th scope="col" { "Friction" } } }
        tbody { @for (joint, own) in estimate.friction_laws.iter().enumerate() { tr {
            th scope="row" { (report.cell.robot.joint_label(JointIndex::new(joint))) }
            td { (terms_of(own)) }
        } } }
    } } }
}
