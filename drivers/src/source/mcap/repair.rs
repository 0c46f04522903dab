//! Repair of a truncated recording, which is written again with a proper end.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use super::error::McapError;
use super::reader::McapSource;
use super::write::{McapWriteError, McapWriter};

/// Result of a repair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repair {
    /// Number of frames in the repaired file.
    pub frames: u64,
    /// True if the file is damaged in addition to its missing end. The repaired file does not
    /// contain the data after the damage.
    pub is_corrupt: bool,
}

/// Reason why a recording could not be repaired.
#[derive(Debug, thiserror::Error)]
pub enum RepairError {
    /// The recording cannot be read at all.
    #[error(transparent)]
    Read(#[from] McapError),
    /// The recording has no description. Another program wrote it, or even its beginning is
    /// missing.
    #[error("{path} has no frames of this program", path = path.display())]
    Foreign {
        /// Path of the recording.
        path: std::path::PathBuf,
    },
    /// The repaired file cannot be written.
    #[error("{path}: {source}", path = path.display())]
    Write {
        /// Path of the repaired file.
        path: std::path::PathBuf,
        /// Error of the write.
        source: McapWriteError,
    },
}

/// Copies every frame of a recording up to the first damage into another file. Closes this file and
/// writes it to the disk.
///
/// # Errors
/// [`RepairError`]. After an error the other file may exist in part.
pub fn repair_recording(path: &Path, repaired: &Path) -> Result<Repair, RepairError> {
    let mut source = McapSource::open(path, &[])?;
    let Some(info) = source.info().cloned() else {
        return Err(RepairError::Foreign { path: path.into() });
    };
    let write = |source| RepairError::Write { path: repaired.into(), source };
    let output = |error| write(McapWriteError::Output(error));
    let file = File::create(repaired).map_err(output)?;
    let mut writer = McapWriter::new(BufWriter::new(file), &info).map_err(write)?;
    let damaged = loop {
        match source.next_frame() {
            Ok(Some(frame)) => {
                let sequence = source.last_sequence().unwrap_or(0);
                writer.write(&frame, sequence).map_err(write)?;
            }
            Ok(None) => break false,
            Err(McapError::Damaged { .. }) => break true,
            Err(error) => return Err(error.into()),
        }
    };
    let frames = writer.frames();
    let file = writer.finish().map_err(write)?;
    let file = file.into_inner().map_err(|error| output(error.into_error()))?;
    file.sync_all().map_err(output)?;
    Ok(Repair { frames, is_corrupt: damaged })
}
