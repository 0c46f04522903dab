//! The date of a recording.

use didim_formats::RecordingStart;

use crate::archive::store::Timestamp;

/// Formats the date of a recording: by its own stamps, or else that of its file, named as such.
pub fn date_text(recorded: Option<RecordingStart>, written: Option<Timestamp>) -> String {
    match (recorded, written) {
        (None, Some(written)) => {
            format!("without a date; the file was written {} UTC", written.minute())
        }
        _ => RecordingStart::display_text(recorded),
    }
}
