//! The estimates of every method with their uncertainty: the paper's tables 1 and 4.

use didim_identification::identification::ParameterEstimate;

use super::table::{Cell, Table, number_text, percent_text};
use super::view::{Column, View, framework_name};
use crate::comparison::{Framework, lies_in};
use didim::report::estimate::short_value;

/// Maximum number of digits of a value; it is small because the table has many columns.
const DIGITS: usize = 5;

pub(super) fn table(view: &View<'_>, framework: Framework) -> Table {
    let columns = view.columns(framework);
    let has_truth = view.comparison.truth.is_some();
    let mut header = vec!["parameter".to_owned(), "unit".to_owned()];
    header.extend(has_truth.then(|| "truth".to_owned()));
    header.extend(View::header(&columns));
    let rows = view
        .comparison
        .parameters()
        .iter()
        .map(|name: &&str| {
            let mut row = vec![Cell::from(*name), unit(&columns, name)];
            if has_truth {
                let truth = view.comparison.truth_of(name);
                row.push(truth.map_or_else(Cell::missing, |value| number_text(value, 4).into()));
            }
            row.extend(columns.iter().flat_map(|column| estimate_cells(view, column, name)));
            row
        })
        .collect();
    let published = if columns.iter().any(|column| column.published.is_some()) {
        " Published σ assume white residuals."
    } else {
        ""
    };
    let note = format!(
        "Value and relative σ, corrected for coloured residuals. Estimates outside of 3 σ of \
         IDIM-LS are marked.{published}"
    );
    let title = format!("Estimates, {}", framework_name(framework));
    Table { title, note, header, rows }
}

fn unit(columns: &[Column<'_>], name: &str) -> Cell {
    let mut parameters = columns.iter().flat_map(|column| &column.estimate.parameters);
    parameters
        .find(|found| found.name == name)
        .map_or_else(Cell::missing, |found| found.unit.into())
}

fn estimate_cells(view: &View<'_>, column: &Column<'_>, name: &str) -> impl Iterator<Item = Cell> {
    let of_name = |parameters: &&ParameterEstimate| parameters.name == name;
    let parameter = column.estimate.parameters.iter().find(of_name);
    let reference = view.comparison.reference().filter(|_| !column.is_reference());
    let reference = reference.and_then(|reference| reference.parameters.iter().find(of_name));
    let cell = parameter.map_or_else(Cell::missing, |p| Cell {
        text: estimate_text(p),
        is_marked: reference.is_some_and(|interval| !lies_in(p.value, interval)),
    });
    let published = column.published.map(|published| {
        let figures = published.estimates.get(name);
        figures.map_or_else(Cell::missing, |(value, percent)| {
            value_and_percent(*value, *percent).into()
        })
    });
    [Some(cell), published].into_iter().flatten()
}

fn estimate_text(p: &ParameterEstimate) -> String {
    if !p.value.is_finite() {
        return "–".to_owned();
    }
    format!("{} ({})", short_value(p, DIGITS), percent_text(p.relative_standard_deviation, 2))
}

/// Formats a value and a percentage as the paper does: the value with at least two decimals, the
/// percentage with three digits.
fn value_and_percent(value: f64, percent: f64) -> String {
    let two = format!("{value:.2}");
    let value = match two.parse::<f64>() {
        Ok(same) if (same - value).abs() < 1e-12 => two,
        _ => value.to_string(),
    };
    let decimals = if percent < 10.0 { 2 } else { usize::from(percent < 100.0) };
    format!("{value} ({percent:.decimals$} %)")
}
