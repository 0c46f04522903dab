//! The convergence of an iteration, as a table with bars in the terminal or as a panel of a figure.

use std::fmt::Write as _;

use didim_identification::identification::ConvergenceStep;

use super::panel::{PANEL_HEIGHT, PANEL_WIDTH, PLOT_BOTTOM, PLOT_LEFT, PLOT_RIGHT, PLOT_TOP};
use crate::text::{align_table, significant_digits};

/// Length of the longest bar, in characters.
const LONGEST_BAR: f64 = 24.0;

/// Formats one line per step. The bars show the change of the parameters on a logarithmic scale.
pub fn table(steps: &[ConvergenceStep]) -> String {
    let changes = steps.iter().map(|step| step.parameter_change);
    let Some((low, high)) = covering_decades(changes) else { return String::new() };
    let rows: Vec<Vec<String>> = steps
        .iter()
        .map(|step| {
            vec![
                format!("simulation {}", step.simulation),
                format!("{} %", significant_digits(100.0 * step.relative_error, 4)),
                significant_digits(step.parameter_change, 3),
                step.halvings.to_string(),
            ]
        })
        .collect();
    let header = ["convergence", "relative error", "largest step [σ]", "halvings"];
    let text = align_table(&header, &rows);
    let mut lines = text.lines();
    let mut with_bars = format!("{}\n", lines.next().unwrap_or_default());
    for (line, step) in lines.zip(steps) {
        let share = (step.parameter_change.log10() - low) / (high - low);
        let eighths = (8.0 * LONGEST_BAR * share.clamp(0.0, 1.0)).round();
        let bar = if eighths.is_finite() { bar(eighths) } else { String::new() };
        let _ = writeln!(with_bars, "{}", format!("{line}  {bar}").trim_end());
    }
    with_bars
}

/// Draws a bar with a length in eighths of a character (Unicode block elements).
fn bar(eighths: f64) -> String {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a line")]
    let eighths = eighths.max(1.0) as usize;
    let part = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"][eighths % 8];
    "█".repeat(eighths / 8) + part
}

/// Returns the powers of ten around all positive values; `None` without values.
fn covering_decades(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
    let (low, high) =
        logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let (low, high) = (low.floor(), high.ceil());
    low.is_finite().then_some((low, if high > low { high } else { low + 1.0 }))
}

/// Draws relative error and largest step over the simulations, both on one logarithmic scale.
pub fn draw_panel(svg: &mut String, steps: &[ConvergenceStep]) {
    let errors: Vec<f64> = steps.iter().map(|step| step.relative_error).collect();
    let changes: Vec<f64> = steps.iter().map(|step| step.parameter_change).collect();
    let Some((low, high)) = covering_decades(errors.iter().chain(&changes).copied()) else {
        return;
    };
    let (wide, tall) =
        (PANEL_WIDTH - PLOT_LEFT - PLOT_RIGHT, PANEL_HEIGHT - PLOT_TOP - PLOT_BOTTOM);
    let last = steps.last().map_or(1, |step| step.simulation).max(2);
    let x = |simulation: u32| PLOT_LEFT + f64::from(simulation - 1) / f64::from(last - 1) * wide;
    let y = |value: f64| PLOT_TOP + (high - value.log10()) / (high - low) * tall;
    let _ = write!(
        svg,
        "<text class=\"title\" x=\"{PLOT_LEFT}\" y=\"20\">convergence: relative error ●, largest \
         step [σ] ○</text>"
    );
    let mut decade = low;
    while decade <= high {
        let line_y = y(10_f64.powf(decade));
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{PLOT_LEFT}\" x2=\"{}\" y1=\"{line_y:.1}\" \
             y2=\"{line_y:.1}\"/><text class=\"tick\" x=\"{}\" y=\"{:.1}\" \
             text-anchor=\"end\">1e{decade}</text>",
            PLOT_LEFT + wide,
            PLOT_LEFT - 5.0,
            line_y + 3.5
        );
        decade += ((high - low) / 4.0).ceil().max(1.0);
    }
    let every = last.div_ceil(12);
    for step in steps.iter().filter(|step| (step.simulation - 1) % every == 0) {
        let _ = write!(
            svg,
            r#"<text class="tick" x="{:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
            x(step.simulation),
            PLOT_TOP + tall + 16.0,
            step.simulation
        );
    }
    for (class, mark, values) in [("residual", "○", &changes), ("predicted", "●", &errors)] {
        let points = steps.iter().zip(values).filter(|(_, v)| **v > 0.0 && v.is_finite());
        let points: Vec<(f64, f64)> = points.map(|(s, v)| (x(s.simulation), y(*v))).collect();
        let mut path = String::new();
        for (x, y) in &points {
            let command = if path.is_empty() { 'M' } else { 'L' };
            let _ = write!(path, "{command}{x:.1} {y:.1}");
        }
        let _ = write!(svg, r#"<path class="{class}" d="{path}"/>"#);
        for (x, y) in points {
            let fill = if mark == "●" { " filled" } else { "" };
            let _ = write!(svg, r#"<circle class="{class}{fill}" cx="{x:.1}" cy="{y:.1}" r="3"/>"#);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(simulation: u32, parameter_change: f64) -> ConvergenceStep {
        let relative_error = 0.05 + 0.5 / f64::from(simulation);
        ConvergenceStep {
            simulation,
            relative_error,
            relative_error_change: None,
            parameter_change,
            halvings: 0,
        }
    }

    #[test]
    fn bars_shrink_with_the_change_and_odd_values_draw_nothing() {
        let text = table(&[step(1, 1000.0), step(2, 1.0), step(4, f64::NAN), step(5, 0.0)]);
        let bars: Vec<usize> = text.lines().map(|l| l.matches('█').count()).collect();
        assert_eq!(bars, [0, 24, 0, 0, 0], "{text}");
        assert_eq!(table(&[]), "");
    }

    #[test]
    fn the_panel_has_a_curve_for_each_and_no_holes() {
        let mut svg = String::new();
        draw_panel(&mut svg, &[step(1, 1000.0), step(2, 1.0), step(4, f64::NAN), step(5, 0.01)]);
        assert_eq!(svg.matches("<path").count(), 2);
        assert_eq!(svg.matches("<circle").count(), 4 + 3);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}
