//! The drawings of a comparison.

use std::fmt::Write as _;

use didim_identification::identification::{Method, ParameterEstimate, SingularValues};
use maud::{Markup, PreEscaped, html};

use super::css_class;
use crate::comparison::INTERVAL_DEVIATIONS;
use didim::text::significant_digits;

/// Width of a drawing in a table, height of one line, and margin above and below the lines \[px\].
const CHART_WIDTH: f64 = 240.0;
const LINE_HEIGHT: f64 = 6.0;
const VERTICAL_MARGIN: f64 = 4.0;
/// Half of the scale range, in standard deviations of the reference.
const SCALE_DEVIATIONS: f64 = 8.0;

fn x_position(deviations: f64) -> f64 {
    ((deviations / SCALE_DEVIATIONS + 1.0) / 2.0 * CHART_WIDTH).clamp(0.0, CHART_WIDTH)
}

/// Draws the numbers of the interval scale.
pub(super) fn interval_labels() -> Markup {
    let mut svg = String::new();
    for tick in [-6.0, -3.0, 0.0, 3.0, 6.0] {
        let text = tick.to_string().replace('-', "−");
        let x = x_position(tick);
        let _ = write!(
            svg,
            r#"<text class="tick" x="{x:.1}" y="11" text-anchor="middle">{text}</text>"#
        );
    }
    inline_svg(&svg, 14.0)
}

/// Draws one line per estimate, with a dot at the estimate and a bar of ± 3 σ, over the band of the
/// reference.
pub(super) fn intervals(
    reference: &ParameterEstimate,
    truth: Option<f64>,
    estimates: &[(Method, &ParameterEstimate)],
) -> Markup {
    #[expect(clippy::cast_precision_loss, reason = "a handful of methods")]
    let height = LINE_HEIGHT * estimates.len() as f64 + 2.0 * VERTICAL_MARGIN;
    let scaled = |value: f64| (value - reference.value) / reference.standard_deviation;
    let mut svg = String::new();
    let _ = write!(
        svg,
        "<rect class=\"band\" x=\"{:.1}\" y=\"0\" width=\"{:.1}\" height=\"{height}\"/><line \
         class=\"axis\" x1=\"{2:.1}\" x2=\"{2:.1}\" y1=\"0\" y2=\"{height}\"/>",
        x_position(-INTERVAL_DEVIATIONS),
        x_position(INTERVAL_DEVIATIONS) - x_position(-INTERVAL_DEVIATIONS),
        x_position(0.0)
    );
    if let Some(x) = truth.map(scaled).filter(|x| x.abs() <= SCALE_DEVIATIONS) {
        let x = x_position(x);
        let _ =
            write!(svg, r#"<line class="truth" x1="{x:.1}" x2="{x:.1}" y1="0" y2="{height}"/>"#);
    }
    for ((method, estimate), k) in estimates.iter().zip(0_u32..) {
        let (x, y) = (scaled(estimate.value), VERTICAL_MARGIN + LINE_HEIGHT * (f64::from(k) + 0.5));
        let spread =
            INTERVAL_DEVIATIONS * estimate.standard_deviation / reference.standard_deviation;
        if !(x + spread).is_finite() {
            continue;
        }
        let class = css_class(*method);
        let (low, high) = (x_position(x - spread), x_position(x + spread));
        let _ = write!(
            svg,
            r#"<line class="spread {class}" x1="{low:.1}" x2="{high:.1}" y1="{y}" y2="{y}"/>"#
        );
        if x.abs() <= SCALE_DEVIATIONS {
            let _ = write!(
                svg,
                r#"<circle class="{class}" cx="{:.1}" cy="{y}" r="2.6"/>"#,
                x_position(x)
            );
        } else {
            let (tip, back) = if x > 0.0 { (CHART_WIDTH, CHART_WIDTH - 7.0) } else { (0.0, 7.0) };
            let _ = write!(
                svg,
                r#"<path class="arrow {class}" d="M{tip} {y}L{back} {:.1}L{back} {:.1}Z"/>"#,
                y - 3.0,
                y + 3.0
            );
        }
    }
    inline_svg(&svg, height)
}

/// Draws the legend mark of a method.
pub(super) fn legend_mark(class: &str) -> Markup {
    html! { svg viewBox="0 0 20 6" width="20" height="6" {
        line.spread.(class) x1="0" x2="20" y1="3" y2="3" {}
        circle.(class) cx="10" cy="3" r="2.6" {}
    } }
}

/// Draws the legend mark of the truth.
pub(super) fn truth_key() -> Markup {
    html! { svg viewBox="0 0 20 14" width="20" height="14" {
        line.truth x1="10" x2="10" y1="0" y2="14" {}
    } }
}

/// Logarithmic scale that contains all singular values.
#[derive(Clone, Copy)]
pub(super) struct Decades {
    first: f64,
    last: f64,
}

impl Decades {
    pub(super) fn from_values(values: impl Iterator<Item = SingularValues>) -> Option<Self> {
        let both = values.flat_map(|values| [values.min, values.max]);
        let logs = both.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        let (low, high) =
            logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (first, last) = (low.floor(), high.ceil());
        (last > first).then_some(Self { first, last })
    }

    fn x_position(self, value: f64) -> f64 {
        ((value.log10() - self.first) / (self.last - self.first) * CHART_WIDTH)
            .clamp(0.0, CHART_WIDTH)
    }

    /// Draws the numbers of the scale.
    pub(super) fn labels(self) -> Markup {
        let mut svg = String::new();
        let step = ((self.last - self.first) / 4.0).ceil().max(1.0);
        let decades = (0_u32..).map(|k| self.first + f64::from(k) * step);
        let decades: Vec<f64> = decades.take_while(|decade| *decade <= self.last).collect();
        for (k, decade) in decades.iter().enumerate() {
            let value = 10_f64.powf(*decade);
            let text = didim::report::html::page::with_real_minus(&significant_digits(value, 1));
            let anchor = match k {
                0 => "start",
                _ if k + 1 == decades.len() => "end",
                _ => "middle",
            };
            let _ = write!(
                svg,
                r#"<text class="tick" x="{:.1}" y="11" text-anchor="{anchor}">{text}</text>"#,
                self.x_position(value)
            );
        }
        inline_svg(&svg, 14.0)
    }

    /// Draws the range from the smallest to the largest singular value.
    pub(super) fn range(self, values: SingularValues, method: Method) -> Markup {
        if !(values.min > 0.0 && values.max.is_finite()) {
            return html! {};
        }
        let (low, high, class) =
            (self.x_position(values.min), self.x_position(values.max), css_class(method));
        let svg = format!(
            "<line class=\"grid\" x1=\"0\" x2=\"{CHART_WIDTH}\" y1=\"7\" y2=\"7\"/><line \
             class=\"range {class}\" x1=\"{low:.1}\" x2=\"{high:.1}\" y1=\"7\" y2=\"7\"/>"
        );
        inline_svg(&svg, 14.0)
    }
}

/// Returns a drawing as inline SVG. The drawing is hidden from screen readers, because the numbers
/// next to it have the same content.
fn inline_svg(svg: &str, height: f64) -> Markup {
    let view = format!("0 0 {CHART_WIDTH} {height}");
    html! {
        svg.inline viewBox=(view) width=(CHART_WIDTH) height=(height) aria-hidden="true" {
            (PreEscaped(svg))
        }
    }
}
