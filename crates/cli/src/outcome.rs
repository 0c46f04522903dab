//! Last result of a log or a simulated arm that was sent through the complete pipeline.

use super::CliError;
use super::notes::print_note;
use super::output::count_with_noun;
use didim::analysis::identify::{LastIdentification, LastWindow};
use didim::live::worker::{EstimationStatus, Rejection};
use didim::service::status::Snapshot;
use didim::service::supervision::{ServiceEnd, ServiceReport};

/// Returns the last identification. Rejected windows are reported on stderr.
///
/// # Errors
/// The pipeline was interrupted, a result was not stored, or no window was identified.
pub(super) fn last_identification(
    report: &ServiceReport,
    last: &LastIdentification,
) -> Result<LastWindow, CliError> {
    let snapshot = &report.snapshot;
    if report.end == ServiceEnd::Signal {
        return Err(CliError::Interrupted(
            "interrupted; the results stored so far are complete".to_owned(),
        ));
    }
    if let Some(status) = &snapshot.estimation {
        if let Some(unstored) = not_stored(status) {
            return Err(CliError::from_failure(unstored));
        }
        if status.windows_identified > 0 {
            report_rejections(status);
        }
    }
    let estimate = snapshot.estimation.as_ref().and_then(|status| status.last_estimate.as_ref());
    estimate
        .and_then(|estimate| last.take(estimate.window))
        .ok_or_else(|| nothing_identified(snapshot))
}

fn not_stored(status: &EstimationStatus) -> Option<String> {
    let count = status.windows_rejected.get("not-stored").filter(|count| **count > 0)?;
    let mut rejections = [&status.first_rejection, &status.last_rejection].into_iter().flatten();
    let not_stored = rejections.find(|of| matches!(of.rejection, Rejection::NotStored { .. }));
    let why = not_stored.map_or_else(
        || "see the log above".to_owned(),
        |rejected| format!("window {}: {}", rejected.number, rejected.rejection),
    );
    let windows = status.windows_identified + count;
    Some(format!("{count} of {} not stored; {why}", count_with_noun(windows, "result")))
}

fn report_rejections(status: &EstimationStatus) {
    let rejected: u64 = status.windows_rejected.values().sum();
    if let Some(first) = &status.first_rejection {
        print_note(&format!(
            "didim: {rejected} of {} rejected; the first, window {}: {}\n",
            count_with_noun(status.windows_opened, "window"),
            first.number,
            first.rejection
        ));
    }
}

/// Creates an error that explains why a stream that has ended gave no result.
fn nothing_identified(snapshot: &Snapshot) -> CliError {
    let samples = snapshot.acquisition.as_ref().map_or(0, |bus| bus.samples);
    let rejection = snapshot.estimation.as_ref().and_then(|e| e.last_rejection.as_ref());
    CliError::from_failure(match rejection {
        Some(rejected) => {
            format!("window {} was not identified: {}", rejected.number, rejected.rejection)
        }
        None if samples == 0 => {
            "no complete sample: do the frames match the cell's layout?".to_owned()
        }
        None => format!("no window in {samples} samples: see [window] in the cell file"),
    })
}
