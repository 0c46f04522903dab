//! The small drawings of a report, as SVG in the page.

use std::fmt::Write as _;

use didim_identification::identification::TorqueDelay;
use didim_identification::regression::NoiseAutocorrelation;
use maud::{Markup, PreEscaped, html};

use super::super::panel::{
    PANEL_HEIGHT, PANEL_WIDTH, PLOT_BOTTOM, PLOT_LEFT, PLOT_RIGHT, PLOT_TOP, ticks,
};
use crate::text::significant_digits;

/// Width and height of a bar in a table.
const BAR_SIZE: (f64, f64) = (132.0, 14.0);
/// Decimal exponent of the longest bar: a relative standard deviation of 100 %.
const LAST_DECADE: i32 = 0;
/// Shortest and longest scale of the bars, in decades.
const DECADE_RANGE: (i32, i32) = (2, 6);
/// Two-sided 95 % limit of a normal distribution.
const NORMAL_95: f64 = 1.96;

/// Creates a drawing with the size of a panel. `label` describes its content in words.
pub fn panel(label: &str, draw: impl FnOnce(&mut String)) -> Markup {
    panel_of_height(PANEL_HEIGHT, label, draw)
}

/// Creates a drawing like [`panel`], with the given height.
pub fn panel_of_height(height: f64, label: &str, draw: impl FnOnce(&mut String)) -> Markup {
    let mut svg = String::new();
    draw(&mut svg);
    let view = format!("0 0 {PANEL_WIDTH} {height}");
    html! {
        svg.panel viewBox=(view) role="img" aria-label=(label) { (PreEscaped(svg)) }
    }
}

/// A logarithmic scale for relative standard deviations, from a power of ten to 100 %.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    first_decade: i32,
}

impl Scale {
    /// Returns the shortest scale that covers all values, within [`DECADE_RANGE`].
    pub(super) fn covering_scale(values: impl Iterator<Item = f64>) -> Self {
        let smallest = values.filter(|value| *value > 0.0).fold(1.0, f64::min).log10().floor();
        let (fewest, most) = DECADE_RANGE;
        let bounds = (f64::from(LAST_DECADE - most), f64::from(LAST_DECADE - fewest));
        #[expect(clippy::cast_possible_truncation, reason = "within the bounds")]
        let first_decade = smallest.clamp(bounds.0, bounds.1) as i32;
        Self { first_decade }
    }

    fn decade_labels(self) -> impl Iterator<Item = (i32, f64)> {
        (self.first_decade..=LAST_DECADE).map(move |k| (k, self.x_position(10_f64.powi(k))))
    }

    /// Returns the horizontal position of a value. A NaN is at zero, and a value beyond the scale
    /// is at its end.
    fn x_position(self, share: f64) -> f64 {
        let (first, last) = (f64::from(self.first_decade), f64::from(LAST_DECADE));
        let place = (share.log10() - first) / (last - first) * BAR_SIZE.0;
        if place.is_nan() { 0.0 } else { place.clamp(0.0, BAR_SIZE.0) }
    }

    /// Draws the labels of the scale.
    pub(super) fn labels(self) -> Markup {
        let mut svg = String::new();
        // A long scale has space only for every second label.
        let every = if LAST_DECADE - self.first_decade > 3 { 2 } else { 1 };
        for (decade, x) in self.decade_labels().filter(|(k, _)| (LAST_DECADE - k) % every == 0) {
            let percent = 100.0 * 10_f64.powi(decade);
            let unit = if decade == LAST_DECADE { " %" } else { "" };
            let _ = write!(
                svg,
                r#"<text class="tick" x="{x:.1}" y="11" text-anchor="middle">{}{unit}</text>"#,
                significant_digits(percent, 1)
            );
        }
        bar(&svg)
    }

    /// Draws a relative standard deviation as a bar. A mark shows the classical standard deviation.
    pub(super) fn bar(self, corrected: f64, classical: f64) -> Markup {
        let mut svg = String::new();
        for (_, x) in self.decade_labels() {
            let _ = write!(
                svg,
                r#"<line class="grid" x1="{x:.1}" x2="{x:.1}" y1="0" y2="{}"/>"#,
                BAR_SIZE.1
            );
        }
        let (length, mark) = (self.x_position(corrected), self.x_position(classical));
        let _ = write!(
            svg,
            "<rect class=\"length\" x=\"0\" y=\"4\" width=\"{length:.1}\" height=\"{:.1}\"/><line \
             class=\"mark\" x1=\"{mark:.1}\" x2=\"{mark:.1}\" y1=\"2\" y2=\"{:.1}\"/>",
            BAR_SIZE.1 - 8.0,
            BAR_SIZE.1 - 2.0
        );
        bar(&svg)
    }
}

/// Returns half of the range of a scale for delays \[s\]. It is a round number above every delay
/// with two standard deviations.
pub(super) fn delay_reach<'a>(delays: impl Iterator<Item = &'a TorqueDelay>) -> f64 {
    let largest = delays
        .map(|delay| delay.delay_s.abs() + 2.0 * delay.standard_deviation_s)
        .filter(|reach| reach.is_finite())
        .fold(1e-9, f64::max);
    let power = 10_f64.powf(largest.log10().floor());
    let round = [1.0, 2.0, 5.0].into_iter().map(|m| m * power).find(|round| *round >= largest);
    round.unwrap_or(10.0 * power)
}

