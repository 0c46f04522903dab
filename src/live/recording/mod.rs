//! Raw frames on disk: a ring of the last hours, and the recordings that are kept from it.
//!
//! The bus thread passes each frame, with the stamp that the assembler gets, to a queue of fixed
//! size ([`FrameTap`]). This needs no allocation, no lock and no system call. Frames that do not
//! fit into the queue are counted. A thread of the same process ([`Recorder`]) writes the frames
//! into a ring of MCAP files on disk. The process that identifies extracts the frames of a result,
//! a fault or a capture from these files ([`Archiver`]). It needs only the folder, and may
//! therefore be another process.
//!
//! All sizes are bounded: the queue, the ring including the file being written, the number and size
//! of kept recordings, and the number of waiting requests. The recorder cannot cause the loss of a
//! frame for the identification, or of a result.

mod archive;
mod archive_folder;
mod archiver;
mod budget;
mod curves;
mod extract;
mod input;
mod interfaces;
mod options;
mod output;
mod recorder;
mod request;
mod ring;
mod status;
mod tap;
mod window;
mod writer;

pub use archive_folder::kept_result;
pub use archiver::{Archiver, ArchiverOptions, ArchiverThread};
pub use budget::{OverBudget, WriteBudget, WriteKind, WriteShares, WriteStatus, share_bytes};
pub use curves::JointCurves;
pub use input::{is_mcap, open_log};
pub use interfaces::{NamedInterfaces, OpenLogError, open_bus_log};
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
