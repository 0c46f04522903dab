//! Sections of the screen: bus, losses, latencies, windows, the last estimate and its baseline.

use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::looks::{TextStyles, wrap_lines};
use didim::live::acquire::AcquisitionStatus;
use didim::live::worker::{EstimationStatus, WindowState};
use didim::service::status::Snapshot;
use didim::service::status::render::{Kind, Row, quantile_text, rows, without_control_characters};

/// Width of the column of names \[characters\].
const NAME_WIDTH: u16 = 10;

pub(super) fn lines(snapshot: &Snapshot, looks: TextStyles, width: u16) -> Vec<Line<'static>> {
    let mut section = Section::new(looks, width);
    match &snapshot.acquisition {
        Some(status) => add_bus(&mut section, status),
        None => section.add("bus", "its process does not answer", looks.bad_style()),
    }
    let rows = rows(snapshot);
    add_losses(&mut section, &rows);
    add_latencies(&mut section, snapshot);
    add_recording(&mut section, &rows);
    match &snapshot.estimation {
        Some(status) => add_estimation(&mut section, status, snapshot.stream.sample_rate_hz),
        None => section.add("estimation", "its process does not answer", looks.bad_style()),
    }
    section.lines
}

/// Lines with a name and its values.
pub(super) struct Section {
    pub(super) lines: Vec<Line<'static>>,
    looks: TextStyles,
    width: u16,
}

impl Section {
    pub(super) fn new(looks: TextStyles, width: u16) -> Self {
        Self { lines: Vec::new(), looks, width }
    }

    fn add(&mut self, name: &str, value: &str, style: Style) {
        let width = self.width.saturating_sub(NAME_WIDTH + 1);
        let name = format!("{name:0$} ", usize::from(NAME_WIDTH));
        let indent = " ".repeat(name.chars().count());
        for (k, line) in
            wrap_lines("", &without_control_characters(value), style, width).into_iter().enumerate()
        {
            let lead = if k == 0 { name.clone() } else { indent.clone() };
            let mut spans = vec![Span::styled(lead, self.looks.name())];
            spans.push(Span::styled(line.to_string(), style));
            self.lines.push(Line::from(spans));
        }
    }

    pub(super) fn add_row(&mut self, name: &str, value: &str) {
        self.add(name, value, Style::new());
    }
}

fn add_bus(section: &mut Section, status: &AcquisitionStatus) {
    let looks = section.looks;
    let style = if status.bus.is_well() { looks.good_style() } else { looks.bad_style() };
    section.add("bus", status.bus.label(), style);
    section
        .add_row("frames", &format!("{:.0}/s, {} in all", status.frames_per_second, status.frames));
    section.add_row(
        "samples",
        &format!("{:.0}/s, {} in all", status.samples_per_second, status.samples),
    );
    for (name, text) in status.readings.lines() {
        let label = name.rsplit(' ').next().unwrap_or(name);
        section.add_row(label, &text);
    }
}

fn add_losses(section: &mut Section, rows: &[Row]) {
    let counted = rows.iter().filter_map(|row| match row.kind {
        Kind::Count => Some(format!("{} {}", row.value, row.name)),
        Kind::Cause => Some(format!("{}: {}", row.name, row.value)),
        Kind::Plain | Kind::Good | Kind::Bad => None,
    });
    let counted: Vec<String> = counted.collect();
    if counted.is_empty() {
        section.add("losses", "none", section.looks.good_style());
    } else {
        section.add_row("losses", &counted.join(" · "));
    }
}

/// Adds the recordings, worded as in the status. Their losses are listed with the other losses.
fn add_recording(section: &mut Section, rows: &[Row]) {
    const SECTION_NAME: &str = "recording";
    for row in rows.iter().filter(|row| row.name.starts_with(SECTION_NAME)) {
        let style = match row.kind {
            Kind::Count | Kind::Cause => continue,
            Kind::Bad => section.looks.bad_style(),
            Kind::Good => section.looks.good_style(),
            Kind::Plain => Style::new(),
        };
        let value = match row.name {
            SECTION_NAME => row.value.clone(),
            name => format!("{name}: {}", row.value),
        };
        section.add(SECTION_NAME, &value, style);
    }
}

fn add_latencies(section: &mut Section, snapshot: &Snapshot) {
    let buffered = snapshot.acquisition.as_ref().and_then(|status| status.frame_to_buffer);
    let taken = snapshot.estimation.as_ref().and_then(|status| status.buffer_to_worker);
    if let Some(latency) = buffered {
        section.add_row("to buffer", &quantile_text(latency.times));
    }
    if let Some(times) = taken {
        section.add_row("to worker", &quantile_text(times));
    }
}

fn add_estimation(section: &mut Section, status: &EstimationStatus, sample_rate_hz: f64) {
    let window = match status.window {
        WindowState::Idle => "none open".to_owned(),
        #[expect(clippy::cast_precision_loss, reason = "tenths of seconds for people")]
        WindowState::Open { samples } => {
            format!("open for {:.1} s, {samples} samples", samples as f64 / sample_rate_hz)
        }
    };
    section.add_row(
        "window",
        &format!(
            "{window}; {} opened, {} identified, {} pending",
            status.windows_opened, status.windows_identified, status.windows_pending
        ),
    );
    if let Some(note) = &status.note {
        section.add_row("noted", &note.line());
    }
    if let Some(line) = status.load.as_ref().and_then(|load| load.lines().into_iter().next()) {
        section.add_row("load", &line);
    }
    let Some(estimate) = &status.last_estimate else {
        section.add_row("estimate", "none yet");
        return;
    };
    let error = estimate
        .relative_error
        .map_or_else(|| "unknown".to_owned(), |error| format!("{:.2} %", 100.0 * error));
    let (verdict, style) = if estimate.applicable {
        ("applicable", Style::new())
    } else {
        ("NOT applicable", section.looks.bad_style())
    };
    section.add(
        "estimate",
        &format!("{verdict}, window {}, {}, error {error}", estimate.window, estimate.method),
        style,
    );
    match &status.drift {
        None => section.add_row("baseline", "none; `didim baseline set` sets one"),
        Some(drift) => {
            let which = format!("result {} of {}", drift.baseline, drift.time.minute());
            match (&drift.why_not, drift.alarms.len()) {
                (Some(why), _) => {
                    let text = format!("{which}; not compared: {why}");
                    section.add_row("baseline", &text);
                }
                (None, 0) => {
                    let text = format!("{which}; every parameter in its band");
                    section.add_row("baseline", &text);
                }
                (None, rest) => {
                    let (noun, verb) = if rest == 1 { ("", "has") } else { ("s", "have") };
                    let text = format!("{which}; {rest} parameter{noun} {verb} left the band");
                    section.add("baseline", &text, section.looks.bad_style());
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
        let looks = TextStyles { has_colour: false };
        let mut section = Section::new(looks, 80);
        add_recording(&mut section, &rows);
        add_losses(&mut section, &rows);
        let lines: Vec<String> = section.lines.iter().map(ToString::to_string).collect();
        let expected = [
            "recording  12 of 64 MB",
            "recording  recordings kept: 3, 1.5 MB",
            "losses     2 recording failures",
        ];
        assert_eq!(lines, expected);
    }
}
