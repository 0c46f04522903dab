//! Bus, losses, latencies, windows, the last estimate and its baseline.

use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::looks::{Looks, wrapped};
use didim::live::acquire::AcquisitionStatus;
use didim::live::worker::{EstimationStatus, WindowState};
use didim::service::status::Snapshot;
use didim::service::status::render::{Kind, Row, clean, quantiles, rows};

/// Width of the names.
const NAME_WIDTH: u16 = 10;

pub(super) fn lines(snapshot: &Snapshot, looks: Looks, width: u16) -> Vec<Line<'static>> {
    let mut section = Section::new(looks, width);
    match &snapshot.acquisition {
        Some(status) => bus(&mut section, status),
        None => section.add("bus", "its process does not answer", looks.bad()),
    }
    let rows = rows(snapshot);
    losses(&mut section, &rows);
    latencies(&mut section, snapshot);
    recording(&mut section, &rows);
    match &snapshot.estimation {
        Some(status) => estimation(&mut section, status, snapshot.stream.sample_rate_hz),
        None => section.add("estimation", "its process does not answer", looks.bad()),
    }
    section.lines
}

/// Lines with a name and its values.
pub(super) struct Section {
    pub(super) lines: Vec<Line<'static>>,
    looks: Looks,
    width: u16,
}

impl Section {
    pub(super) fn new(looks: Looks, width: u16) -> Self {
        Self { lines: Vec::new(), looks, width }
    }

    fn add(&mut self, name: &str, value: &str, style: Style) {
        let width = self.width.saturating_sub(NAME_WIDTH + 1);
        let name = format!("{name:0$} ", usize::from(NAME_WIDTH));
        let indent = " ".repeat(name.chars().count());
        for (k, line) in wrapped("", &clean(value), style, width).into_iter().enumerate() {
            let lead = if k == 0 { name.clone() } else { indent.clone() };
            let mut spans = vec![Span::styled(lead, self.looks.name())];
            spans.push(Span::styled(line.to_string(), style));
            self.lines.push(Line::from(spans));
        }
    }

    pub(super) fn plain(&mut self, name: &str, value: &str) {
        self.add(name, value, Style::new());
    }
}

fn bus(section: &mut Section, status: &AcquisitionStatus) {
    let looks = section.looks;
    let style = if status.bus.is_well() { looks.good() } else { looks.bad() };
    section.add("bus", status.bus.label(), style);
    section
        .plain("frames", &format!("{:.0}/s, {} in all", status.frames_per_second, status.frames));
    section.plain(
        "samples",
        &format!("{:.0}/s, {} in all", status.samples_per_second, status.samples),
    );
    for (name, text) in status.readings.lines() {
        let label = name.rsplit(' ').next().unwrap_or(name);
        section.plain(label, &text);
    }
}

fn losses(section: &mut Section, rows: &[Row]) {
    let counted = rows.iter().filter_map(|row| match row.kind {
        Kind::Count => Some(format!("{} {}", row.value, row.name)),
        Kind::Cause => Some(format!("{}: {}", row.name, row.value)),
        Kind::Plain | Kind::Good | Kind::Bad => None,
    });
    let counted: Vec<String> = counted.collect();
    if counted.is_empty() {
        section.add("losses", "none", section.looks.good());
    } else {
        section.plain("losses", &counted.join(" · "));
    }
}

/// Adds the recordings, worded as in the status. Their losses are listed with the other losses.
fn recording(section: &mut Section, rows: &[Row]) {
    const SECTION_NAME: &str = "recording";
    for row in rows.iter().filter(|row| row.name.starts_with(SECTION_NAME)) {
        let style = match row.kind {
            Kind::Count | Kind::Cause => continue,
            Kind::Bad => section.looks.bad(),
            Kind::Good => section.looks.good(),
            Kind::Plain => Style::new(),
        };
        let value = match row.name {
            SECTION_NAME => row.value.clone(),
            name => format!("{name}: {}", row.value),
        };
        section.add(SECTION_NAME, &value, style);
    }
}

fn latencies(section: &mut Section, snapshot: &Snapshot) {
    let buffered = snapshot.acquisition.as_ref().and_then(|status| status.frame_to_buffer);
    let taken = snapshot.estimation.as_ref().and_then(|status| status.buffer_to_worker);
    if let Some(latency) = buffered {
        section.plain("to buffer", &quantiles(latency.times));
    }
    if let Some(times) = taken {
        section.plain("to worker", &quantiles(times));
    }
}

fn estimation(section: &mut Section, status: &EstimationStatus, sample_rate_hz: f64) {
    let window = match status.window {
        WindowState::Idle => "none open".to_owned(),
        #[expect(clippy::cast_precision_loss, reason = "tenths of seconds for people")]
        WindowState::Open { samples } => {
            format!("open for {:.1} s, {samples} samples", samples as f64 / sample_rate_hz)
        }
    };
    section.plain(
        "window",
        &format!(
            "{window}; {} opened, {} identified, {} pending",
            status.windows_opened, status.windows_identified, status.windows_pending
        ),
    );
    if let Some(note) = &status.note {
        section.plain("noted", &note.line());
    }
    if let Some(line) = status.load.as_ref().and_then(|load| load.lines().into_iter().next()) {
        section.plain("load", &line);
    }
    let Some(estimate) = &status.last_estimate else {
        section.plain("estimate", "none yet");
        return;
    };
    let error = estimate
        .relative_error
        .map_or_else(|| "unknown".to_owned(), |error| format!("{:.2} %", 100.0 * error));
    let (verdict, style) = if estimate.applicable {
        ("applicable", Style::new())
    } else {
        ("NOT applicable", section.looks.bad())
    };
    section.add(
        "estimate",
        &format!("{verdict}, window {}, {}, error {error}", estimate.window, estimate.method),
        style,
    );
    match &status.drift {
        None => section.plain("baseline", "none; `didim baseline set` sets one"),
        Some(drift) => {
            let which = format!("result {} of {}", drift.baseline, drift.time.minute());
            match (&drift.why_not, drift.alarms.len()) {
                (Some(why), _) => {
                    let text = format!("{which}; not compared: {why}");
                    section.plain("baseline", &text);
                }
                (None, 0) => {
                    let text = format!("{which}; every parameter in its band");
                    section.plain("baseline", &text);
                }
                (None, rest) => {
                    let (noun, verb) = if rest == 1 { ("", "has") } else { ("s", "have") };
                    let text = format!("{which}; {rest} parameter{noun} {verb} left the band");
                    section.add("baseline", &text, section.looks.bad());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_recorded_has_its_lines_and_its_losses_are_reported_once() {
        let row = |name, value: &str, kind| Row { name, value: value.into(), kind };
        let rows = [
            row("recording", "12 of 64 MB", Kind::Plain),
            row("recordings kept", "3, 1.5 MB", Kind::Plain),
            row("recording failures", "2", Kind::Count),
        ];
        let looks = Looks { colour: false };
        let mut section = Section::new(looks, 80);
        recording(&mut section, &rows);
        losses(&mut section, &rows);
        let lines: Vec<String> = section.lines.iter().map(ToString::to_string).collect();
        let expected = [
            "recording  12 of 64 MB",
            "recording  recordings kept: 3, 1.5 MB",
            "losses     2 recording failures",
        ];
        assert_eq!(lines, expected);
    }
}
