//! Figures of every method: the paper's tables 2, 3 and 5, and the content of its figures 1 to 3 as
//! numbers.

use didim_identification::identification::{Estimate, SingularValues};

use super::table::{Cell, Table, number_text, percent_text};
use super::view::{Column, View, framework_name};
use crate::comparison::{Framework, PublishedFigures, mean};

/// Row of the table: its name, the function for its value in a result, and the function for its
/// published value.
type Row = (&'static str, fn(&Estimate) -> Option<String>, fn(&PublishedFigures) -> Option<String>);

const FIGURE_ROWS: &[Row] = &[
    (
        "μ max",
        |e| Some(number_text(e.unweighted_singular_values.max, 4)),
        |p| Some(number_text(SingularValues::from(p.singular_values?).max, 3)),
    ),
    (
        "μ min",
        |e| Some(number_text(e.unweighted_singular_values.min, 4)),
        |p| Some(number_text(SingularValues::from(p.singular_values?).min, 3)),
    ),
    (
        "condition number",
        |e| Some(number_text(e.unweighted_condition_number, 4)),
        |p| Some(number_text(p.condition_number?, 4)),
    ),
    ("linear steps", |e| Some(e.iterations.to_string()), |_| None),
    ("simulations", |e| Some(e.simulations.to_string()), |_| None),
    (
        "‖q − q_s‖/‖q‖",
        |e| Some(percent_text(mean(e.relative_position_error_per_joint.as_ref()?)?, 2)),
        |p| Some(format!("{} %", p.errors?.position_percent)),
    ),
    (
        "‖τ − τ_s‖/‖τ‖",
        |e| Some(percent_text(mean(e.simulated_torque_error_per_joint.as_ref()?)?, 3)),
        |p| Some(format!("{} %", p.errors?.torque_percent)),
    ),
    ("‖τ − Xθ‖/‖τ‖", |e| Some(percent_text(mean(&e.relative_error_per_joint)?, 3)), |_| None),
    ("Durbin–Watson", |e| Some(number_text(mean(&e.durbin_watson_per_joint)?, 3)), |_| None),
    ("expected", |e| Some(number_text(e.durbin_watson_expected, 3)), |_| None),
    ("white noise, P", |e| Some(probability(smallest_value(&e.whiteness_per_joint)?)), |_| None),
    ("rows per joint", |e| Some(rows(e).to_string()), |_| None),
    ("effective", |e| Some(number_text(mean(&e.effective_rows_per_joint)?, 3)), |_| None),
    ("classical σ / σ", |e| Some(number_text(mean(&classical_deviation_ratios(e))?, 2)), |_| None),
];

pub(super) fn table(view: &View<'_>, framework: Framework) -> Table {
    let columns = view.columns(framework);
    let mut header = vec![String::new()];
    header.extend(View::header(&columns));
    let mut rows: Vec<Vec<Cell>> = FIGURE_ROWS
        .iter()
        .map(|(name, own, published)| row(name, &columns, |c| own(c.estimate), *published))
        .collect();
    if view.shows_times {
        rows.push(row(
            "time",
            &columns,
            |column| Some(format!("{} s", number_text(1e-3 * column.result.elapsed_ms, 2))),
            |published| Some(format!("{} min", published.time_min?)),
        ));
    }
    Table {
        title: format!("Figures, {}", framework_name(framework)),
        note: "Singular values and condition number are those of the observation matrix or the \
               sensitivities without weights. Errors, Durbin–Watson statistic and effective rows \
               are means over the joints; P is the probability that filtered white noise is as \
               correlated as the residuals, of the joint where it is least."
            .to_owned(),
        header,
        rows,
    }
}

fn row(
    name: &str,
    columns: &[Column<'_>],
    own: impl Fn(&Column<'_>) -> Option<String>,
    published: fn(&PublishedFigures) -> Option<String>,
) -> Vec<Cell> {
    let cell = |text: Option<String>| text.map_or_else(Cell::missing, Cell::from);
    let cells = columns.iter().flat_map(|column| {
        let of_others = column.published.map(|of| cell(published(of)));
        [Some(cell(own(column))), of_others].into_iter().flatten()
    });
    core::iter::once(Cell::from(name)).chain(cells).collect()
}

fn rows(estimate: &Estimate) -> usize {
    estimate.rows / estimate.relative_error_per_joint.len().max(1)
}

fn classical_deviation_ratios(estimate: &Estimate) -> Vec<f64> {
    let parameters = estimate.parameters.iter();
    parameters.map(|p| p.classical_standard_deviation / p.standard_deviation).collect()
}

fn smallest_value(values: &[f64]) -> Option<f64> {
    values.iter().copied().min_by(f64::total_cmp)
}

fn probability(p: f64) -> String {
    if p < 1e-4 { "< 0.0001".to_owned() } else { number_text(p, 2) }
}
