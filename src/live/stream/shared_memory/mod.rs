//! The stream in shared memory, by iceoryx2.

mod document;
mod external_torque;
mod management;
mod network;
mod node;
mod prefault;
mod reader;
mod writer;

pub use document::{DocumentReader, DocumentWriter, Topic};
pub use external_torque::{ExternalTorqueReader, ExternalTorqueWriter};
pub use network::{PrivateNetwork, RUN_PREFIX, ServiceNetwork};
pub use node::StreamNode;
pub use prefault::SHARED_MEMORY;
pub use reader::{Batch, SampleReader};
pub use writer::{Pace, SampleWriter};