/// Draws the labels of the delay scale.
pub(super) fn delay_labels(reach: f64) -> Markup {
    let reach = significant_digits(1e6 * reach, 1);
    let svg = format!(
        "<text class=\"tick\" x=\"0\" y=\"11\">−{reach}</text><text class=\"tick\" x=\"{}\" \
         y=\"11\" text-anchor=\"middle\">0</text><text class=\"tick\" x=\"{}\" y=\"11\" \
         text-anchor=\"end\">{reach} µs</text>",
        BAR_SIZE.0 / 2.0,
        BAR_SIZE.0
    );
    bar(&svg)
}

/// Draws a torque delay with two standard deviations to either side. `reach` is half of the scale's
/// range \[s\].
pub(super) fn delay(delay: TorqueDelay, reach: f64) -> Markup {
    let place = |seconds: f64| ((seconds / reach + 1.0) / 2.0 * BAR_SIZE.0).clamp(0.0, BAR_SIZE.0);
    let (middle, spread) = (delay.delay_s, 2.0 * delay.standard_deviation_s);
    let mut svg = String::new();
    if (middle + spread).is_finite() {
        let _ = write!(
            svg,
            "<line class=\"axis\" x1=\"{0:.1}\" x2=\"{0:.1}\" y1=\"0\" y2=\"{1}\"/><line \
             class=\"spread\" x1=\"{2:.1}\" x2=\"{3:.1}\" y1=\"{4}\" y2=\"{4}\"/><circle \
             class=\"point\" cx=\"{5:.1}\" cy=\"{4}\" r=\"3.5\"/>",
            place(0.0),
            BAR_SIZE.1,
            place(middle - spread),
            place(middle + spread),
            BAR_SIZE.1 / 2.0,
            place(middle)
        );
    }
    bar(&svg)
}

/// Creates an inline drawing. It is hidden from screen readers, because the numbers next to it
/// contain the same information.
fn bar(svg: &str) -> Markup {
    let (width, height) = BAR_SIZE;
    let view = format!("0 0 {width} {height}");
    html! {
        svg.inline viewBox=(view) width=(width) height=(height) aria-hidden="true" {
            (PreEscaped(svg))
        }
    }
}

/// Draws autocorrelations from lag 1 as stems over the 95 % band of white noise. The axis reaches
/// from `low` to `high`.
pub fn draw_autocorrelation(
    svg: &mut String,
    title: &str,
    found: &[f64],
    expected: &[NoiseAutocorrelation],
    (low, high): (f64, f64),
) {
    let (wide, tall) =
        (PANEL_WIDTH - PLOT_LEFT - PLOT_RIGHT, PANEL_HEIGHT - PLOT_TOP - PLOT_BOTTOM);
    let count = found.len().min(expected.len());
    #[expect(clippy::cast_precision_loss, reason = "a few dozen lags")]
    let x = |lag: usize| PLOT_LEFT + lag as f64 / (count.max(1) as f64 + 0.5) * wide;
    let y = |value: f64| PLOT_TOP + (high - value) / (high - low) * tall;
    let _ = write!(svg, r#"<text class="title" x="{PLOT_LEFT}" y="20">{title}</text>"#);
    for tick in ticks(low, high, 4) {
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{PLOT_LEFT}\" x2=\"{}\" y1=\"{at:.1}\" \
             y2=\"{at:.1}\"/><text class=\"tick\" x=\"{}\" y=\"{:.1}\" \
             text-anchor=\"end\">{tick}</text>",
            PLOT_LEFT + wide,
            PLOT_LEFT - 5.0,
            y(tick) + 3.5,
            at = y(tick)
        );
    }
    let lag_count: Vec<(usize, f64, &NoiseAutocorrelation)> = (found.iter().zip(expected).zip(1..))
        .filter(|((found, _), _)| found.is_finite())
        .map(|((found, noise), lag)| (lag, *found, noise))
        .collect();
    let half_lag = (x(1) - x(0)) / 2.0;
    for (lag, _, noise) in &lag_count {
        let top = y(noise.mean + NORMAL_95 * noise.deviation);
        let bottom = y(noise.mean - NORMAL_95 * noise.deviation);
        // The rectangle is slightly wider, so that there is no gap to its neighbour.
        let _ = write!(
            svg,
            r#"<rect class="band" x="{:.1}" y="{top:.1}" width="{:.1}" height="{:.1}"/>"#,
            x(*lag) - half_lag,
            2.0 * half_lag + 0.1,
            bottom - top
        );
    }
    let _ = write!(
        svg,
        r#"<line class="axis" x1="{PLOT_LEFT}" x2="{}" y1="{1:.1}" y2="{1:.1}"/>"#,
        PLOT_LEFT + wide,
        y(0.0)
    );
    for (lag, value, _) in lag_count {
        let _ = write!(
            svg,
            r#"<line class="stem" x1="{0:.1}" x2="{0:.1}" y1="{1:.1}" y2="{2:.1}"/>"#,
            x(lag),
            y(0.0),
            y(value)
        );
        if lag % 5 == 0 {
            let _ = write!(
                svg,
                r#"<text class="tick" x="{:.1}" y="{:.1}" text-anchor="middle">{lag}</text>"#,
                x(lag),
                PLOT_TOP + tall + 16.0
            );
        }
    }
}

/// Returns the extremes of all autocorrelations and all bands, with zero between them.
pub fn autocorrelation_range(found: &[Vec<f64>], expected: &[NoiseAutocorrelation]) -> (f64, f64) {
    let band = expected.iter().flat_map(|noise| {
        [-NORMAL_95, NORMAL_95].map(|sigmas| noise.mean + sigmas * noise.deviation)
    });
    let values = found.iter().flatten().copied().chain(band).filter(|value| value.is_finite());
    values.fold((-0.1, 0.1), |(low, high), value| (value.min(low), value.max(high)))
}
