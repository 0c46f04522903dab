//! A figure of measured and predicted torque as one self-contained SVG file.

use std::fmt::Write as _;

use didim_dynamics::robot::JointKind;
use didim_identification::identification::ConvergenceStep;

use super::panel::{CURVE_STYLE, PANEL_WIDTH, PLOT_BOTTOM, PLOT_LEFT, PLOT_RIGHT, PLOT_TOP, ticks};
use super::{TorquePanel, convergence, value_range};
use crate::text::escape;

pub(super) const PANEL_COLUMNS: usize = 2;
pub(super) const HEADER_HEIGHT: f64 = 58.0;

/// The colours follow the reader's light or dark setting; a printer gets the light ones. The two
/// curves also differ in lightness and width, so they can be distinguished without colour.
pub(super) const COLOURS: &str = "svg{--paper:#fff;--ink:#1d2530;--faint:#d9dee5;\
    --measured:#9fb3c8;--predicted:#17456e;--residual:#3d7a4f;--sigmas:#e3efe6}\
    @media screen and (prefers-color-scheme:dark){svg{--paper:#14181d;--ink:#e4e8ed;\
    --faint:#333c46;--measured:#6d8299;--predicted:#a9d3f5;--residual:#7fc796;--sigmas:#223429}}";

/// Draws one panel per joint with measured torque, prediction and residual over time. Also draws a
/// panel of the iteration steps, if there are any.
///
/// `heading` is the title. This function escapes it.
pub fn torque_figure(
    heading: &str,
    panels: &[TorquePanel<'_>],
    steps: &[ConvergenceStep],
) -> String {
    let count = panels.len() + usize::from(!steps.is_empty());
    let rows = count.div_ceil(PANEL_COLUMNS);
    #[expect(clippy::cast_precision_loss, reason = "at most sixteen joints")]
    let (width, height) =
        (PANEL_WIDTH * PANEL_COLUMNS as f64, HEADER_HEIGHT + TORQUE_PANEL_HEIGHT * rows as f64);
    let mut svg = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         aria-label=\"{0}\"><title>{0}</title><style>{COLOURS}{CURVE_STYLE}</style><rect \
         class=\"paper\" width=\"{width}\" height=\"{height}\"/><text class=\"heading\" x=\"16\" \
         y=\"26\">{0}</text>",
        escape(heading)
    );
    for (x, class, label) in [
        (16.0, "measured", "measured"),
        (110.0, "predicted", "predicted"),
        (206.0, "residual", "measured − predicted, on the lower axis, with ± 2 σ"),
    ] {
        let _ = write!(
            svg,
            "<line class=\"key {class}\" x1=\"{x}\" x2=\"{}\" y1=\"43\" y2=\"43\"/><text x=\"{}\" \
             y=\"47\">{label}</text>",
            x + 20.0,
            x + 26.0
        );
    }
    for index in 0..count {
        #[expect(clippy::cast_precision_loss, reason = "at most sixteen joints")]
        let (x, y) = (
            (index % PANEL_COLUMNS) as f64 * PANEL_WIDTH,
            HEADER_HEIGHT + (index / PANEL_COLUMNS) as f64 * TORQUE_PANEL_HEIGHT,
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

/// Height of the torque axis, of the residual axis, and of the gap between them.
const TORQUE_AXIS_HEIGHT: f64 = 138.0;
const RESIDUAL_AXIS_HEIGHT: f64 = 66.0;
const AXIS_GAP: f64 = 14.0;
/// Height of a panel with both axes.
pub(super) const TORQUE_PANEL_HEIGHT: f64 =
    PLOT_TOP + TORQUE_AXIS_HEIGHT + AXIS_GAP + RESIDUAL_AXIS_HEIGHT + PLOT_BOTTOM;
/// Half width of the residual band, in standard deviations.
pub(super) const BAND_DEVIATIONS: f64 = 2.0;

/// A value axis next to a time axis.
pub(super) struct Axis {
    pub(super) top: f64,
    pub(super) height: f64,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Axis {
    pub(super) fn y_pixel(&self, value: f64) -> f64 {
        self.top + (self.high - value) / (self.high - self.low) * self.height
    }

    pub(super) fn draw_axis(&self, svg: &mut String, wanted: u32) {
        for tick in ticks(self.low, self.high, wanted) {
            let line_y = self.y_pixel(tick);
            let _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{PLOT_LEFT}\" x2=\"{}\" y1=\"{line_y:.1}\" \
                 y2=\"{line_y:.1}\"/><text class=\"tick\" x=\"{}\" y=\"{:.1}\" \
                 text-anchor=\"end\">{tick}</text>",
                PANEL_WIDTH - PLOT_RIGHT,
                PLOT_LEFT - 5.0,
                line_y + 3.5
            );
        }
    }
}

/// Draws the torque of one joint, and below it the residual on a separate axis. The frame has
/// [`PANEL_WIDTH`] × [`TORQUE_PANEL_HEIGHT`].
pub(super) fn draw_panel(svg: &mut String, panel: &TorquePanel<'_>) {
    let error = 100.0 * panel.relative_error;
    let error = if error.is_finite() { format!("{error:.2} %") } else { "–".to_owned() };
    let _ = write!(
        svg,
        r#"<text class="title" x="{PLOT_LEFT}" y="20">joint {} · relative error {error}</text>"#,
        escape(&panel.joint)
    );
    let Some((low, high)) = value_range([panel.measured_nm, panel.predicted_nm]) else { return };
    let (Some(&start), Some(&end)) = (panel.time_s.first(), panel.time_s.last()) else { return };
    let wide = PANEL_WIDTH - PLOT_LEFT - PLOT_RIGHT;
    let x = |t: f64| PLOT_LEFT + (t - start) / (end - start).max(f64::MIN_POSITIVE) * wide;
    let base = TORQUE_PANEL_HEIGHT - PLOT_BOTTOM;
    draw_time(svg, (start, end), TORQUE_PANEL_HEIGHT, x);
    draw_unit(svg, panel.unit, 20.0);
    let torque = Axis { top: PLOT_TOP, height: TORQUE_AXIS_HEIGHT, low, high };
    torque.draw_axis(svg, 4);
    let curve = |values: &[f64], axis: &Axis| -> Vec<(f64, f64)> {
        panel.time_s.iter().zip(values).map(|(t, v)| (x(*t), axis.y_pixel(*v))).collect()
    };
    draw_curve(svg, "measured", curve(panel.measured_nm, &torque).into_iter());
    draw_curve(svg, "predicted", curve(panel.predicted_nm, &torque).into_iter());
    draw_residual(svg, panel, curve);
    for time in panel.downweighted.iter().filter_map(|&row| panel.time_s.get(row)) {
        let line_x = x(*time);
        let _ = write!(
            svg,
            r#"<line class="downweighted" x1="{line_x:.1}" x2="{line_x:.1}" y1="{base}" y2="{}"/>"#,
            base + 5.0
        );
    }
}

/// Draws the labels of the time axis below a panel of this height.
pub(super) fn draw_time(
    svg: &mut String,
    (start, end): (f64, f64),
    height: f64,
    x: impl Fn(f64) -> f64,
) {
    for tick in ticks(start, end, 6) {
        let _ = write!(
            svg,
            r#"<text class="tick" x="{:.1}" y="{:.1}" text-anchor="middle">{tick} s</text>"#,
            x(tick),
            height - PLOT_BOTTOM + 16.0
        );
    }
}

/// Draws the unit of an axis above its labels.
pub(super) fn draw_unit(svg: &mut String, unit: &str, y: f64) {
    let _ = write!(
        svg,
        r#"<text class="tick" x="{}" y="{y}" text-anchor="end">{unit}</text>"#,
        PLOT_LEFT - 5.0
    );
}

/// One joint's motion, for a plot.
#[derive(Clone, Debug)]
pub(super) struct MotionPanel<'a> {
    /// The joint.
    pub(super) joint: String,
    /// Kind of the joint, which decides the units.
    pub(super) kind: JointKind,
    /// Time of each point \[s\].
    pub(super) time_s: &'a [f64],
    /// Positions \[rad or m\].
    pub(super) position: &'a [f64],
    /// Velocities \[rad/s or m/s\].
    pub(super) velocity: &'a [f64],
}

/// Draws the position of one joint, and below it the velocity. The frame has [`PANEL_WIDTH`] ×
/// [`TORQUE_PANEL_HEIGHT`].
pub(super) fn draw_motion(svg: &mut String, panel: &MotionPanel<'_>) {
    let _ = write!(
        svg,
        r#"<text class="title" x="{PLOT_LEFT}" y="20">joint {} · position, velocity [{}]</text>"#,
        escape(&panel.joint),
        panel.kind.velocity_unit()
    );
    let (Some(&start), Some(&end)) = (panel.time_s.first(), panel.time_s.last()) else { return };
    let wide = PANEL_WIDTH - PLOT_LEFT - PLOT_RIGHT;
    let x = |t: f64| PLOT_LEFT + (t - start) / (end - start).max(f64::MIN_POSITIVE) * wide;
    draw_time(svg, (start, end), TORQUE_PANEL_HEIGHT, x);
    draw_unit(svg, panel.kind.position_unit(), 20.0);
    let below = PLOT_TOP + TORQUE_AXIS_HEIGHT + AXIS_GAP;
    for (class, values, top, tall) in [
        ("predicted", panel.position, PLOT_TOP, TORQUE_AXIS_HEIGHT),
        ("residual", panel.velocity, below, RESIDUAL_AXIS_HEIGHT),
    ] {
        let Some((low, high)) = value_range([values]) else { continue };
        let axis = Axis { top, height: tall, low, high };
        axis.draw_axis(svg, 4);
        let points = panel.time_s.iter().zip(values).map(|(t, v)| (x(*t), axis.y_pixel(*v)));
        draw_curve(svg, class, points);
    }
}

fn draw_residual(
    svg: &mut String,
    panel: &TorquePanel<'_>,
    curve: impl Fn(&[f64], &Axis) -> Vec<(f64, f64)>,
) {
    let residual: Vec<f64> =
        panel.measured_nm.iter().zip(panel.predicted_nm).map(|(m, p)| m - p).collect();
    let finite = residual.iter().filter(|value| value.is_finite());
    let (count, squares, largest) = finite.fold((0.0, 0.0, 0.0_f64), |(n, sum, largest), v| {
        (n + 1.0, sum + v * v, largest.max(v.abs()))
    });
    let sigma = f64::sqrt(squares / f64::max(count, 1.0));
    let reach = 1.05 * largest.max(BAND_DEVIATIONS * sigma);
    // If all residuals are zero, the axis needs another range.
    let reach = if reach > 0.0 { reach } else { 1.0 };
    let axis = Axis {
        top: PLOT_TOP + TORQUE_AXIS_HEIGHT + AXIS_GAP,
        height: RESIDUAL_AXIS_HEIGHT,
        low: -reach,
        high: reach,
    };
    let (top, bottom) =
        (axis.y_pixel(BAND_DEVIATIONS * sigma), axis.y_pixel(-BAND_DEVIATIONS * sigma));
    let wide = PANEL_WIDTH - PLOT_LEFT - PLOT_RIGHT;
    let _ = write!(
        svg,
        r#"<rect class="sigmas" x="{PLOT_LEFT}" y="{top:.1}" width="{wide}" height="{:.1}"/>"#,
        bottom - top
    );
    axis.draw_axis(svg, 4);
    draw_curve(svg, "residual", curve(&residual, &axis).into_iter());
}

/// Draws a curve. The points must be in ascending order of x. Within one unit of x, only the
/// highest and the lowest point are kept, which does not change the look of a long record but keeps
/// the file small.
pub(super) fn draw_curve(svg: &mut String, class: &str, points: impl Iterator<Item = (f64, f64)>) {
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
        let panel = |joint: &str| TorquePanel {
            joint: joint.to_owned(),
            unit: "N·m",
            time_s: &time,
            measured_nm: &[0.0, 2.0, -1.0],
            predicted_nm: &[0.1, 1.9, f64::NAN],
            downweighted: &[1, 99],
            relative_error: 0.05,
        };
        let svg = torque_figure("arm <1> & more", &[panel("1 (a<b)"), panel("2"), panel("3")], &[]);
        assert_eq!(svg.matches("<path").count(), 9);
        assert_eq!(svg.matches("class=\"sigmas\"").count(), 3, "a band for each residual");
        assert_eq!(
            svg.matches("<line class=\"downweighted\"").count(),
            3,
            "a row that there is not"
        );
        assert!(svg.contains("arm &lt;1&gt; &amp; more") && !svg.contains("NaN"), "{svg}");
        assert!(!svg.contains("http") || svg.matches("http").count() == 1, "only the namespace");
    }

    /// The residuals are 0.3, −0.3 and NaN: σ is 0.3, and the band determines the range of the
    /// axis.
    #[test]
    fn the_band_is_two_deviations_of_the_residual_on_its_own_axis() {
        let panel = TorquePanel {
            joint: "1".to_owned(),
            unit: "N·m",
            time_s: &[0.0, 1.0, 2.0],
            measured_nm: &[50.3, -50.3, 1.0],
            predicted_nm: &[50.0, -50.0, f64::NAN],
            downweighted: &[],
            relative_error: 0.006,
        };
        let mut svg = String::new();
        draw_panel(&mut svg, &panel);
        let band = svg.split_once("class=\"sigmas\"").unwrap().1;
        // 0.6 of a reach of 1.05 · 0.6 to either side of the middle of the axis.
        let (middle, half) = (
            PLOT_TOP + TORQUE_AXIS_HEIGHT + AXIS_GAP + RESIDUAL_AXIS_HEIGHT / 2.0,
            RESIDUAL_AXIS_HEIGHT / 2.0 / 1.05,
        );
        let expected = format!("y=\"{:.1}\"", middle - half);
        assert!(band.contains(&expected), "{expected}: {svg}");
        let height = format!("height=\"{:.1}\"", 2.0 * half);
        assert!(band.contains(&height), "{height}: {svg}");
    }

    /// With a hundred points per unit of x, two of them remain. A short record keeps all.
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
