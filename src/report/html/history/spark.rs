//! Rows of all parameters, each with a small curve over time in its band, and its change.

use std::fmt::Write as _;

use maud::{Markup, PreEscaped, html};

use super::super::super::figure::draw_curve;
use super::super::page::with_code;
use super::super::{number_text, percent_text, with_real_minus};
use super::HistoryReport;
use crate::text::to_uncertainty;

/// Width and height of a small curve.
const CURVE_SIZE: (f64, f64) = (180.0, 24.0);
/// Margin at the edges of a small curve, so that the last point is not clipped.
const CURVE_MARGIN: f64 = 3.0;
/// A distance of results above this multiple of the median one is a gap. Convention: one or two
/// missing results are none.
const GAP_FACTOR: f64 = 4.0;

/// Creates a row per parameter. Those with the largest share of their bands come first.
pub(super) fn section(report: &HistoryReport<'_>) -> Markup {
    if report.parameters.is_empty() {
        return html! {};
    }
    let content = html! {
        div.scroll { table.sparks {
            thead { tr {
                th scope="col" { "Parameter" }
                th scope="col" { "Over time" }
                th.number scope="col" { "Last value" }
                th.number scope="col" { "σ (statistical)" }
                th scope="col" { "Unit" }
                th.number scope="col" { "Change" }
                th.number scope="col" { "Share of band" }
            } }
            tbody { @for name in report.by_band() { (row(report, name)) } }
        } }
    };
    let explanation = "Those that use most of their bands first. Each curve has its own scale; the \
                       shade is the band of the baseline. The change is that of the last result \
                       that was compared, relative to the baseline.";
    super::section("Parameters in brief", explanation, &content)
}

fn row(report: &HistoryReport<'_>, name: &str) -> Markup {
    let last = report.history.parameter_points(name).last().copied();
    let change = report.change(name);
    let share = change.as_ref().map_or(f64::NAN, |change| change.band_share());
    let relative = change.map_or(f64::NAN, |change| change.relative_change());
    let sign = if relative > 0.0 { "+" } else { "" };
    html! {
        tr.outside[share > 1.0] {
            th scope="row" {
                (name)
                @if let Some(description) = report.history.description(name) {
                    span.described { (with_code(description)) }
                }
            }
            td { (curve_cell(report, name)) }
            td.number {
                (last.map_or("–".into(), |(_, value, sigma)| {
                    with_real_minus(&to_uncertainty(value, sigma, 7))
                }))
            }
            td.number { (last.map_or("–".into(), |(.., sigma)| number_text(sigma, 2))) }
            td { (report.history.unit(name)) }
            td.number { @if relative.is_finite() { (sign) } (percent_text(relative, 3)) }
            td.number.share { (percent_text(share, 2)) }
        }
    }
}

/// Creates the small curve. It is hidden from screen readers, because the numbers of the row
/// contain the same information.
fn curve_cell(report: &HistoryReport<'_>, name: &str) -> Markup {
    let (width, height) = CURVE_SIZE;
    let view = format!("0 0 {width} {height}");
    html! {
        svg.spark viewBox=(view) width=(width) height=(height) aria-hidden="true" {
            (PreEscaped(draw_sparkline(report, name)))
        }
    }
}

fn draw_sparkline(report: &HistoryReport<'_>, name: &str) -> String {
    let mut svg = String::new();
    let points = report.history.parameter_points(name);
    let (Some(&(first, ..)), Some(&(last, ..))) = (points.first(), points.last()) else {
        return svg;
    };
    let band =
        report.history.baseline_band(name).map(|(middle, half)| [middle - half, middle + half]);
    let ends = points.iter().map(|(_, value, _)| *value).chain(band.into_iter().flatten());
    let (low, high) = ends.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    let span = (high - low).max(1e-9 * high.abs()).max(1e-12);
    let days = (last - first).max(1e-6);
    let x = |at: f64| CURVE_MARGIN + (at - first) / days * (CURVE_SIZE.0 - 2.0 * CURVE_MARGIN);
    let y = |value: f64| CURVE_MARGIN + (high - value) / span * (CURVE_SIZE.1 - 2.0 * CURVE_MARGIN);
    // Writing to a String cannot fail.
    if let Some([bottom, top]) = band {
        let _ = write!(
            svg,
            r#"<rect class="shade" x="0" y="{:.1}" width="{}" height="{:.1}"/>"#,
            y(top),
            CURVE_SIZE.0,
            y(bottom) - y(top)
        );
    }
    // No line bridges a gap.
    let longest = GAP_FACTOR * median_distance(points.iter().map(|(at, ..)| *at));
    for piece in points.chunk_by(|one, next| next.0 - one.0 <= longest) {
        let piece = piece.iter().map(|&(at, value, _)| (x(at), y(value)));
        draw_curve(&mut svg, "line", piece);
    }
    if let Some(&(at, value, _)) = points.last() {
        let (x, y) = (x(at), y(value));
        let _ = write!(svg, r#"<circle class="last" cx="{x:.1}" cy="{y:.1}" r="2.4"/>"#);
    }
    svg
}

/// Returns the median distance of consecutive times that advance; infinity without one.
fn median_distance(times: impl Iterator<Item = f64> + Clone) -> f64 {
    let distances = times.clone().skip(1).zip(times).map(|(b, a)| b - a);
    let mut distances: Vec<f64> = distances.filter(|distance| *distance > 0.0).collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or(f64::INFINITY)
}
