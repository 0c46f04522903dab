//! The bus thread: frames in, samples out, nothing else.
//!
//! After its start it allocates nothing per frame (per batch, the stream's library takes and gives
//! back 48 bytes), takes no lock that another thread could hold it up with, and logs nothing; what it counts it leaves where the status finds it.

mod counters;
mod counts;
mod real_time;
mod recent;
mod run;
mod state;

pub use counters::{Counter, FaultCounters};
pub use counts::{AcquisitionCounts, BusState, FrameTime};
pub use real_time::{Grant, RealTimeGrants, RealTimeOptions};
pub use recent::{Flow, RecentCounts, RecentWatch};
pub use run::{AcquireEnd, AcquireError, AcquireOptions, Acquisition};
pub use state::{AcquisitionStatus, FrameLatency, ReceiveBuffer, SharedAcquisition};
