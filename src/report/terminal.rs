//! A small plot in the terminal, drawn with Braille patterns: each character is 2 × 4 dots.

use super::{TorquePanel, value_range};

/// Width of an axis label including the axis, in characters.
const LABEL_WIDTH: usize = 9;

pub(super) const DOT_COLUMNS: usize = 2;
pub(super) const DOT_ROWS: usize = 4;
/// Bit of each dot in a Braille pattern (Unicode 16.0, U+2800), by column and row.
pub(super) const DOT_BITS: [[u8; DOT_ROWS]; DOT_COLUMNS] =
    [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];

/// Plots the measured torque, and below it the residual in the same scale.
///
/// `columns` is the width in characters, including the labels of the axis.
pub fn torque_plot(panel: &TorquePanel<'_>, columns: usize) -> String {
    let residual: Vec<f64> =
        panel.measured_nm.iter().zip(panel.predicted_nm).map(|(m, p)| m - p).collect();
    let Some((low, high)) = value_range([panel.measured_nm, panel.predicted_nm]) else {
        return String::new();
    };
    let columns = columns.saturating_sub(LABEL_WIDTH).max(2);
    let span = high - low;
    let measured_rows = 6;
    // The residual has the same N·m per character as the torque above, with the range around zero
    // rounded up to full characters.
    let reach = residual.iter().fold(0.0_f64, |r, v| r.max(v.abs()));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a ratio of torques, clamped to a few rows"
    )]
    let residual_rows = ((2.0 * reach / span * 6.0).ceil() as usize).clamp(1, measured_rows);
    #[expect(clippy::cast_precision_loss, reason = "a handful of rows")]
    let half = span * residual_rows as f64 / measured_rows as f64 / 2.0;
    let seconds = match (panel.time_s.first(), panel.time_s.last()) {
        (Some(first), Some(last)) => last - first,
        _ => 0.0,
    };
    let mut text = format!("joint {}, torque over {seconds:.1} s\n", panel.joint);
    text += &add_labels(
        &draw_canvas(panel.measured_nm, low, high, columns, measured_rows),
        low,
        high,
        "measured",
    );
    text += &add_labels(
        &draw_canvas(&residual, -half, half, columns, residual_rows),
        -half,
        half,
        "measured − predicted, same scale",
    );
    text
}

fn add_labels(lines: &[String], low: f64, high: f64, name: &str) -> String {
    let last = lines.len().saturating_sub(1);
    let mut text = format!("{}{name}\n", " ".repeat(LABEL_WIDTH));
    for (row, line) in lines.iter().enumerate() {
        let label = match row {
            0 if last == 0 => format!("±{high:6.1} ┤"),
            0 => format!("{high:7.1} ┤"),
            r if r == last => format!("{low:7.1} ┤"),
            _ => "        │".to_owned(),
        };
        text += format!("{label}{line}").trim_end();
        text.push('\n');
    }
    text
}

/// Draws `values` over the complete width. Each column of dots spans the extremes of its samples.
fn draw_canvas(values: &[f64], low: f64, high: f64, columns: usize, rows: usize) -> Vec<String> {
    let (wide, tall) = (columns * DOT_COLUMNS, rows * DOT_ROWS);
    let mut cells = vec![vec![0_u8; columns]; rows];
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "clamped to the canvas"
    )]
    let dot_row = |value: f64| {
        let fraction = ((high - value) / (high - low)).clamp(0.0, 1.0);
        ((fraction * (tall - 1) as f64).round() as usize).min(tall - 1)
    };
    for x in 0..wide {
        // The last sample of the previous column is included, which closes gaps in steep parts of
        // the curve.
        let start = (x * values.len() / wide).saturating_sub(1);
        let end = ((x + 1) * values.len() / wide).max(start + 1).min(values.len());
        let part = values.get(start..end).unwrap_or(&[]);
        let finite = || part.iter().copied().filter(|v| v.is_finite());
        let (Some(top), Some(bottom)) = (finite().reduce(f64::max), finite().reduce(f64::min))
        else {
            continue;
        };
        for y in dot_row(top)..=dot_row(bottom) {
            cells[y / DOT_ROWS][x / DOT_COLUMNS] |= DOT_BITS[x % DOT_COLUMNS][y % DOT_ROWS];
        }
    }
    cells
        .iter()
        .map(|row| {
            row.iter().filter_map(|bits| char::from_u32(0x2800 + u32::from(*bits))).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_runs_from_corner_to_corner() {
        let ramp: Vec<f64> = (0..64).map(f64::from).collect();
        let lines = draw_canvas(&ramp, 0.0, 63.0, 8, 2);
        assert_eq!(lines.len(), 2);
        assert!(lines.iter().all(|l| l.chars().count() == 8));
        // Bottom left and top right hold the first and the last dot; the other corners are empty.
        assert_eq!(lines[0].chars().next(), Some('\u{2800}'));
        assert_eq!(lines[1].chars().last(), Some('\u{2800}'));
        assert_ne!(lines[1].chars().next(), Some('\u{2800}'));
        assert_ne!(lines[0].chars().last(), Some('\u{2800}'));
    }

    #[test]
    fn nothing_finite_draws_nothing_and_does_not_fail() {
        let nan = [f64::NAN; 4];
        let panel = TorquePanel {
            joint: "1".to_owned(),
            unit: "N·m",
            time_s: &[],
            measured_nm: &nan,
            predicted_nm: &nan,
            downweighted: &[],
            relative_error: f64::NAN,
        };
        assert_eq!(torque_plot(&panel, 10), "");
        assert_eq!(draw_canvas(&[], 0.0, 1.0, 3, 1), ["\u{2800}\u{2800}\u{2800}"]);
    }
}
