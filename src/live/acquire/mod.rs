//! The bus thread: it turns frames into samples and does nothing else.
//!
//! After its start it allocates nothing per frame (per batch, the stream's library takes and gives
//! back 48 bytes). It takes no lock on which another thread could block it, and logs nothing. It
//! leaves its counts where the status reads them.

mod counters;
mod counts;
mod real_time;
mod recent;
mod run;
mod state;

pub use counters::{Counter, FaultCounters};
pub use counts::{AcquisitionCounts, BusState, FrameTime};
pub use real_time::{Grant, RealTimeGrants, RealTimeOptions};
pub use recent::{RecentCounts, RecentWatch, SampleFlow};
pub use run::{AcquireEnd, AcquireError, AcquireOptions, Acquisition};
pub use state::{AcquisitionStatus, FrameLatency, ReceiveBuffer, SharedAcquisition};
