//! Output of a study as a Markdown document and as a table for the terminal.

use std::fmt::Write as _;

use super::grid::Grid;
use super::measure::MEASURES;
use super::summary::{CellSummary, Summary};
use didim::text::{align_table, significant_digits};

/// Headings of the columns that follow the axes and the method.
const COLUMNS: [&str; 11] = [
    "runs",
    "converged",
    "applicable",
    "torque dev.",
    "95 %",
    "rms z",
    "within 3 σ",
    "wrong",
    "accepted",
    "refused",
    "most frequent failure",
];

/// Returns the table of all figures for the terminal.
pub fn table(summary: &Summary) -> String {
    let header = header(summary);
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    align_table(&header, &summary.cells.iter().map(row).collect::<Vec<_>>())
}

/// Returns the Markdown document with the runs, the heat maps and the table.
pub fn markdown(grid: &Grid, summary: &Summary) -> String {
    let plan = &grid.plan;
    let mut text = format!("# {}\n\n", plan.name);
    let _ = write!(
        text,
        "{} of {} runs: {} cells of the grid, {}.\n\n",
        summary.runs,
        summary.planned,
        plan.cell_count(),
        plan.method
            .iter()
            .map(|method| format!("{} with {} seeds", method.name(), method.seeds))
            .collect::<Vec<_>>()
            .join(", ")
    );
    for axis in &plan.axis {
        let levels: Vec<&str> = axis.level.iter().map(|level| level.name.as_str()).collect();
        let _ = writeln!(text, "- **{}**: {}", axis.name, levels.join("; "));
    }
    let _ = write!(
        text,
        "\n*Torque deviation* is ‖X(θ̂ − θ)‖ / ‖Xθ‖ along the planned motion, without noise: the \
         median and what 95 % of the results do not exceed. z is (estimate − truth)/σ of a \
         parameter, with the corrected σ. A result is *wrong* where the rms of its z is above {}; \
         *accepted* are the wrong ones that the verdict calls applicable, *refused* those that it \
         does not. *Converged* are \
         results that the method does not take for a local minimum; the other figures are those of \
         all results, shares those of all runs.\n\n",
        summary.largest_rms_deviation
    );
    for measure in &MEASURES {
        let _ = writeln!(text, "![{}]({})\n", measure.title, measure.file);
    }
    let line = |cells: &[String]| {
        let escaped: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
        format!("| {} |\n", escaped.join(" | "))
    };
    let header = header(summary);
    text += &line(&header);
    let names = summary.axes.len() + 1;
    text +=
        &format!("|{}{}\n", "---|".repeat(names), "--:|".repeat(header.len() - names - 1) + "---|");
    for cell in &summary.cells {
        text += &line(&row(cell));
    }
    text
}

fn header(summary: &Summary) -> Vec<String> {
    let names = summary.axes.iter().map(String::as_str).chain(["method"]).chain(COLUMNS);
    names.map(str::to_owned).collect()
}

fn row(cell: &CellSummary) -> Vec<String> {
    let none = || "–".to_owned();
    let share =
        |count| cell.percent_of_runs(count).map_or_else(none, |share| format!("{share:.1} %"));
    let figure =
        |text: &dyn Fn(&super::Figures) -> String| cell.figures.as_ref().map_or_else(none, text);
    let percent = |value: f64| format!("{} %", significant_digits(100.0 * value, 2));
    let failure = cell.failures.iter().max_by_key(|(_, count)| **count);
    let mut row = cell.levels.clone();
    row.extend([
        cell.method.clone(),
        cell.runs.to_string(),
        share(cell.converged),
        share(cell.applicable),
        figure(&|f| percent(f.torque_deviation_median)),
        figure(&|f| percent(f.torque_deviation_95)),
        figure(&|f| significant_digits(f.rms_deviation, 3)),
        figure(&|f| format!("{:.1} %", 100.0 * f.within_3)),
        share(cell.wrong),
        share(cell.wrongly_accepted),
        share(cell.rightly_refused),
        failure.map_or_else(none, |(cause, count)| format!("{cause} ({count})")),
    ]);
    row
}
