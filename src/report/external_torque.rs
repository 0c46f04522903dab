//! A figure of external torque over time as one self-contained SVG file.

use std::fmt::Write as _;

use didim_dynamics::robot::{Joint, JointIndex, Robot};
use didim_identification::external_torque::ObserverState;

use super::figure::{
    Axis, BAND_DEVIATIONS, COLOURS, HEADER_HEIGHT, PANEL_COLUMNS, draw_curve, draw_time, draw_unit,
};
use super::panel::{
    CURVE_STYLE, PANEL_HEIGHT, PANEL_WIDTH, PLOT_BOTTOM, PLOT_LEFT, PLOT_RIGHT, PLOT_TOP,
};
use crate::analysis::ExternalTorqueRow;
use crate::text::escape;

/// Number of parts of the time axis: two for each unit of a panel's width. A part keeps its lowest
/// and its highest torque.
const PARTS: usize = 800;

/// Collector of the curves of a recording, in a memory that does not grow with it.
#[derive(Debug)]
pub struct ExternalTorqueFigure {
    rows_per_part: usize,
    parts: Vec<Part>,
    joints: usize,
}

/// Curves of a part of the recording.
#[derive(Clone, Debug)]
struct Part {
    begin_s: f64,
    rows: usize,
    /// Time and torque of the lowest and of the highest torque of each joint, and the largest
    /// standard deviation.
    joints: Vec<([(f64, f64); 2], f64)>,
}

impl ExternalTorqueFigure {
    /// Creates the curves of a recording of this number of samples.
    pub fn new(samples: usize, joints: usize) -> Self {
        Self { rows_per_part: samples.div_ceil(PARTS).max(1), parts: Vec::new(), joints }
    }

    /// Adds a row. Rows without a usable estimate are left out.
    pub fn add(&mut self, row: &ExternalTorqueRow) {
        if row.estimate.state != ObserverState::Settled {
            return;
        }
        let is_full = self.parts.last().is_none_or(|part| part.rows == self.rows_per_part);
        if is_full {
            let unknown = ([(f64::NAN, f64::INFINITY), (f64::NAN, f64::NEG_INFINITY)], 0.0);
            let joints = vec![unknown; self.joints];
            self.parts.push(Part { begin_s: row.time_s, rows: 0, joints });
        }
        let Some(part) = self.parts.last_mut() else { return };
        part.rows += 1;
        let values = row.estimate.torque.iter().zip(&row.estimate.standard_deviation);
        for (([low, high], deviation), (torque, of_row)) in part.joints.iter_mut().zip(values) {
            if *torque < low.1 {
                *low = (row.time_s, *torque);
            }
            if *torque > high.1 {
                *high = (row.time_s, *torque);
            }
            *deviation = deviation.max(*of_row);
        }
    }

    /// Draws one panel per joint. `heading` is the title, which this function escapes.
    pub fn to_svg(&self, heading: &str, robot: &Robot) -> String {
        let rows = self.joints.div_ceil(PANEL_COLUMNS);
        #[expect(clippy::cast_precision_loss, reason = "at most sixteen joints")]
        let (width, height) =
            (PANEL_WIDTH * PANEL_COLUMNS as f64, HEADER_HEIGHT + PANEL_HEIGHT * rows as f64);
        let mut svg = String::new();
        // Writing to a String cannot fail.
        let _ = write!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             role=\"img\" aria-label=\"{0}\"><title>{0}</title><style>{COLOURS}{CURVE_STYLE}\
             </style><rect class=\"paper\" width=\"{width}\" height=\"{height}\"/><text \
             class=\"heading\" x=\"16\" y=\"26\">{0}</text><line class=\"key predicted\" x1=\"16\" \
             x2=\"36\" y1=\"43\" y2=\"43\"/><text x=\"42\" y=\"47\">external torque, with ± 2 σ \
             of an untouched arm</text>",
            escape(heading)
        );
        for (index, joint) in robot.chain().iter().enumerate().take(self.joints) {
            #[expect(clippy::cast_precision_loss, reason = "at most sixteen joints")]
            let (x, y) = (
                (index % PANEL_COLUMNS) as f64 * PANEL_WIDTH,
                HEADER_HEIGHT + (index / PANEL_COLUMNS) as f64 * PANEL_HEIGHT,
            );
            let _ = write!(svg, r#"<g transform="translate({x} {y})">"#);
            self.draw_joint(&mut svg, (index, joint), &robot.joint_label(JointIndex::new(index)));
            svg += "</g>";
        }
        svg += "</svg>\n";
        svg
    }

    fn draw_joint(&self, svg: &mut String, (index, joint): (usize, &Joint), label: &str) {
        let title = escape(label);
        let _ = write!(svg, r#"<text class="title" x="{PLOT_LEFT}" y="20">joint {title}</text>"#);
        let parts = || self.parts.iter().map(|part| (part.begin_s, &part.joints[index]));
        let reach = 1.05 * parts().fold(0.0, |reach: f64, (_, part)| reach.max(reach_of(part)));
        let (Some((start, _)), Some((end, _))) = (parts().next(), parts().next_back()) else {
            return;
        };
        if reach <= 0.0 {
            return;
        }
        let wide = PANEL_WIDTH - PLOT_LEFT - PLOT_RIGHT;
        let x = |t: f64| PLOT_LEFT + (t - start) / (end - start).max(f64::MIN_POSITIVE) * wide;
        let axis = Axis {
            top: PLOT_TOP,
            height: PANEL_HEIGHT - PLOT_TOP - PLOT_BOTTOM,
            low: -reach,
            high: reach,
        };
        let edge = |sign: f64| {
            parts().map(move |(time, (_, deviation))| (time, sign * BAND_DEVIATIONS * deviation))
        };
        let back: Vec<_> = edge(-1.0).collect();
        let outline: Vec<String> = edge(1.0)
            .chain(back.into_iter().rev())
            .map(|(time, value)| format!("{:.1},{:.1}", x(time), axis.y_pixel(value)))
            .collect();
        let _ = write!(svg, r#"<polygon class="sigmas" points="{}"/>"#, outline.join(" "));
        axis.draw_axis(svg, 4);
        draw_time(svg, (start, end), PANEL_HEIGHT, x);
        draw_unit(svg, joint.kind.torque_unit(), 20.0);
        let points = parts().flat_map(
            |(_, ([low, high], _))| {
                if low.0 <= high.0 { [*low, *high] } else { [*high, *low] }
            },
        );
        draw_curve(svg, "predicted", points.map(|(time, value)| (x(time), axis.y_pixel(value))));
    }
}

/// Returns the largest absolute value that a panel shows of a part. A joint without a recorded
/// torque has none.
fn reach_of(([low, high], deviation): &([(f64, f64); 2], f64)) -> f64 {
    let torque = f64::max(-low.1, high.1);
    if torque.is_finite() { torque.max(BAND_DEVIATIONS * deviation) } else { 0.0 }
}
