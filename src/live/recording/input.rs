//! Reading of recorded frames from a file. The format is detected by the content of the file, not
//! by its name.

use std::collections::VecDeque;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Duration;

use didim_drivers::ethercat::Capture;
use didim_drivers::frame::Frame;
use didim_drivers::layout::CompiledLayout;
use didim_drivers::source::mcap::{FileEnd, MAGIC, McapScan};
use didim_drivers::source::{
    BlfSource, CaptureSource, InterfaceName, McapError, McapSource, Received, Source,
    SourceCounters, SourceError, StampClock, TextLog,
};

use super::ring::segments;

/// Returns true if the first bytes of a file are those of an MCAP file.
pub fn is_mcap(path: &Path) -> bool {
    let mut magic = [0; MAGIC.len()];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut magic));
    read.is_ok() && magic == MAGIC
}

/// Opens a log (candump, ASC, TRC, BLF), an MCAP recording, the folder of a ring as one long
/// recording, or an EtherCAT capture. The layout derives the frames of an EtherCAT capture. If
/// `interfaces` is not empty, frames of other interfaces are skipped.
///
/// A recording that was not closed is read up to its last complete chunk, with a warning.
///
/// # Errors
/// [`SourceError`]: it cannot be opened.
pub fn open_log(
    path: &Path,
    layout: Option<&CompiledLayout>,
    interfaces: &[InterfaceName],
) -> Result<Box<dyn Source>, SourceError> {
    if path.is_dir() {
        return Ok(Box::new(RingSource::open(path)?));
    }
    if is_mcap(path) {
        return Ok(Box::new(open_recording(path, interfaces)?));
    }
    if Capture::is_one(path) {
        return Ok(Box::new(CaptureSource::open(path, layout)?));
    }
    if BlfSource::is_one(path) {
        let log = BlfSource::open(path, interfaces)?;
        if log.is_unfinished() {
            tracing::warn!(
                "{}: the log is not finished: its recorder was killed, or the file was cut off; \
                 complete frames are used",
                path.display()
            );
        }
        return Ok(Box::new(log));
    }
    let log = TextLog::open(path, interfaces)?;
    if log.is_truncated() {
        tracing::warn!(
            "{}: the log was cut off in its last line, which is not used",
            path.display()
        );
    }
    if log.adds_stamps() {
        tracing::warn!(
            "{}: the stamps are times since the frame before (`candump -td`), and are added; \
             record with `candump -l` to keep the date",
            path.display()
        );
    }
    Ok(Box::new(log))
}

fn open_recording(path: &Path, interfaces: &[InterfaceName]) -> Result<McapSource, McapError> {
    if let FileEnd::Unfinished { unused_bytes } = McapScan::read(path)?.file_end {
        tracing::warn!(
            "{}: the recording is not finished: its recorder was killed, or is still writing; \
             frames outside of complete chunks are not used ({unused_bytes} bytes)",
            path.display()
        );
    }
    McapSource::open(path, interfaces)
}

/// The files of a ring, read one after the other. Frames that are missing between two files of one
/// run count as dropped.
struct RingSource {
    waiting_files: VecDeque<PathBuf>,
    current: McapSource,
    interfaces: Vec<InterfaceName>,
    /// Counts of the files before the current file.
    previous_counters: SourceCounters,
}

impl RingSource {
    fn open(folder: &Path) -> Result<Self, SourceError> {
        let failed = |source| McapError::Open { path: folder.to_owned(), source };
        let mut waiting: VecDeque<PathBuf> =
            segments(folder).map_err(failed)?.into_iter().map(|segment| segment.path).collect();
        let Some(first) = waiting.pop_front() else {
            let why = "the folder has no recordings; name that of a ring, such as recordings/ring";
            return Err(failed(std::io::Error::other(why)).into());
        };
        let current = open_recording(&first, &[])?;
        let interfaces = current.interfaces().to_vec();
        Ok(Self {
            waiting_files: waiting,
            current,
            interfaces,
            previous_counters: SourceCounters::default(),
        })
    }

    /// Opens the next file. Returns false if there is none.
    fn advance(&mut self) -> Result<bool, McapError> {
        let Some(path) = self.waiting_files.pop_front() else { return Ok(false) };
        let mut next = open_recording(&path, &self.interfaces)?;
        let run = |source: &McapSource| source.info().map(|info| info.recorder_run.clone());
        if run(&next) == run(&self.current) {
            next.continue_from(self.current.last_sequence());
        }
        self.previous_counters = self.counters();
        self.current = next;
        Ok(true)
    }
}

impl Source for RingSource {
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        timeout: Duration,
    ) -> Result<Received, SourceError> {
        loop {
            match self.current.receive(batch, timeout)? {
                Received::End if self.advance()? => {}
                received => return Ok(received),
            }
        }
    }

    fn counters(&self) -> SourceCounters {
        self.previous_counters.sum_with(self.current.counters())
    }

    fn interfaces(&self) -> &[InterfaceName] {
        &self.interfaces
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Own
    }

    fn since_1970_ns(&self) -> i64 {
        self.current.since_1970_ns()
    }
}
