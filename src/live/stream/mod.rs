//! The zero-copy buffer between the bus thread and the readers of its samples.
//!
//! There are three iceoryx2 services per cell, all of one user: `samples` (batches of joint
//! samples, each with a notification), `estimates` and `status` (JSON documents; a late reader gets
//! the last one). Names, prefix, root and quality of service are set only in [`options`].
//!
//! The publisher of a live stream never waits for a reader. A full buffer drops its oldest batch,
//! and the reader notices the loss by the batch numbers. The publisher of a [`Pace::Replay`] stream
//! waits until the reader has acknowledged enough batches.

mod document;
mod error;
mod management;
mod message;
mod network;
mod node;
pub mod options;
mod prefault;
mod reader;
mod writer;

pub use document::{DocumentReader, DocumentWriter, Topic};
pub use error::StreamError;
pub use message::{BATCH_SAMPLES, BatchKind, SampleBatch, StreamSample};
pub use network::{PrivateNetwork, RUN_PREFIX, ServiceNetwork};
pub use node::StreamNode;
pub use options::{
    DEFAULT_BUFFER_S, FOLDER_NAME, MAX_DOCUMENT_BYTES, SERVICE_PREFIX, StreamOptions,
};
pub use prefault::SHARED_MEMORY;
pub use reader::{Batch, SampleReader};
pub use writer::{Pace, SampleWriter};
