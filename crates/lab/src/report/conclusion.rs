//! Summary of a comparison in one sentence.

use super::view::View;
use crate::comparison::{Agreement, Framework, MethodResult, Trial, title};

/// Maximum difference of two errors that count as equal, as a fraction of the torque.
const TIE_TOLERANCE: f64 = 1e-3;

/// Returns a sentence about the methods: those that agree with IDIM-LS in every parameter, those
/// that differ from it, those that predict best, and those without a result. Trials without the
/// decimation filter are not considered.
pub(super) fn conclusion_sentence(view: &View<'_>) -> Option<String> {
    let comparison = view.comparison;
    let (found, none): (Vec<_>, Vec<_>) =
        comparison.results(Framework::Decimated).partition(|of| of.estimate.is_some());
    let is_reference = |of: &&MethodResult| of.trial == Trial::REFERENCE;
    let mut parts = Vec::new();
    if found.iter().any(is_reference) {
        let others = found.iter().copied().filter(|of| !is_reference(of));
        let (agree, differ): (Vec<_>, Vec<_>) = others.partition(|of: &&MethodResult| {
            let pair = [of.trial, Trial::REFERENCE];
            let of_pair = |other: &&Agreement| {
                pair == [other.estimates, other.intervals]
                    || pair == [other.intervals, other.estimates]
            };
            comparison.agreement.iter().filter(of_pair).all(|pair| pair.outside.is_empty())
        });
        for (which, one, several) in [
            (
                agree,
                "agrees with IDIM-LS within 3 σ in every parameter",
                "agree with IDIM-LS within 3 σ in every parameter",
            ),
            (differ, "differs from IDIM-LS", "differ from IDIM-LS"),
        ] {
            parts.extend(methods_clause(&which, one, several));
        }
    }
    parts.extend(best_predictors(view));
    parts.extend(methods_clause(&none, "has no result", "have no result"));
    (!parts.is_empty()).then(|| format!("{}.", parts.join("; ")))
}

fn methods_clause(which: &[&MethodResult], one: &str, several: &str) -> Option<String> {
    let names = join_names(&which.iter().map(|of| title(of.trial.method)).collect::<Vec<_>>());
    let said = if which.len() == 1 { one } else { several };
    (!which.is_empty()).then(|| format!("{names} {said}"))
}

/// Returns a clause that names the methods with the smallest held-out error, if more than one
/// method has a held-out error.
fn best_predictors(view: &View<'_>) -> Option<String> {
    let held_out = view.comparison.held_out.iter();
    let errors: Vec<(String, f64)> = held_out
        .filter_map(|of| Some((title(of.method), of.held_out.as_ref()?.relative_error)))
        .filter(|(_, error)| error.is_finite())
        .collect();
    let least = errors.iter().map(|(_, error)| *error).min_by(f64::total_cmp)?;
    let best = errors.iter().filter(|(_, error)| *error <= least + TIE_TOLERANCE);
    let best: Vec<String> = best.map(|(name, _)| name.clone()).collect();
    let error = format!("{:.2} % on what was held out", 100.0 * least);
    (errors.len() > 1).then(|| match best.len() {
        1 => format!("{} predicts best, {error}", join_names(&best)),
        _ => format!("{} predict alike, {error}", join_names(&best)),
    })
}

/// Joins names: `A, B and C`.
fn join_names(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
