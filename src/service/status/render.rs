//! Formats the status for people.

use std::collections::BTreeMap;

use didim_drivers::assemble::label;
use didim_dynamics::robot::is_hidden;

use super::snapshot::Snapshot;
use crate::archive::drift::DriftStatus;
use crate::live::acquire::{AcquisitionStatus, FrameLatency, FrameTime, Grant};
use crate::live::external_torque::{ExternalTorqueStatus, JointTorque};
use crate::live::latency::LatencySummary;
use crate::live::recording::{
    ArchiveStatus, RecordingState, RecordingStatus, WriteStatus, share_bytes,
};
use crate::live::worker::{EstimationStatus, LoadStatus, WindowState};
use crate::text::{significant_digits, to_uncertainty};

/// Use of terminal colour codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// Plain text.
    Never,
    /// Green for good values, red for bad ones (ECMA-48).
    Always,
}

/// Kind of a status line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A value that is neither good nor bad.
    Plain,
    /// Normal value.
    Good,
    /// Abnormal value.
    Bad,
    /// Count of an unwanted event, which the line names.
    Count,
    /// Count of an unwanted event, together with its cause.
    Cause,
}

/// A line of the status.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Name of the line.
    pub name: &'static str,
    /// Value as text.
    pub value: String,
    /// Display style.
    pub kind: Kind,
}

/// Formats the snapshot as aligned lines of a name and a value.
pub fn render(snapshot: &Snapshot, colour: Colour) -> String {
    align_rows(&rows(snapshot), colour)
}

/// Returns the lines before alignment.
pub fn rows(snapshot: &Snapshot) -> Vec<Row> {
    let mut rows = Rows(Vec::new());
    rows.add_plain("cell", format!("{} (didim {})", snapshot.cell, snapshot.version));
    rows.add_plain("up for", duration_text(snapshot.uptime_s));
    if snapshot.health.ok {
        rows.add_judged("health", snapshot.health.label(), true);
    }
    for reason in &snapshot.health.reasons {
        rows.add_judged("health", reason, false);
    }
    rows.add_plain(
        "buffer",
        format!(
            "{} s at {} Hz, {:.1} MB of shared memory",
            snapshot.stream.buffer_s,
            snapshot.stream.sample_rate_hz,
            megabytes(snapshot.stream.shared_memory_bytes)
        ),
    );
    if let Some(acquisition) = &snapshot.acquisition {
        acquisition_rows(&mut rows, acquisition);
    }
    if let Some(estimation) = &snapshot.estimation {
        estimation_rows(&mut rows, estimation);
    }
    rows.0
}

fn external_torque_rows(rows: &mut Rows, status: &ExternalTorqueStatus) {
    let name = "external torque";
    match &status.result {
        None => rows.add_plain(name, "waits for a usable result".to_owned()),
        Some(result) => {
            rows.add_plain(name, format!("of result {result}, {} valid", status.valid));
        }
    }
    for (number, torque) in (1..).zip(&status.joints) {
        let Some(JointTorque { value, standard_deviation }) = torque else { continue };
        let value = to_uncertainty(*value, *standard_deviation, 2);
        let deviation = significant_digits(*standard_deviation, 2);
        rows.add_plain("joint torque", format!("joint {number}: {value} ± {deviation}"));
    }
    if let Some(times) = status.read_to_published {
        rows.add_plain("bus to torque", format!("{}, from when it was read", quantile_text(times)));
    }
    rows.add_count("torque samples skipped", status.skipped);
    rows.add_count("torques not published", status.unpublished);
    rows.add_count("torques lost by clients", status.messages_lost);
}

fn acquisition_rows(rows: &mut Rows, status: &AcquisitionStatus) {
    rows.add_judged("bus", status.bus.label(), status.bus.is_well());
    rows.add_plain("frames", format!("{} ({:.0}/s)", status.frames, status.frames_per_second));
    rows.add_plain("samples", format!("{} ({:.0}/s)", status.samples, status.samples_per_second));
    if let Some(FrameLatency { from, times }) = status.frame_to_buffer {
        let since = match from {
            FrameTime::Stamp => "from its stamp",
            FrameTime::Read => "from when it was read",
        };
        rows.add_plain("frame to buffer", format!("{}, {since}", quantile_text(times)));
    }
    for counter in status.counters.each() {
        rows.add_count(counter.label, counter.count);
    }
    rows.add_causes("frames unused", &status.frames_unused);
    rows.add_causes("cycles lost", &status.cycles_lost);
    status.readings.lines().into_iter().for_each(|(name, text)| rows.add_plain(name, text));
    if let Some(recording) = &status.recording {
        recording_rows(rows, recording);
    }
    if let Some(torque) = &status.external_torque {
        external_torque_rows(rows, torque);
    }
    if let Some(bytes) = status.receive_buffer_bytes {
        rows.add_plain("receive buffer", format!("{:.1} MB", megabytes(bytes)));
    }
    if let Some(grants) = &status.real_time {
        for (name, grant) in [
            ("real-time priority", &grants.priority),
            ("processor", &grants.cpu),
            ("locked memory", &grants.memory),
        ] {
            match grant {
                Grant::NotAsked => {}
                Grant::Granted => rows.add_judged(name, "granted", true),
                Grant::Refused { why } => rows.add_judged(name, why, false),
            }
        }
    }
}

