//! The file of the days: one row for the results of a day, appended once.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use super::line::HistoryLine;
use super::scan::scan;
use crate::archive::store::error::{StoreError, io_error, write};
use crate::files::with_disk;

pub(super) const FILE_NAME: &str = "history-days.jsonl";
/// Number of days that rows are kept for. Ten years, and a year until they are removed.
const MAX_DAYS: u64 = 11 * 366;
/// Number of days that stay when older ones are removed.
const KEPT_DAYS: u64 = 10 * 366;

/// The file, opened by its only writer.
#[derive(Debug)]
pub(super) struct DaysFile {
    path: PathBuf,
    /// Day of the oldest row.
    first_day: Option<u64>,
    /// Number of the last segment with rows.
    pub(super) last_segment: Option<u64>,
}

/// Opens the file for reading. `None` if it does not exist.
pub(super) fn open_days(folder: &Path) -> io::Result<Option<File>> {
    match File::open(folder.join(FILE_NAME)) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(None),
        opened => opened.map(Some),
    }
}

impl DaysFile {
    /// Opens the file of a folder. Removes an incomplete last row, and the rows of a segment that
    /// still exists: a killed process has not replaced it completely.
    pub(super) fn open(folder: &Path, existing_segment: Option<u64>) -> Result<Self, StoreError> {
        let path = folder.join(FILE_NAME);
        let mut days = Self { path, first_day: None, last_segment: None };
        let Some(file) = open_days(folder).map_err(io_error("read", &days.path))? else {
            return Ok(days);
        };
        let is_whole = |line: &HistoryLine| {
            existing_segment
                .is_none_or(|exists| line.day.as_ref().map(|day| day.segment) < Some(exists))
        };
        let mut is_cut = false;
        let scanned = scan(file, |_, line| match line {
            Some(line) if is_whole(&line) => {
                days.last_segment = line.day.as_ref().map(|day| day.segment).or(days.last_segment);
                days.first_day = days.first_day.or(Some(line.time.day()));
            }
            Some(_) => is_cut = true,
            None => {}
        });
        let scanned = scanned.map_err(io_error("read", &days.path))?;
        if is_cut || scanned.complete_bytes < scanned.length {
            days.rewrite(is_whole)?;
        }
        Ok(days)
    }

    /// Appends rows and syncs them. Removes rows of more than ten years ago from time to time.
    pub(super) fn append(&mut self, rows: &[HistoryLine]) -> Result<(), StoreError> {
        let mut text = Vec::new();
        for row in rows {
            serde_json::to_writer(&mut text, row)?;
            text.push(b'\n');
        }
        let is_new = !self.path.exists();
        let file = with_disk(|disk| disk.append(&self.path));
        let written = file.and_then(|mut file| {
            file.write_all(&text)?;
            file.sync()
        });
        written.map_err(io_error("append to", &self.path))?;
        if is_new && let Some(folder) = self.path.parent() {
            let synced = with_disk(|disk| disk.sync_folder(folder));
            synced.map_err(io_error("sync", folder))?;
        }
        let Some(newest) = rows.last() else { return Ok(()) };
        self.last_segment = newest.day.as_ref().map(|day| day.segment).or(self.last_segment);
        let first = *self.first_day.get_or_insert(rows[0].time.day());
        if newest.time.day().saturating_sub(first) > MAX_DAYS {
            let oldest = newest.time.day() - KEPT_DAYS;
            self.first_day = Some(oldest);
            self.rewrite(|line| line.time.day() >= oldest)?;
        }
        Ok(())
    }

    /// Replaces the file by one with only some of its rows.
    fn rewrite(&mut self, is_kept: impl Fn(&HistoryLine) -> bool) -> Result<(), StoreError> {
        let file = File::open(&self.path).map_err(io_error("read", &self.path))?;
        let mut remaining = Vec::new();
        let scanned = scan(file, |text, line| {
            // Rows of a later version are copied unchanged.
            if line.is_none_or(|line| is_kept(&line)) {
                remaining.extend_from_slice(text);
            }
        });
        scanned.map_err(io_error("read", &self.path))?;
        write(&self.path, &remaining)
    }
}
