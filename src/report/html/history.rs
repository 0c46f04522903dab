//! The report of a history: parameters outside their bands, every result, and every parameter over
//! time.

mod spark;

use std::fmt::Write as _;

use didim_formats::RecordingStart;
use maud::{Markup, html};

use super::super::history::{drift_text, outside_text};
use super::super::panel::{
    PANEL_HEIGHT, PANEL_WIDTH, PLOT_BOTTOM, PLOT_LEFT, PLOT_RIGHT, PLOT_TOP, ticks,
};
use super::chart::panel;
use super::page::to_sentence;
use super::{document, section, with_real_minus};
use crate::archive::drift::{Change, JudgedHistory, Trend};
use crate::archive::store::Timestamp;
use crate::text::escape;

const OWN_STYLE: &str = include_str!("history.css");

/// Number of standard deviations drawn to either side of a value.
const BAND_DEVIATIONS: f64 = 2.0;
/// Duration of a history below which its axis shows the time of day \[d\].
const DAYS_WITH_TIME: f64 = 3.0;

/// Input of a history report.
#[derive(Clone, Copy, Debug)]
pub struct HistoryReport<'a> {
    /// The history.
    pub history: &'a JudgedHistory,
    /// The parameters to show.
    pub parameters: &'a [&'a str],
}

