//! Verdict of every method on its own result.

use maud::{Markup, html};

use crate::report::{Judgement, View};
use didim::report::html::page::{section as in_section, to_sentence};

pub(super) fn section(view: &View<'_>) -> Markup {
    let failed: Vec<String> =
        view.outcomes.iter().filter(|of| !of.is_met()).map(|of| of.limit.to_string()).collect();
    let content = html! {
        @if !view.outcomes.is_empty() {
            p.limits.violated[!failed.is_empty()] {
                @if failed.is_empty() {
                    "All " (view.outcomes.len()) " limits hold."
                } @else {
                    (failed.len()) " of " (view.outcomes.len()) " limits do not hold: "
                    (failed.join("; ")) "."
                }
            }
        }
        dl.judgements { @for of in view.judgements() { (judgement(&of)) } }
    };
    let explanation = "Whether each result may be used, with the first reason where it may not. \
                       Without the decimation filter a result is for comparison only.";
    in_section("Verdicts", explanation, &content)
}

fn judgement(of: &Judgement) -> Markup {
    html! {
        div.good[of.reason.is_none()] {
            dt { (of.trial) }
            dd.verdict-word { (of.verdict) }
            dd.reason {
                @match &of.reason {
                    None => { "No finding contradicts its use." },
                    Some(reason) => { (to_sentence(reason)) },
                }
                @if of.further_reasons > 0 {
                    " " (of.further_reasons)
                    @if of.further_reasons == 1 { " more reason." } @else { " more reasons." }
                }
            }
        }
    }
}
