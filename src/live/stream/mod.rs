//! The zero-copy buffer between the bus thread and the readers of its samples.
//!
//! There are four iceoryx2 services per cell, all of one user: `samples` (batches of joint samples,
//! each with a notification), `external_torque` (one message per sample, with a notification),
//! `estimates` and `status` (JSON documents; a late reader gets the last one). Names, prefix, root
//! and quality of service are set only in [`options`].
//!
//! The publisher of a live stream never waits for a reader. A full buffer drops its oldest batch,
//! and the reader notices the loss by the batch numbers. The publisher of a [`Pace::Replay`] stream
//! waits until the reader has acknowledged enough batches.

mod error;
mod external_torque;
mod message;
pub mod options;
#[cfg(target_os = "linux")]
mod shared_memory;

pub use error::StreamError;
pub use external_torque::{ExternalTorqueMessage, MESSAGE_BYTES, MessageState};
pub use message::{BATCH_SAMPLES, BatchKind, SampleBatch, StreamSample};
pub use options::{
    DEFAULT_BUFFER_S, FOLDER_NAME, MAX_DOCUMENT_BYTES, SERVICE_PREFIX, StreamOptions,
};
#[cfg(target_os = "linux")]
pub use shared_memory::{
    Batch, DocumentReader, DocumentWriter, ExternalTorqueReader, ExternalTorqueWriter, Pace,
    PrivateNetwork, RUN_PREFIX, SHARED_MEMORY, SampleReader, SampleWriter, ServiceNetwork,
    StreamNode, Topic,
};