fn estimation_rows(rows: &mut Rows, status: &EstimationStatus) {
    rows.add_latency("buffer to worker", status.buffer_to_worker);
    rows.add_latency("batch to worker", status.batch_to_worker);
    rows.add_count("samples missing", status.samples_missing);
    rows.add_count("batches lost", status.batches_lost);
    rows.add_count("acquisition restarts", status.restarts);
    match status.window {
        WindowState::Idle => rows.add_plain("window", "none open".to_owned()),
        WindowState::Open { samples } => {
            rows.add_plain("window", format!("open, {samples} samples"));
        }
    }
    rows.add_plain(
        "windows",
        format!(
            "{} opened, {} identified, {} pending",
            status.windows_opened, status.windows_identified, status.windows_pending
        ),
    );
    rows.add_count("results not stored yet", status.results_waiting);
    rows.add_count("history not written yet", status.history_lines_waiting);
    written_rows(rows, &status.written);
    if let Some(archive) = &status.kept_recordings {
        archive_rows(rows, archive);
    }
    if let Some(note) = &status.note {
        rows.add_plain("next window's note", note.line());
    }
    rows.add_causes("windows rejected", &status.windows_rejected);
    if let Some(rejected) = &status.last_rejection {
        rows.add_plain(
            "last rejection",
            format!("window {}: {}", rejected.number, rejected.rejection),
        );
    }
    if let Some(estimate) = &status.last_estimate {
        let error = estimate
            .relative_error
            .map_or_else(|| "unknown".to_owned(), |error| format!("{:.2} %", 100.0 * error));
        rows.add_plain(
            "last estimate",
            format!(
                "window {}, {}, {} parameters, relative error {error}",
                estimate.window,
                estimate.method,
                estimate.parameters.len()
            ),
        );
        if let Some(range) = estimate.readings.temperatures_c() {
            let [coolest, hottest] =
                [range.start(), range.end()].map(|c| significant_digits(*c, 3));
            rows.add_plain("last estimate at", format!("{coolest} to {hottest} °C, motors"));
        }
        if estimate.applicable {
            rows.add_judged("verdict", "applicable", true);
        }
        for reason in &estimate.reasons {
            rows.add_judged("verdict", reason, false);
        }
    }
    if let Some(drift) = &status.drift {
        drift_rows(rows, drift);
    }
    for line in status.load.iter().flat_map(LoadStatus::lines) {
        rows.add_plain("load", line);
    }
}

fn recording_rows(rows: &mut Rows, status: &RecordingStatus) {
    let back = status.oldest_s.map(|seconds| format!(", {} back", duration_text(seconds)));
    let size = format!(
        "{:.0} of {:.0} MB{}",
        megabytes(status.ring_bytes),
        megabytes(status.ring_limit_bytes),
        back.unwrap_or_default()
    );
    match status.state {
        RecordingState::Waiting => rows.add_plain("recording", "no frame yet".to_owned()),
        RecordingState::Recording => rows.add_plain("recording", size),
        RecordingState::Ended => rows.add_plain("recording", format!("ended, {size}")),
        RecordingState::Failed => {
            let why = status.why.as_deref().unwrap_or("failed");
            rows.add_judged("recording", why, false);
        }
    }
    rows.add_count("frames unrecorded", status.frames_unrecorded);
    rows.add_count("recording failures", status.write_errors);
    rows.add_count("ring files removed early", status.segments_given_way);
    written_rows(rows, &status.written);
}

/// Adds the data written within 24 hours, and what gave way to the budget.
fn written_rows(rows: &mut Rows, status: &WriteStatus) {
    for (kind, bytes) in &status.day_bytes {
        let share = status.budget_bytes.map_or(String::new(), |budget| {
            format!(" of {:.0} MB", megabytes(share_bytes(budget, *kind)))
        });
        let text = format!("{}, {:.1} MB{share}", kind.label(), megabytes(*bytes));
        rows.add_plain("written in 24 h", text);
    }
    for (kind, count) in &status.given_way {
        let name = "refused by the budget";
        rows.add(name, &format!("{}, {count} times", kind.label()), Kind::Count);
    }
}

