//! Tables of the agreement of the methods.

use super::table::{Cell, Table};
use super::view::View;
use crate::comparison::{Agreement, Trial};

/// Returns the table with the number of estimates of each method that lie within 3 σ of the
/// estimates of each other method.
pub(super) fn matrix(view: &View<'_>) -> Option<Table> {
    let trials = trials(view);
    if trials.len() < 2 {
        return None;
    }
    let numbered = |k: usize, trial: &Trial| format!("{} {trial}", k + 1);
    let mut header = vec!["estimates".to_owned()];
    header.extend((1..=trials.len()).map(|k| format!("of {k}")));
    let mut rows: Vec<Vec<Cell>> = trials
        .iter()
        .enumerate()
        .map(|(k, one): (usize, &Trial)| {
            let cells = trials.iter().map(|other| {
                pair(view, *one, *other).map_or_else(Cell::missing, |pair| Cell {
                    text: format!("{}/{}", pair.inside, pair.compared),
                    is_marked: pair.inside < pair.compared,
                })
            });
            core::iter::once(numbered(k, one).into()).chain(cells).collect()
        })
        .collect();
    if view.comparison.truth.is_some() {
        let truth = trials.iter().map(|trial| against_truth(view, *trial));
        rows.insert(0, core::iter::once("truth".into()).chain(truth).collect());
    }
    Some(Table {
        title: "Agreement".to_owned(),
        note:
            "Number of estimates of the method in the row that lie within 3 σ of the method in the \
             column, with the σ of the latter."
                .to_owned(),
        header,
        rows,
    })
}

/// Returns the number of true values within 3 σ of a method's estimates.
fn against_truth(view: &View<'_>, trial: Trial) -> Cell {
    let missed = view.comparison.outside_of_truth(trial).zip(view.comparison.estimate(trial));
    missed.map_or_else(Cell::missing, |(outside, estimate)| {
        let count = estimate.parameters.len();
        Cell { text: format!("{}/{count}", count - outside.len()), is_marked: !outside.is_empty() }
    })
}

/// Returns the table with the names of the parameters whose true value lies outside 3 σ of the
/// estimate, if the truth is known.
pub(super) fn outside_of_truth(view: &View<'_>) -> Option<Table> {
    let rows: Vec<Vec<Cell>> = trials(view)
        .into_iter()
        .filter_map(|trial| {
            let names = view.comparison.outside_of_truth(trial)?;
            let names = if names.is_empty() { "none".into() } else { names.join(" ") };
            Some(vec![trial.to_string().into(), names.into()])
        })
        .collect();
    (!rows.is_empty()).then(|| Table {
        title: "Further than 3 σ from the truth".to_owned(),
        note: String::new(),
        header: ["estimates", "parameters"].map(str::to_owned).to_vec(),
        rows,
    })
}

/// Returns the table with the names of the parameters whose estimates lie outside the reference's
/// intervals.
pub(super) fn outside(view: &View<'_>) -> Option<Table> {
    let rows: Vec<Vec<Cell>> = view
        .comparison
        .agreement
        .iter()
        .filter(|pair| pair.intervals == Trial::REFERENCE)
        .map(|pair| {
            let names =
                if pair.outside.is_empty() { "none".into() } else { pair.outside.join(" ") };
            vec![pair.estimates.to_string().into(), names.into()]
        })
        .collect();
    (!rows.is_empty()).then(|| Table {
        title: "Outside of 3 σ of IDIM-LS".to_owned(),
        note: String::new(),
        header: ["estimates", "parameters"].map(str::to_owned).to_vec(),
        rows,
    })
}

/// Returns the methods with a result.
fn trials(view: &View<'_>) -> Vec<Trial> {
    let results = view.comparison.methods.iter().filter(|of| of.estimate.is_some());
    results.map(|of| of.trial).collect()
}

fn pair<'a>(view: &View<'a>, estimates: Trial, intervals: Trial) -> Option<&'a Agreement> {
    let of_both = |of: &&Agreement| of.estimates == estimates && of.intervals == intervals;
    view.comparison.agreement.iter().find(of_both)
}
