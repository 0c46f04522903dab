//! The history for people and for scripts: results over time, compared with the baseline.

mod difference;
mod json;
mod long;
mod plot;

pub use difference::{Difference, DifferenceError};
pub use json::HistoryDocument;
pub use long::{LongHistoryError, LongRows, write_long_table};
pub use plot::plot;

use didim_formats::RecordingStart;

use crate::archive::drift::{Entry, JudgedHistory};
use crate::archive::store::HistoryError;
use crate::text::{ColumnWidths, significant_digits};
use crate::window::Note;

/// Returns the text for the last column of a result.
pub fn drift_text(history: &JudgedHistory, entry: &Entry) -> String {
    if history.is_baseline(&entry.line) {
        return "baseline".to_owned();
    }
    match &entry.comparison {
        None => return "–".to_owned(),
        Some(Err(_)) => return "not compared".to_owned(),
        Some(Ok(_)) => {}
    }
    let largest = entry.largest_change();
    let describe = |change: &crate::archive::drift::Change| {
        let name = history.parameter_and_part(&change.parameter);
        format!("{name} {:+.1} %", 100.0 * change.relative_change())
    };
    match (entry.alarmed_parameters.split_first(), largest) {
        (Some((first, [])), _) => format!("ALARM {}", history.parameter_and_part(first)),
        (Some((first, more)), _) => {
            format!("ALARM {} and {} more", history.parameter_and_part(first), more.len())
        }
        (None, Some(change)) if change.band_share() > 1.0 => {
            format!("outside: {}", describe(change))
        }
        (None, Some(_)) => "in band".to_owned(),
        (None, None) => "–".to_owned(),
    }
}

/// Headers of the table of results.
const HEADER: [&str; 7] =
    ["result", "recorded (UTC)", "stored (UTC)", "method", "applicable", "relative error", "drift"];
/// Columns of a table that is wide enough, and of a narrow one.
const WIDE_COLUMNS: &[usize] = &[0, 1, 2, 3, 4, 5, 6];
const NARROW_COLUMNS: &[usize] = &[0, 1, 2, 4, 6];

/// Formats the results as a table, each followed by its note, and passes it on line by line. If the
/// width is too small for all columns, omits method and error.
///
/// # Errors
/// The history cannot be read again.
pub fn table(
    history: &JudgedHistory,
    columns: usize,
    mut take: impl FnMut(&str),
) -> Result<(), HistoryError> {
    let (mut widths, mut has_notes) = (ColumnWidths::of_header(&HEADER), false);
    history.for_each_entry(|entry| {
        widths.fit(&cells(history, entry));
        has_notes |= !notes(entry).is_empty();
    })?;
    let is_wide = widths.line_length() <= columns;
    let chosen = if is_wide { WIDE_COLUMNS } else { NARROW_COLUMNS };
    let widths = widths.select(chosen);
    let mut write_line = |cells: [&str; HEADER.len()], note: &str| {
        let line = widths.line(chosen.iter().map(|column| cells[*column]));
        match has_notes {
            true => take(
                &(format!("{}  {note}", line.trim_end_matches('\n')).trim_end().to_owned() + "\n"),
            ),
            false => take(&line),
        }
    };
    write_line(HEADER, "noted");
    history.for_each_entry(|entry| {
        write_line(cells(history, entry).each_ref().map(String::as_str), &notes(entry));
    })
}

/// Returns the cells of a result.
fn cells(history: &JudgedHistory, entry: &Entry) -> [String; HEADER.len()] {
    let line = &entry.line;
    let error = line.relative_error.map(|error| format!("{:.2} %", 100.0 * error));
    [
        line.result.to_string(),
        RecordingStart::minute(line.recorded),
        line.time.minute(),
        line.method.clone(),
        if line.applicable { "yes" } else { "NO" }.to_owned(),
        error.unwrap_or_else(|| "–".to_owned()),
        drift_text(history, entry),
    ]
}

/// Returns the text after a row: the note, the identified load and the motor temperatures.
fn notes(entry: &Entry) -> String {
    let load = entry.line.load.as_ref().map(|load| format!("load found: {}", load.line()));
    let note = entry.line.note.as_ref().map(Note::line);
    let temperatures = entry.line.readings.temperatures_c().map(|range| {
        let [coolest, hottest] = [range.start(), range.end()].map(|c| significant_digits(*c, 3));
        format!("motors at {coolest} to {hottest} °C")
    });
    note.into_iter().chain(load).chain(temperatures).collect::<Vec<_>>().join("; ")
}

/// Summarises the baseline, with one sentence per raised alarm.
pub fn summary(history: &JudgedHistory) -> String {
    let undated = history.undated_text().map_or(String::new(), |text| text + "\n");
    let Some(tracker) = &history.tracker else {
        return format!("no baseline is set: `didim baseline set` sets one\n{undated}");
    };
    let status = tracker.status();
    let mut text = format!("baseline: result {} of {}\n{undated}", status.baseline, status.time);
    if let Some(why) = &status.why_not {
        text += &format!("not compared: {why}\n");
    }
    if status.reconfigured {
        text += "the configuration has changed since the baseline\n";
    }
    for alarm in &status.alarms {
        text += &format!("alarm: {}\n", alarm.sentence());
    }
    if status.alarms.is_empty() && status.compared {
        text += &match outside_text(history) {
            Some(outside) => format!("no alarm; {outside}\n"),
            None => "every parameter is in its band\n".to_owned(),
        };
    }
    text
}

/// Lists the parameters that the last compared result has outside their bands, the farthest first.
/// `None` if there is none.
pub(super) fn outside_text(history: &JudgedHistory) -> Option<String> {
    let tracker = history.tracker.as_ref()?;
    let changes = history.parameters().into_iter().filter_map(|name| tracker.last_change(name));
    let mut outside: Vec<_> = changes.filter(|change| change.band_share() > 1.0).collect();
    outside.sort_by(|one, other| other.band_share().total_cmp(&one.band_share()));
    let described = outside.iter().map(|change| {
        let name = &change.parameter;
        let description = history.description(name).map(|of| format!(" ({of})"));
        format!("{name}{}", description.unwrap_or_default())
    });
    let described: Vec<String> = described.collect();
    (!described.is_empty()).then(|| {
        format!(
            "outside its band in the last result, and not often enough for an alarm: {}",
            described.join(", ")
        )
    })
}

#[cfg(test)]
mod tests;
