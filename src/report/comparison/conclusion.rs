//! What a comparison comes to, in one sentence.

use super::view::View;
use crate::offline::compare::{Agreement, Framework, MethodResult, Trial, title};

/// Errors that differ by less are equal: a share of the torque.
const TIE: f64 = 1e-3;

/// Which methods agree with IDIM-LS in every parameter, which predict best, and which have no result. Those
/// without the decimation filter are for comparison only.
pub(super) fn sentence(view: &View<'_>) -> Option<String> {
    let comparison = view.comparison;
    let (found, none): (Vec<_>, Vec<_>) =
        comparison.of(Framework::Decimated).partition(|of| of.estimate.is_some());
    let is_reference = |of: &&MethodResult| of.trial == Trial::REFERENCE;
    let agrees = |of: &&MethodResult| {
        let pair = [of.trial, Trial::REFERENCE];
        let of_pair = |other: &&Agreement| {
            pair == [other.estimates, other.intervals] || pair == [other.intervals, other.estimates]
        };
        comparison.agreement.iter().filter(of_pair).all(|pair| pair.outside.is_empty())
    };
    let mut parts = Vec::new();
    if found.iter().any(is_reference) {
        let others = found.iter().copied().filter(|of| !is_reference(of));
        let (agree, differ): (Vec<_>, Vec<_>) = others.partition(agrees);
        for (which, one, several) in [
            (
                agree,
                "agrees with IDIM-LS within 3 σ in every parameter",
                "agree with IDIM-LS within 3 σ in every parameter",
            ),
            (differ, "differs from IDIM-LS", "differ from IDIM-LS"),
        ] {
            parts.extend(said(&which, one, several));
        }
    }
    parts.extend(best(view));
    parts.extend(said(&none, "has no result", "have no result"));
    (!parts.is_empty()).then(|| format!("{}.", parts.join("; ")))
}

fn said(which: &[&MethodResult], one: &str, several: &str) -> Option<String> {
    let names = listed(&which.iter().map(|of| title(of.trial.method)).collect::<Vec<_>>());
    let said = if which.len() == 1 { one } else { several };
    (!which.is_empty()).then(|| format!("{names} {said}"))
}

/// Of those that were held out, the ones with the least error, where there is more than one.
fn best(view: &View<'_>) -> Option<String> {
    let held_out = view.comparison.held_out.iter();
    let errors: Vec<(String, f64)> = held_out
        .filter_map(|of| Some((title(of.method), of.held_out.as_ref()?.relative_error)))
        .filter(|(_, error)| error.is_finite())
        .collect();
    let least = errors.iter().map(|(_, error)| *error).min_by(f64::total_cmp)?;
    let best = errors.iter().filter(|(_, error)| *error <= least + TIE);
    let best: Vec<String> = best.map(|(name, _)| name.clone()).collect();
    let error = format!("{:.2} % on what was held out", 100.0 * least);
    (errors.len() > 1).then(|| match best.len() {
        1 => format!("{} predicts best, {error}", listed(&best)),
        _ => format!("{} predict alike, {error}", listed(&best)),
    })
}

/// `A, B and C`.
fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