fn archive_rows(rows: &mut Rows, status: &ArchiveStatus) {
    let (files, size) = (status.files, megabytes(status.bytes));
    rows.add_plain("recordings kept", format!("{files}, {size:.1} MB"));
    if let Some(name) = &status.capture {
        rows.add_plain("capture", name.clone());
    }
    rows.add_count("recordings waiting", status.waiting);
    rows.add_count("recordings not kept", status.failed);
    if let Some(why) = &status.last_failure {
        rows.add_plain("last not kept", why.clone());
    }
}

fn drift_rows(rows: &mut Rows, drift: &DriftStatus) {
    let DriftStatus { baseline, time, reconfigured, .. } = drift;
    rows.add_plain("baseline", format!("result {baseline} of {time}"));
    match &drift.why_not {
        Some(why) => rows.add_plain("drift", format!("not compared: {why}")),
        None if drift.alarms.is_empty() => {
            rows.add_judged("drift", "every parameter in its band", true)
        }
        None => {}
    }
    if *reconfigured {
        rows.add_plain("drift", "the configuration has changed since the baseline".to_owned());
    }
    for reason in drift.reasons() {
        rows.add_judged("drift", &reason, false);
    }
}

struct Rows(Vec<Row>);

impl Rows {
    fn add_plain(&mut self, name: &'static str, value: String) {
        self.add(name, &value, Kind::Plain);
    }

    fn add(&mut self, name: &'static str, value: &str, kind: Kind) {
        self.0.push(Row { name, value: without_control_characters(value), kind });
    }

    /// Adds a line for a count, unless the count is zero.
    fn add_count(&mut self, name: &'static str, count: u64) {
        if count > 0 {
            self.add(name, &count.to_string(), Kind::Count);
        }
    }

    fn add_latency(&mut self, name: &'static str, latency: Option<LatencySummary>) {
        if let Some(times) = latency {
            self.add_plain(name, quantile_text(times));
        }
    }

    fn add_causes(&mut self, name: &'static str, causes: &BTreeMap<String, u64>) {
        for (cause, count) in causes {
            self.add(name, &format!("{count} {}", label(cause)), Kind::Cause);
        }
    }

    fn add_judged(&mut self, name: &'static str, value: &str, good: bool) {
        self.add(name, value, if good { Kind::Good } else { Kind::Bad });
    }
}

fn align_rows(rows: &[Row], colour: Colour) -> String {
    let width = rows.iter().map(|row| row.name.len()).max().unwrap_or(0);
    let mut before = "";
    let mut text = String::new();
    for Row { name, value, kind } in rows {
        // Consecutive lines with the same name show it only once.
        let shown = if *name == before { "" } else { name };
        let value = match (colour, kind) {
            (Colour::Always, Kind::Good) => format!("\x1b[32m{value}\x1b[0m"),
            (Colour::Always, Kind::Bad) => format!("\x1b[31m{value}\x1b[0m"),
            _ => value.clone(),
        };
        text.push_str(&format!("{shown:width$}  {value}\n"));
        before = name;
    }
    text
}

/// Removes control and format characters, because the text comes from another process.
pub fn without_control_characters(text: &str) -> String {
    text.chars().map(|each| if is_hidden(each) { ' ' } else { each }).collect()
}

#[expect(clippy::cast_precision_loss, reason = "one decimal for people")]
fn megabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e6
}

/// Formats the quantiles of a latency as a line.
pub fn quantile_text(times: LatencySummary) -> String {
    let LatencySummary { count: _, p50_ns, p99_ns, p999_ns, max_ns } = times;
    let [p50, p99, p999, max] = [p50_ns, p99_ns, p999_ns, max_ns].map(time_text);
    format!("p50 {p50}, p99 {p99}, p99.9 {p999}, max {max}")
}

/// Formats a short time with three digits.
#[expect(clippy::cast_precision_loss, reason = "three digits for people")]
fn time_text(ns: u64) -> String {
    let (value, unit) = match ns as f64 {
        ns if ns < 1e6 => (ns / 1e3, "µs"),
        ns if ns < 1e9 => (ns / 1e6, "ms"),
        ns => (ns / 1e9, "s"),
    };
    let decimals = if value < 10.0 {
        2
    } else if value < 100.0 {
        1
    } else {
        0
    };
    format!("{value:.decimals$} {unit}")
}

/// Formats a duration in its two largest units.
pub fn duration_text(seconds: f64) -> String {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cast saturates, and the seconds of an uptime are not negative"
    )]
    let seconds = seconds as u64;
    let (days, hours, minutes) = (seconds / 86_400, seconds / 3600 % 24, seconds / 60 % 60);
    match (days, hours, minutes) {
        (0, 0, 0) => format!("{seconds} s"),
        (0, 0, _) => format!("{minutes} min {} s", seconds % 60),
        (0, _, _) => format!("{hours} h {minutes} min"),
        _ => format!("{days} d {hours} h {minutes} min"),
    }
}

#[cfg(test)]
mod tests;
