//! Reads a recording from a file, in the format that its name, its content and the cell show.

use std::path::{Path, PathBuf};

use didim_drivers::ethercat::Capture;
use didim_drivers::source::{BlfSource, InterfaceName, TextLog};
use didim_formats::{
    BagError, Record, TableColumns, TableError, foreign_container, is_gzip, is_parquet, is_sqlite,
    own_side, read_bag, read_table,
};

use super::bus_log::{LogError, read_log};
use crate::cell::{Cell, SignalSource};
use crate::live::recording::is_mcap;

/// Error when a recording cannot be read. The inner errors name the file.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// A ROS 2 bag cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// The file is a container of another kind.
    #[error("{}: {container}", file.display())]
    Container {
        /// The file.
        file: PathBuf,
        /// Its kind, and the tool that converts it.
        container: String,
    },
    /// A table cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A rate was given for a log, which has the rate of the cell's layout.
    #[error("--sample-rate is for tables only; a log has the sample rate of the cell's layout")]
    RateOfLog,
}

/// Returns the format of a file, as [`read_recording`] reads it. The name of the copy of a stream
/// does not show its format.
pub fn recording_source(path: &Path, is_stream: bool, cell: &Cell) -> SignalSource {
    let is =
        |extension: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension));
    let is_mcap_bag = is("mcap") || (is_stream && is_mcap(path));
    let is_bag = path.is_dir() || is_mcap_bag || is("db3") || is_sqlite(path);
    if cell.bag.is_some() && is_bag {
        return SignalSource::Bag;
    }
    // Without a bus a file can only be a table, unless it has the format of a bus log.
    let has_bus = cell.bus().is_ok();
    let is_text = is("csv") || path.to_string_lossy().to_lowercase().ends_with(".csv.gz");
    let is_table = is_text || is_parquet(path);
    let is_log_by_content = || {
        let is_binary = is_mcap(path) || Capture::is_one(path) || BlfSource::is_one(path);
        is_binary || TextLog::is_one(path)
    };
    let is_log = (has_bus && !is_stream) || is_log_by_content();
    if !is_table && is_log {
        return SignalSource::Bus;
    }
    own_side(path, cell.columns.as_ref()).map_or(SignalSource::Table, SignalSource::OwnTable)
}

/// Refuses a log of a bus that is compressed.
///
/// # Errors
/// [`RecordingError::Container`].
pub fn check_compression(log: &Path) -> Result<(), RecordingError> {
    if !is_gzip(log) {
        return Ok(());
    }
    let container =
        format!("this log is compressed by gzip; decompress it: `gunzip -k {}`", log.display());
    Err(RecordingError::Container { file: log.to_path_buf(), container })
}

/// Reads a recording. The first bytes identify its format, not the name. The format of a file is:
///
/// - A name that ends in `.csv` or `.csv.gz`, or a Parquet file: a table.
/// - A folder, an MCAP or SQLite file: a ROS 2 bag, if the cell asks for one.
/// - A log (candump, ASC, TRC, BLF), an MCAP recording or an EtherCAT capture, by its first bytes.
///   With a bus, anything else as well.
/// - Anything else: a table.
///
/// `sample_rate_hz` is the rate of a table without a time column. `interfaces` are those of a log
/// whose frames count; if empty, those of the cell's bus.
///
/// # Errors
/// [`RecordingError`].
pub fn read_recording(
    path: &Path,
    is_stream: bool,
    cell: &Cell,
    (sample_rate_hz, interfaces): (Option<f64>, &[InterfaceName]),
) -> Result<Record, RecordingError> {
    let source = recording_source(path, is_stream, cell);
    if let Some(spec) = cell.bag.as_ref().filter(|_| source == SignalSource::Bag) {
        return Ok(read_bag(path, spec)?);
    }
    if let Some(container) = foreign_container(path) {
        return Err(RecordingError::Container { file: path.to_path_buf(), container });
    }
    let has_bus = cell.bus().is_ok();
    if matches!(source, SignalSource::Table | SignalSource::OwnTable(_)) {
        // A cell without a bus defines the row interval of its tables.
        let rate_hz = sample_rate_hz.or((!has_bus).then(|| cell.sample_rate_hz()));
        let columns =
            TableColumns { configured: cell.columns.as_ref(), own: Some(&cell.own_columns) };
        return Ok(read_table(path, rate_hz, cell.sample_rate_hz(), columns)?);
    }
    if sample_rate_hz.is_some() {
        return Err(RecordingError::RateOfLog);
    }
    check_compression(path)?;
    Ok(read_log(path, cell, interfaces)?)
}
