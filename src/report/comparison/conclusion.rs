//! What a comparison comes to, in one sentence.

use super::view::View;
use crate::offline::compare::{Agreement, Framework, MethodResult, Trial, title};

/// Errors that differ by less are equal: a share of the torque.
const TIE: f64 = 1e-3;

/// Which methods agree in every parameter, which of them predict best, and which have no result. Those without
/// the decimation filter are for comparison only.
pub(super) fn sentence(view: &View<'_>) -> String {
    let comparison = view.comparison;
    let (found, none): (Vec<_>, Vec<_>) =
        comparison.of(Framework::Decimated).partition(|of| of.estimate.is_some());
    let agrees = |of: &&&MethodResult| {
        let pair = [of.trial, Trial::REFERENCE];
        let of_pair = |other: &&Agreement| {
            pair == [other.estimates, other.intervals] || pair == [other.intervals, other.estimates]
        };
        comparison.agreement.iter().filter(of_pair).all(|pair| pair.outside.is_empty())
    };
    let (agree, differ): (Vec<_>, Vec<_>) = found.iter().partition(agrees);
    let mut parts = Vec::new();
    if agree.len() > 1 {
        parts.push(format!("{} agree in every parameter within 3 σ", names(&agree)));
    }
    if !differ.is_empty() {
        let verb = if differ.len() == 1 { "differs" } else { "differ" };
        parts.push(format!("{} {verb} from IDIM-LS", names(&differ)));
    }
    parts.extend(best(view));
    if !none.is_empty() {
        let verb = if none.len() == 1 { "has" } else { "have" };
        parts.push(format!("{} {verb} no result", names(&none)));
    }
    format!("{}.", parts.join("; "))
}

/// Of those that were held out, the ones with the least error.
fn best(view: &View<'_>) -> Option<String> {
    let held_out = view.comparison.held_out.iter();
    let errors: Vec<(String, f64)> = held_out
        .filter_map(|of| Some((title(of.method), of.held_out.as_ref()?.relative_error)))
        .collect();
    let least = errors.iter().map(|(_, error)| *error).min_by(f64::total_cmp)?;
    let best: Vec<String> = errors
        .iter()
        .filter(|(_, error)| *error <= least + TIE)
        .map(|(name, _)| name.clone())
        .collect();
    let error = format!("{:.2} % on what was held out", 100.0 * least);
    Some(match best.len() {
        1 => format!("{} predicts best, {error}", listed(&best)),
        count if count == errors.len() => format!("they predict alike, {error}"),
        _ => format!("{} predict best, {error}", listed(&best)),
    })
}

fn names(of: &[&MethodResult]) -> String {
    listed(&of.iter().map(|of| title(of.trial.method)).collect::<Vec<_>>())
}

/// `A, B and C`.
fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
