//! The history for people and for scripts: results over time, compared with the baseline.

mod difference;
mod json;
mod long;
mod plot;

pub use difference::{Difference, DifferenceError};
pub use json::HistoryDocument;
pub use long::{identities, long_table};
pub use plot::plot;

use didim_formats::RecordingStart;

use crate::archive::drift::{Entry, JudgedHistory};
use crate::text::{align_table, significant_digits};
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
        format!("{} {:+.1} %", change.parameter, 100.0 * change.relative_change())
    };
    match (entry.alarmed_parameters.split_first(), largest) {
        (Some((first, [])), _) => format!("ALARM {first}"),
        (Some((first, more)), _) => format!("ALARM {first} and {} more", more.len()),
        (None, Some(change)) if change.band_share() > 1.0 => {
            format!("outside: {}", describe(change))
        }
        (None, Some(_)) => "in band".to_owned(),
        (None, None) => "–".to_owned(),
    }
}

/// Formats the results as a table, each followed by its note. If the width is too small for all
/// columns, omits method and error.
pub fn table(history: &JudgedHistory, columns: usize) -> String {
    let table = table_of(history, &[0, 1, 2, 3, 4, 5, 6]);
    let fits = table.lines().all(|line| line.chars().count() <= columns);
    add_notes(history, if fits { table } else { table_of(history, &[0, 1, 2, 4, 6]) })
}

/// Formats the table with some of the columns.
fn table_of(history: &JudgedHistory, chosen: &[usize]) -> String {
    let rows: Vec<Vec<String>> = history
        .entries
        .iter()
        .map(|entry: &Entry| {
            let line = &entry.line;
            let error = line.relative_error.map(|error| format!("{:.2} %", 100.0 * error));
            let row = [
                line.result.to_string(),
                RecordingStart::minute(line.recorded),
                line.time.minute(),
                line.method.clone(),
                if line.applicable { "yes" } else { "NO" }.to_owned(),
                error.unwrap_or_else(|| "–".to_owned()),
                drift_text(history, entry),
            ];
            chosen.iter().map(|column| row[*column].clone()).collect()
        })
        .collect();
    let header = [
        "result",
        "recorded (UTC)",
        "stored (UTC)",
        "method",
        "applicable",
        "relative error",
        "drift",
    ];
    let header: Vec<&str> = chosen.iter().map(|column| header[*column]).collect();
    align_table(&header, &rows)
}

/// Adds the notes to a table.
fn add_notes(history: &JudgedHistory, table: String) -> String {
    // A note is text, so it is left-aligned in the last column. The identified load and the motor
    // temperatures follow it.
    let notes = history.entries.iter().map(|entry| {
        let load = entry.line.load.as_ref().map(|load| format!("load found: {}", load.line()));
        let note = entry.line.note.as_ref().map(Note::line);
        let temperatures = entry.line.readings.temperatures_c().map(|range| {
            let [coolest, hottest] =
                [range.start(), range.end()].map(|c| significant_digits(*c, 3));
            format!("motors at {coolest} to {hottest} °C")
        });
        note.into_iter().chain(load).chain(temperatures).collect::<Vec<_>>().join("; ")
    });
    let notes: Vec<String> = notes.collect();
    if notes.iter().all(String::is_empty) {
        return table;
    }
    let lines = table.lines().zip(std::iter::once("noted".to_owned()).chain(notes));
    lines.map(|(line, note)| format!("{line}  {note}").trim_end().to_owned() + "\n").collect()
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
        text += "every parameter is in its band, or was not outside often enough for an alarm\n";
    }
    text
}

#[cfg(test)]
mod tests;