impl HistoryReport<'_> {
    /// Returns the report as HTML. It does not contain the date of its creation, so that the same
    /// history gives the same bytes.
    pub fn to_html(&self) -> String {
        let robots = self.history.entries.iter().rev().map(|entry| entry.line.robot.as_str());
        let robot = robots.clone().next().unwrap_or("no robot");
        let content = html! {
            header {
                p.kind { "History of dynamic parameters" }
                h1 { (robot) }
                p { (self.extent_text()) }
            }
            main {
                (self.alarm_section())
                (spark::section(self))
                (self.panel_section())
                (self.result_section())
            }
        };
        document(&format!("{robot} · history of dynamic parameters"), OWN_STYLE, &content)
    }

    fn extent_text(&self) -> String {
        let results = match self.history.result_count() {
            0 => return "No result".to_owned(),
            1 => "1 result".to_owned(),
            count => format!("{count} results"),
        };
        match self.history.time_range() {
            Some((first, last)) => {
                format!("{results} from {} to {} (UTC)", first.minute(), last.minute())
            }
            None => results,
        }
    }

    fn alarm_section(&self) -> Markup {
        let Some(tracker) = &self.history.tracker else {
            return html! { section.alarms {
                h2 { "No baseline" }
                p { "Without one nothing is compared: " code { "didim baseline set" } " sets it." }
                @if let Some(text) = self.history.undated_text() { p { (to_sentence(&text)) } }
            } };
        };
        let status = tracker.status();
        let raised = !status.alarms.is_empty();
        let outside = outside_text(self.history).filter(|_| status.compared && !raised);
        let heading = match status.alarms.len() {
            0 if outside.is_some() => "No alarm".to_owned(),
            0 if status.compared => "Every parameter in its band".to_owned(),
            0 => "The last result is not compared".to_owned(),
            1 => "One parameter has left its band".to_owned(),
            count => format!("{count} parameters have left their bands"),
        };
        html! {
            section.alarms.raised[raised] {
                h2 { (heading) }
                p {
                    "The baseline is result " (status.baseline) " of " (status.time.minute())
                    " (UTC)."
                }
                @if let Some(outside) = &outside { p { (to_sentence(outside)) } }
                @if let Some(why) = &status.why_not { p { (to_sentence(why)) } }
                @if let Some(text) = self.history.undated_text() { p { (to_sentence(&text)) } }
                @if status.reconfigured {
                    p { "The configuration has changed since the baseline." }
                }
                @if raised { ul { @for alarm in &status.alarms { li { (alarm.sentence()) "." } } } }
            }
        }
    }

    /// Returns the change of a parameter since the baseline, from the last compared result.
    fn change(&self, name: &str) -> Option<Change> {
        self.history.tracker.as_ref()?.last_change(name)
    }

    /// Returns the parameters. Those with raised alarms come first, then those with the largest
    /// share of their bands.
    fn by_band(&self) -> Vec<&str> {
        let alarms = || self.history.tracker.iter().flat_map(|tracker| tracker.alarms());
        let mut names: Vec<(bool, f64, &str)> = (self.parameters.iter())
            .map(|name| {
                let share = self.change(name).map(|change| change.band_share());
                let share = share.filter(|share| !share.is_nan()).unwrap_or(-1.0);
                (alarms().any(|(own, _)| own == *name), share, *name)
            })
            .collect();
        names.sort_by(|one, other| other.0.cmp(&one.0).then(other.1.total_cmp(&one.1)));
        names.into_iter().map(|(.., name)| name).collect()
    }

    fn panel_section(&self) -> Markup {
        let alarmed: Vec<(&str, Timestamp)> =
            self.history.tracker.iter().flat_map(|tracker| tracker.alarms()).collect();
        let since = |name: &str| alarmed.iter().find(|(own, _)| *own == name).map(|(_, at)| *at);
        let content = html! {
            div.panels { @for name in self.by_band() {
                @let since = since(name);
                figure.alarmed[since.is_some()] {
                    (self.chart(name, since))
                    @let tracker = self.history.tracker.as_ref();
                    @let text = tracker.and_then(|tracker| tracker.sentence(name));
                    @let description = self.history.description(name);
                    @if text.is_some() || description.is_some() {
                        figcaption {
                            @if let Some(of) = description { (to_sentence(of)) " " }
                            @if let Some(text) = text { (text) "." }
                        }
                    }
                }
            } }
        };
        let explanation = "Each result with two standard deviations to either side; results that \
                           are not applicable are left out. The band is that of the baseline, \
                           dashed, as the last result is judged by it; a point outside it is \
                           hollow. The line is the trend of the results that were compared, day by \
                           day. A dotted line marks when a parameter left its band for good.";
        section("Parameters over time", explanation, &content)
    }

    fn chart(&self, name: &str, since: Option<Timestamp>) -> Markup {
        let label = format!("{name} over time, with its uncertainty and the band of the baseline");
        panel(&label, |svg| self.draw_chart(svg, name, since))
    }

    fn draw_chart(&self, svg: &mut String, name: &str, since: Option<Timestamp>) {
        let points = self.history.parameter_points(name);
        let title = match self.history.unit(name) {
            "" => escape(name),
            unit => format!("{} [{}]", escape(name), escape(unit)),
        };
        let _ = write!(svg, r#"<text class="title" x="{PLOT_LEFT}" y="20">{title}</text>"#);
        let (Some(&(first, ..)), Some(&(last, ..)), Some((start, _))) =
            (points.first(), points.last(), self.history.time_range())
        else {
            return;
        };
        let band =
            self.history.baseline_band(name).map(|(middle, half)| (middle - half, middle + half));
        let ends = points.iter().flat_map(|&(_, value, sigma)| {
            [value - spread_length(sigma), value + spread_length(sigma)]
        });
        let ends = ends.chain(band.into_iter().flat_map(|(low, high)| [low, high]));
        let (low, high) = ends.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        let margin = 0.06 * (high - low).max(1e-9 * high.abs()).max(1e-12);
        let (low, high) = (low - margin, high + margin);
        let scale = Scale { first, last, low, high };
        let (wide, tall) = (Scale::PLOT_WIDTH, Scale::PLOT_HEIGHT);
        let (x, y) = (|at| scale.x_pixel(at), |value| scale.y_pixel(value));
        if let Some((bottom, top)) = band {
            let _ = write!(
                svg,
                r#"<rect class="band" x="{PLOT_LEFT}" y="{:.1}" width="{wide}" height="{:.1}"/>"#,
                y(top),
                y(bottom) - y(top)
            );
        }
        draw_ticks(svg, &scale, start);
        if let Some((bottom, top)) = band {
            let middle = y(0.5 * (bottom + top));
            let _ = write!(
                svg,
                "<line class=\"baseline\" x1=\"{PLOT_LEFT}\" x2=\"{}\" y1=\"{middle:.1}\" \
                 y2=\"{middle:.1}\"/>",
                PLOT_LEFT + wide
            );
        }
        // A date before the shown period cannot be drawn. The sentence about the parameter contains
        // it.
        let since =
            since.map(|since| since.days_after(start)).filter(|at| (first..=last).contains(at));
        if let Some(at) = since.map(x) {
            let _ = write!(
                svg,
                r#"<line class="when" x1="{at:.1}" x2="{at:.1}" y1="{PLOT_TOP}" y2="{:.1}"/>"#,
                PLOT_TOP + tall
            );
        }
        draw_points(svg, &scale, &points, band);
        let baseline = self.history.tracker.as_ref().map(|t| t.baseline().result.time);
        let trend = self.history.tracker.as_ref().and_then(|tracker| tracker.trend(name));
        if let (Some(baseline), Some(Trend { slope, span, mean_time, at_mean, .. })) =
            (baseline, trend)
        {
            let offset = baseline.days_after(start);
            let line = |t: f64| (at_mean + slope * (t - mean_time)).clamp(low, high);
            // If the trend began earlier than the shown period, only its part in this period is
            // drawn.
            let (from, to) = (span.0.max(first - offset), span.1.min(last - offset));
            if from > to {
                return;
            }
            let _ = write!(
                svg,
                r#"<line class="trend" x1="{:.1}" x2="{:.1}" y1="{:.1}" y2="{:.1}"/>"#,
                x(from + offset),
                x(to + offset),
                y(line(from)),
                y(line(to))
            );
        }
    }

    fn result_section(&self) -> Markup {
        let entries = self.history.entries.iter().rev();
        let table = html! {
            div.scroll { table.results {
                thead { tr {
                    th.number scope="col" { "Result" }
                    th scope="col" { "Recorded (UTC)" }
                    th scope="col" { "Stored (UTC)" }
                    th scope="col" { "Method" }
                    th scope="col" { "Applicable" }
                    th.number scope="col" { "Relative error" }
                    th scope="col" { "Drift" }
                    th scope="col" { "Noted" }
                } }
                tbody { @for entry in entries {
                    @let line = &entry.line;
                    @let largest = entry.largest_change().map_or(0.0, |change| change.band_share());
                    tr.alarmed[!entry.alarmed_parameters.is_empty()].outside[largest > 1.0] {
                        th.number scope="row" { (line.result) }
                        td { (RecordingStart::minute(line.recorded)) }
                        td { (line.time.minute()) }
                        td { (line.method) }
                        td.refused[!line.applicable] {
                            (if line.applicable { "yes" } else { "no" })
                        }
                        td.number {
                            (line.relative_error.map_or("–".into(), |e| super::percent_text(e, 3)))
                        }
                        td.drift { (drift_text(self.history, entry).replace('-', "−")) }
                        td.note { (line.note.as_ref().map(|note| note.line()).unwrap_or_default()) }
                    }
                } }
            } }
        };
        section("Results", "The newest first. A day of older results is a row.", &table)
    }
}

