//! A result of recordings, stored in a folder of results as the service stores its own.

use std::path::Path;

use didim_identification::identification::{Estimate, Use};

use super::CliError;
use super::next::NextCommand;
use didim::archive::Results;
use didim::archive::store::{Attachments, Recordings, ResultRecord, Timestamp};
use didim::cell::Cell;
use didim::report::html::InputFile;

/// Outcome of storing a result.
pub(super) struct StoredResult {
    /// Line that says where the result is.
    pub(super) message: String,
    /// The command to run next.
    pub(super) next: NextCommand,
}

/// Stores the result of recordings in a folder, unless it is stored there already. The time of the
/// result is that of the last recording, or else that of its file.
///
/// # Errors
/// The folder cannot be written, or a file has no date.
pub(super) fn store_result(
    folder: &Path,
    cell: &Cell,
    estimate: &Estimate,
    (files, recordings): (&[InputFile], &Recordings<'_>),
) -> Result<StoredResult, CliError> {
    let options = cell.result_options();
    let mut results = Results::open(folder, cell.service.keep_results, options.drift)
        .map_err(CliError::from_failure)?;
    results.poll_baseline();
    let record = ResultRecord::from_recordings(
        &cell.name,
        &cell.configuration_sha256,
        recordings,
        estimate.clone(),
    );
    let written = files.iter().filter_map(|file| file.written).max();
    let time = recordings.recorded.map(Timestamp::from).or(written).unwrap_or_else(Timestamp::now);
    let shown = folder.display();
    let message = match results.find_equal(&record) {
        Some(number) => format!("{shown}: already stored as result {number}\n"),
        None => {
            let attachments =
                Attachments { regrouping: options.regrouping.clone(), ..Attachments::default() };
            let stored = results
                .store_result(&record, &attachments, &options, time)
                .map_err(CliError::from_failure)?;
            format!("{shown}: stored as result {} of {time}\n", stored.number)
        }
    };
    let is_usable = estimate.verdict.uses.get(Use::Monitoring).applicable == Some(true);
    let subcommand = match results.baseline() {
        None if is_usable => "baseline set",
        _ => "history",
    };
    Ok(StoredResult { message, next: NextCommand::new(subcommand).with_option("--state", folder) })
}
