//! A parameter over time in the terminal, drawn with Braille patterns.

use super::super::terminal::{DOT_BITS, DOT_COLUMNS, DOT_ROWS};
use crate::archive::drift::JudgedHistory;
use crate::text::significant_digits;

/// Width of an axis label including the axis, in characters.
const LABEL_WIDTH: usize = 12;
/// Number of lines of a plot.
const PLOT_ROWS: usize = 8;
/// Number of standard deviations drawn to either side of a value.
const BAND_DEVIATIONS: f64 = 2.0;

/// Plots values with two standard deviations to either side, and the band of the baseline as dotted
/// lines. `None` if no usable result contains the parameter. `columns` is the width in characters,
/// including the labels.
pub fn plot(history: &JudgedHistory, parameter: &str, columns: usize) -> Option<String> {
    let points = history.parameter_points(parameter);
    let (first, last) = (points.first()?.0, points.last()?.0);
    let band = history
        .baseline_band(parameter)
        .map(|(middle, half)| [middle - half, middle, middle + half]);
    let spread = |sigma: f64| if sigma.is_finite() { BAND_DEVIATIONS * sigma } else { 0.0 };
    let ends =
        points.iter().flat_map(|&(_, value, sigma)| [value - spread(sigma), value + spread(sigma)]);
    let (low, high) = ends
        .chain(band.into_iter().flatten())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    // The margin also gives a scale to a single value.
    let margin = 0.05 * (high - low).max(1e-9 * high.abs()).max(f64::MIN_POSITIVE);
    let (low, high) = (low - margin, high + margin);
    let mut canvas = Canvas::new(columns.saturating_sub(LABEL_WIDTH).max(2), PLOT_ROWS);
    let (wide, tall) =
        ((canvas.columns * DOT_COLUMNS - 1) as f64, (PLOT_ROWS * DOT_ROWS - 1) as f64);
    let x = |days: f64| if last > first { (days - first) / (last - first) * wide } else { 0.0 };
    let y = |value: f64| (high - value) / (high - low) * tall;
    for level in band.into_iter().flatten() {
        (0..canvas.columns * DOT_COLUMNS)
            .step_by(4)
            .for_each(|column| canvas.dot(column as f64, y(level)));
    }
    for &(days, value, sigma) in &points {
        let (top, bottom) = (y(value + spread(sigma)).round(), y(value - spread(sigma)).round());
        let mut row = top;
        while row <= bottom {
            canvas.dot(x(days), row);
            row += 1.0;
        }
        // If the interval is no longer than a dot, a cross marks the value.
        canvas.dot(x(days) - 1.0, y(value));
        canvas.dot(x(days) + 1.0, y(value));
    }
    let (from, _) = history.time_range()?;
    let date = |days: f64| from.plus_days(days).map_or_else(String::new, |time| time.minute());
    let unit = match history.unit(parameter) {
        "" => String::new(),
        unit => format!(" [{unit}]"),
    };
    let description = history.description(parameter).map(|of| format!("{of}: "));
    let description = description.unwrap_or_default();
    let mut text = format!("{description}{parameter}{unit}, ±2σ (statistical)");
    if band.is_some() {
        text += "; dotted: the baseline and its band";
    }
    text += "\n";
    let lines = canvas.lines();
    for (row, line) in lines.iter().enumerate() {
        let label = match row {
            0 => significant_digits(high, 4),
            row if row + 1 == lines.len() => significant_digits(low, 4),
            _ => String::new(),
        };
        let tick = if label.is_empty() { '│' } else { '┤' };
        text += format!("{label:>10} {tick}{line}").trim_end();
        text.push('\n');
    }
    let (start, end) = (date(first), date(last));
    let gap = canvas.columns.saturating_sub(start.len() + end.len());
    if gap > 0 && last > first {
        text += &format!("{:12}{start}{}{end}\n", "", " ".repeat(gap));
    } else {
        text += &format!("{:12}{start}\n", "");
    }
    Some(text)
}

struct Canvas {
    columns: usize,
    cells: Vec<Vec<u8>>,
}

impl Canvas {
    fn new(columns: usize, rows: usize) -> Self {
        Self { columns, cells: vec![vec![0; columns]; rows] }
    }

    /// Sets a dot. Dots outside the canvas are ignored.
    fn dot(&mut self, x: f64, y: f64) {
        let (x, y) = (x.round(), y.round());
        if !(x >= 0.0 && y >= 0.0) {
            return;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative, and a cast saturates"
        )]
        let (x, y) = (x as usize, y as usize);
        let cell = self.cells.get_mut(y / DOT_ROWS).and_then(|row| row.get_mut(x / DOT_COLUMNS));
        if let Some(cell) = cell {
            *cell |= DOT_BITS[x % DOT_COLUMNS][y % DOT_ROWS];
        }
    }

    fn lines(&self) -> Vec<String> {
        let line = |row: &Vec<u8>| {
            row.iter().filter_map(|bits| char::from_u32(0x2800 + u32::from(*bits))).collect()
        };
        self.cells.iter().map(line).collect()
    }
}
