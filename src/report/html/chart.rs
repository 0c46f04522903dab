//! The small drawings of a report, as SVG in the page.

use std::fmt::Write as _;

use didim_core::identification::TorqueDelay;
use didim_core::regression::NoiseAutocorrelation;
use maud::{Markup, PreEscaped, html};

use super::super::figure::{BOTTOM, LEFT, PANEL_HEIGHT, PANEL_WIDTH, RIGHT, TOP, ticks};

/// Width and height of a bar in a table.
const BAR: (f64, f64) = (132.0, 14.0);
/// The relative standard deviations at both ends of a bar, as powers of ten: 0.01 % and 100 %.
const DECADES: (i32, i32) = (-4, 0);
/// Two-sided 95 % of a normal distribution.
const NORMAL_95: f64 = 1.96;

/// A drawing of the size of a panel, with what it shows in words.
pub(super) fn panel(label: &str, draw: impl FnOnce(&mut String)) -> Markup {
    let mut svg = String::new();
    draw(&mut svg);
    let view = format!("0 0 {PANEL_WIDTH} {PANEL_HEIGHT}");
    html! {
        svg.panel viewBox=(view) role="img" aria-label=(label) { (PreEscaped(svg)) }
    }
}

/// A relative standard deviation on a logarithmic scale; a mark shows the classical one.
pub(super) fn uncertainty(corrected: f64, classical: f64) -> Markup {
    let place = |share: f64| {
        let (low, high) = (f64::from(DECADES.0), f64::from(DECADES.1));
        let place = (share.log10() - low) / (high - low) * BAR.0;
        // Nothing for what is no number; the bar ends where the scale does.
        if place.is_nan() { 0.0 } else { place.clamp(0.0, BAR.0) }
    };
    let mut svg = String::new();
    for decade in DECADES.0..=DECADES.1 {
        let x = place(10_f64.powi(decade));
        let _ =
            write!(svg, r#"<line class="grid" x1="{x:.1}" x2="{x:.1}" y1="0" y2="{}"/>"#, BAR.1);
    }
    let (width, mark) = (place(corrected), place(classical));
    let _ = write!(
        svg,
        r#"<rect class="bar" x="0" y="4" width="{width:.1}" height="{:.1}"/><line class="mark" x1="{mark:.1}" x2="{mark:.1}" y1="2" y2="{:.1}"/>"#,
        BAR.1 - 8.0,
        BAR.1 - 2.0
    );
    bar(&svg)
}

/// The scale of [`uncertainty`].
pub(super) fn uncertainty_scale() -> Markup {
    html! { span.scale { @for label in ["0.01", "0.1", "1", "10", "100 %"] { span { (label) } } } }
}

/// A torque delay with two standard deviations to either side; `reach` \[s\] is half the scale.
pub(super) fn delay(delay: TorqueDelay, reach: f64) -> Markup {
    let place = |seconds: f64| ((seconds / reach + 1.0) / 2.0 * BAR.0).clamp(0.0, BAR.0);
    let (middle, spread) = (delay.delay_s, 2.0 * delay.standard_deviation_s);
    let mut svg = String::new();
    if (middle + spread).is_finite() {
        let _ = write!(
            svg,
            r#"<line class="axis" x1="{0:.1}" x2="{0:.1}" y1="0" y2="{1}"/><line class="spread" x1="{2:.1}" x2="{3:.1}" y1="{4}" y2="{4}"/><circle class="point" cx="{5:.1}" cy="{4}" r="3.5"/>"#,
            place(0.0),
            BAR.1,
            place(middle - spread),
            place(middle + spread),
            BAR.1 / 2.0,
            place(middle)
        );
    }
    bar(&svg)
}

/// The numbers beside a bar say the same: it is for the eye only.
fn bar(svg: &str) -> Markup {
    let (width, height) = BAR;
    let view = format!("0 0 {width} {height}");
    html! {
        svg.inline viewBox=(view) width=(width) height=(height) aria-hidden="true" {
            (PreEscaped(svg))
        }
    }
}

/// Draws autocorrelations from lag 1 as stems over the band where white noise has 95 % of its own,
/// between `low` and `high`.
pub(super) fn draw_autocorrelation(
    svg: &mut String,
    title: &str,
    found: &[f64],
    expected: &[NoiseAutocorrelation],
    (low, high): (f64, f64),
) {
    let (wide, tall) = (PANEL_WIDTH - LEFT - RIGHT, PANEL_HEIGHT - TOP - BOTTOM);
    let count = found.len().min(expected.len());
    #[expect(clippy::cast_precision_loss, reason = "a few dozen lags")]
    let x = |lag: usize| LEFT + lag as f64 / (count.max(1) as f64 + 0.5) * wide;
    let y = |value: f64| TOP + (high - value) / (high - low) * tall;
    let _ = write!(svg, r#"<text class="title" x="{LEFT}" y="20">{title}</text>"#);
    for tick in ticks(low, high, 4) {
        let _ = write!(
            svg,
            r#"<line class="grid" x1="{LEFT}" x2="{}" y1="{at:.1}" y2="{at:.1}"/><text class="tick" x="{}" y="{:.1}" text-anchor="end">{tick}</text>"#,
            LEFT + wide,
            LEFT - 5.0,
            y(tick) + 3.5,
            at = y(tick)
        );
    }
    let lags: Vec<(usize, f64, &NoiseAutocorrelation)> = (found.iter().zip(expected).zip(1..))
        .filter(|((found, _), _)| found.is_finite())
        .map(|((found, noise), lag)| (lag, *found, noise))
        .collect();
    let edge = |sign: f64| {
        lags.iter().map(move |(lag, _, noise)| {
            format!("{:.1} {:.1}", x(*lag), y(noise.mean + sign * NORMAL_95 * noise.deviation))
        })
    };
    let outline: Vec<String> = edge(1.0).chain(edge(-1.0).rev()).collect();
    let _ = write!(svg, r#"<polygon class="band" points="{}"/>"#, outline.join(" "));
    let _ = write!(
        svg,
        r#"<line class="axis" x1="{LEFT}" x2="{}" y1="{1:.1}" y2="{1:.1}"/>"#,
        LEFT + wide,
        y(0.0)
    );
    for (lag, value, _) in lags {
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
                TOP + tall + 16.0
            );
        }
    }
}

/// The extremes of all autocorrelations and all bands, with zero between them.
pub(super) fn autocorrelation_range(
    found: &[Vec<f64>],
    expected: &[NoiseAutocorrelation],
) -> (f64, f64) {
    let band = expected.iter().flat_map(|noise| {
        [-NORMAL_95, NORMAL_95].map(|sigmas| noise.mean + sigmas * noise.deviation)
    });
    let values = found.iter().flatten().copied().chain(band).filter(|value| value.is_finite());
    values.fold((-0.1, 0.1), |(low, high), value| (value.min(low), value.max(high)))
}