/// Conversion of times and values to positions in the panel of a chart. Times are in days since the
/// first result.
struct Scale {
    first: f64,
    last: f64,
    low: f64,
    high: f64,
}

impl Scale {
    const PLOT_WIDTH: f64 = PANEL_WIDTH - PLOT_LEFT - PLOT_RIGHT;
    const PLOT_HEIGHT: f64 = PANEL_HEIGHT - PLOT_TOP - PLOT_BOTTOM;

    /// Returns the horizontal position of a time. A margin keeps points at the edge visible.
    fn x_pixel(&self, at: f64) -> f64 {
        let days = (self.last - self.first).max(1e-6);
        PLOT_LEFT + 6.0 + (at - self.first) / days * (Self::PLOT_WIDTH - 12.0)
    }

    fn y_pixel(&self, value: f64) -> f64 {
        PLOT_TOP + (self.high - value) / (self.high - self.low) * Self::PLOT_HEIGHT
    }
}

/// Draws the grid of values and the first, middle and last time.
fn draw_ticks(svg: &mut String, scale: &Scale, start: Timestamp) {
    let Scale { first, last, low, high } = *scale;
    let (wide, tall) = (Scale::PLOT_WIDTH, Scale::PLOT_HEIGHT);
    for tick in ticks(low, high, 4) {
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{PLOT_LEFT}\" x2=\"{}\" y1=\"{at:.1}\" \
                 y2=\"{at:.1}\"/><text class=\"tick\" x=\"{}\" y=\"{:.1}\" \
                 text-anchor=\"end\">{}</text>",
            PLOT_LEFT + wide,
            PLOT_LEFT - 5.0,
            scale.y_pixel(tick) + 3.5,
            with_real_minus(&format!("{tick}")),
            at = scale.y_pixel(tick)
        );
    }
    for (at, anchor) in [(first, "start"), (0.5 * (first + last), "middle"), (last, "end")] {
        let label = start
            .plus_days(at)
            .map(|time| if last - first < DAYS_WITH_TIME { time.minute() } else { time.date() });
        if anchor == "start" || last > first {
            let _ = write!(
                svg,
                r#"<text class="tick" x="{:.1}" y="{:.1}" text-anchor="{anchor}">{}</text>"#,
                if anchor == "start" { PLOT_LEFT } else { scale.x_pixel(at) },
                PLOT_TOP + tall + 16.0,
                label.unwrap_or_default()
            );
        }
    }
}

/// Returns half of the length of a result's error bar. It is 0 without a finite standard deviation.
fn spread_length(sigma: f64) -> f64 {
    if sigma.is_finite() { BAND_DEVIATIONS * sigma } else { 0.0 }
}

/// Draws each result with its error bar. Results outside the band are marked.
fn draw_points(
    svg: &mut String,
    scale: &Scale,
    points: &[(f64, f64, f64)],
    band: Option<(f64, f64)>,
) {
    let (x, y) = (|at| scale.x_pixel(at), |value| scale.y_pixel(value));
    for &(at, value, sigma) in points {
        let _ = write!(
            svg,
            r#"<line class="spread" x1="{0:.1}" x2="{0:.1}" y1="{1:.1}" y2="{2:.1}"/>"#,
            x(at),
            y(value + spread_length(sigma)),
            y(value - spread_length(sigma))
        );
    }
    for &(at, value, _) in points {
        let outside = band.is_some_and(|(bottom, top)| value < bottom || value > top);
        let off = if outside { " off" } else { "" };
        let _ = write!(
            svg,
            r#"<circle class="value{off}" cx="{:.1}" cy="{:.1}" r="2.6"/>"#,
            x(at),
            y(value)
        );
    }
}
