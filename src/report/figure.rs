//! A figure of measured against predicted torque, as one self-contained SVG file.

use std::fmt::Write as _;

use didim_core::identification::ConvergenceStep;

use super::panel::{BOTTOM, CURVES, LEFT, PANEL_HEIGHT, PANEL_WIDTH, RIGHT, TOP, ticks};
use super::{TorquePanel, convergence, value_range};
use crate::text::escape;

const COLUMNS: usize = 2;
const HEADER: f64 = 58.0;

/// The colours follow the reader's light or dark setting; a printer gets the light ones. The two
/// curves differ in lightness and width too, so that they are told apart without colour.
const COLOURS: &str = "\
svg{--paper:#fff;--ink:#1d2530;--faint:#d9dee5;--measured:#9fb3c8;--predicted:#b3261e;--residual:#3d7a4f}\
@media screen and (prefers-color-scheme:dark){svg{--paper:#14181d;--ink:#e4e8ed;--faint:#333c46;--measured:#6d8299;--predicted:#ff8a73;--residual:#7fc796}}";

/// Draws one panel per joint, measured torque, prediction and residual over time; and one of the
/// steps of an iteration, if there are any.
///
/// `heading` stands above; it is escaped here.
pub fn torque_figure(
    heading: &str,
    panels: &[TorquePanel<'_>],
    steps: &[ConvergenceStep],
) -> String {
    let count = panels.len() + usize::from(!steps.is_empty());
    let rows = count.div_ceil(COLUMNS);
    #[expect(clippy::cast_precision_loss, reason = "at most eight joints")]
    let (width, height) = (PANEL_WIDTH * COLUMNS as f64, HEADER + PANEL_HEIGHT * rows as f64);
    let mut svg = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        svg,
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" aria-label="{0}"><title>{0}</title><style>{COLOURS}{CURVES}</style><rect class="paper" width="{width}" height="{height}"/><text class="heading" x="16" y="26">{0}</text>"#,
        escape(heading)
    );
    for (x, class, label) in [
        (16.0, "measured", "measured"),
        (110.0, "predicted", "predicted"),
        (206.0, "residual", "measured − predicted"),
    ] {
        let _ = write!(
            svg,
            r#"<line class="key {class}" x1="{x}" x2="{}" y1="43" y2="43"/><text x="{}" y="47">{label}</text>"#,
            x + 20.0,
            x + 26.0
        );
    }
    for index in 0..count {
        #[expect(clippy::cast_precision_loss, reason = "at most eight joints")]
        let (x, y) = (
            (index % COLUMNS) as f64 * PANEL_WIDTH,
            HEADER + (index / COLUMNS) as f64 * PANEL_HEIGHT,
        );
        let _ = write!(svg, r#"<g transform="translate({x} {y})">"#);
        match panels.get(index) {
            Some(panel) => draw_panel(&mut svg, panel),
            None => convergence::draw_panel(&mut svg, steps),
        }
        svg += "</g>";
    }
    svg += "</svg>\n";
    svg
}

/// Draws the torque of one joint into a frame of the size of a panel.
pub(super) fn draw_panel(svg: &mut String, panel: &TorquePanel<'_>) {
    let error = 100.0 * panel.relative_error;
    let error = if error.is_finite() { format!("{error:.2} %") } else { "–".to_owned() };
    let _ = write!(
        svg,
        r#"<text class="title" x="{LEFT}" y="20">joint {} · relative error {error}</text>"#,
        panel.joint
    );
    let Some((low, high)) = value_range([panel.measured_nm, panel.predicted_nm]) else { return };
    let (Some(&start), Some(&end)) = (panel.time_s.first(), panel.time_s.last()) else { return };
    let (wide, tall) = (PANEL_WIDTH - LEFT - RIGHT, PANEL_HEIGHT - TOP - BOTTOM);
    let x = |t: f64| LEFT + (t - start) / (end - start).max(f64::MIN_POSITIVE) * wide;
    let y = |v: f64| TOP + (high - v) / (high - low) * tall;
    for tick in ticks(low, high, 4) {
        let at = y(tick);
        let _ = write!(
            svg,
            r#"<line class="grid" x1="{LEFT}" x2="{}" y1="{at:.1}" y2="{at:.1}"/><text class="tick" x="{}" y="{:.1}" text-anchor="end">{tick}</text>"#,
            LEFT + wide,
            LEFT - 5.0,
            at + 3.5
        );
    }
    for tick in ticks(start, end, 6) {
        let at = x(tick);
        let _ = write!(
            svg,
            r#"<text class="tick" x="{at:.1}" y="{:.1}" text-anchor="middle">{tick} s</text>"#,
            TOP + tall + 16.0
        );
    }
    let _ = write!(
        svg,
        r#"<text class="tick" x="{}" y="20" text-anchor="end">{}</text>"#,
        LEFT - 5.0,
        panel.unit
    );
    let residual: Vec<f64> =
        panel.measured_nm.iter().zip(panel.predicted_nm).map(|(m, p)| m - p).collect();
    for (class, values) in [
        ("measured", panel.measured_nm),
        ("predicted", panel.predicted_nm),
        ("residual", residual.as_slice()),
    ] {
        let points = panel.time_s.iter().zip(values).map(|(t, v)| (x(*t), y(*v)));
        draw_curve(svg, class, points);
    }
    for time in panel.downweighted.iter().filter_map(|&row| panel.time_s.get(row)) {
        let (at, base) = (x(*time), TOP + tall);
        let _ = write!(
            svg,
            r#"<line class="downweighted" x1="{at:.1}" x2="{at:.1}" y1="{base}" y2="{}"/>"#,
            base + 5.0
        );
    }
}

/// Draws a curve whose points come in the order of x. Of those within one unit of x the highest and
/// the lowest are enough: a long record draws the same and stays small.
fn draw_curve(svg: &mut String, class: &str, points: impl Iterator<Item = (f64, f64)>) {
    let mut path = String::new();
    let mut add = |points: &mut Vec<(f64, f64)>| {
        let by_y = |a: &(f64, f64), b: &(f64, f64)| a.1.total_cmp(&b.1);
        let extremes = points.iter().copied().min_by(by_y).zip(points.iter().copied().max_by(by_y));
        if let Some((low, high)) = extremes.filter(|_| points.len() > 2) {
            *points = if low.0 <= high.0 { vec![low, high] } else { vec![high, low] };
        }
        for (x, y) in points.drain(..) {
            let command = if path.is_empty() { 'M' } else { 'L' };
            let _ = write!(path, "{command}{x:.1} {y:.1}");
        }
    };
    let mut together: Vec<(f64, f64)> = Vec::new();
    for point in points.filter(|(x, y)| x.is_finite() && y.is_finite()) {
        if together.first().is_some_and(|first| point.0 - first.0 >= 1.0) {
            add(&mut together);
        }
        together.push(point);
    }
    add(&mut together);
    let _ = write!(svg, r#"<path class="{class}" d="{path}"/>"#);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_figure_has_a_panel_per_joint_and_escapes_its_heading() {
        let time = [0.0, 1.0, 2.0];
        let panel = |joint| TorquePanel {
            joint,
            unit: "N·m",
            time_s: &time,
            measured_nm: &[0.0, 2.0, -1.0],
            predicted_nm: &[0.1, 1.9, f64::NAN],
            downweighted: &[1, 99],
            relative_error: 0.05,
        };
        let svg = torque_figure("arm <1> & more", &[panel(1), panel(2), panel(3)], &[]);
        assert_eq!(svg.matches("<path").count(), 9);
        assert_eq!(
            svg.matches("<line class=\"downweighted\"").count(),
            3,
            "a row that there is not"
        );
        assert!(svg.contains("arm &lt;1&gt; &amp; more") && !svg.contains("NaN"), "{svg}");
        assert!(!svg.contains("http") || svg.matches("http").count() == 1, "only the namespace");
    }

    /// A hundred points on every unit of x leave two of them, a short record all.
    #[test]
    fn a_long_curve_keeps_its_extremes_only() {
        let (mut long, mut short) = (String::new(), String::new());
        let sample = |k: u32| (f64::from(k) / 100.0, f64::from(k * k % 97));
        draw_curve(&mut long, "measured", (0..30_000).map(sample));
        draw_curve(&mut short, "measured", (0..300).step_by(60).map(sample));
        assert_eq!(long.matches(' ').count(), 2 * 300 + 2, "one per point, two in the tag");
        assert!(long.contains(" 96.0") && long.contains(" 0.0"));
        assert_eq!(short.matches('L').count(), 4);
    }
}
