//! Raw frames on disk: a ring of the last hours, and the recordings kept from it.
//!
//! The bus thread passes each frame, with the stamp that the assembler sees, to a queue of fixed
//! size ([`FrameTap`]): no allocation, no lock, no system call. Frames that find it full are
//! counted. A thread of the same process ([`Recorder`]) writes them into a ring of MCAP files on
//! disk. The identifying process extracts the frames of a result, a fault or a capture from these
//! files ([`Archiver`]). It needs only the folder, so it may be another process.
//!
//! Everything is bounded: the queue, the ring including the file being written, the number and size
//! of kept recordings, and the waiting requests. The recorder can never cause the loss of a frame
//! or a result.

mod archive;
mod archive_folder;
mod archiver;
mod curves;
mod extract;
mod input;
mod options;
mod output;
mod recorder;
mod request;
mod ring;
mod status;
mod tap;
mod window;
mod writer;

pub use archiver::{Archiver, ArchiverOptions, ArchiverThread};
pub use curves::JointCurves;
pub use input::{is_mcap, open_log};
pub use options::{RecorderOptions, RecordingOptions, recording_folders};
pub use output::{CreateOutput, Output, create_file};
pub use recorder::Recorder;
pub use request::{ArchiveStatus, CaptureError, SharedArchive, check_capture_name};
pub use ring::{Ring, RingError, Segment};
pub use status::{RecordingState, RecordingStatus, SharedRecording};
pub use tap::{FrameTap, RecordedFrame, frame_queue};
pub use window::RecordedWindow;

#[cfg(test)]
mod tests;
