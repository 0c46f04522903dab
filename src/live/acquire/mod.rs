//! The bus thread. It turns frames into samples and does nothing else.
//!
//! After its start, the thread allocates no memory per frame; the stream's library allocates and
//! frees 48 bytes per batch. It takes no lock on which another thread could block it, and it logs
//! nothing. The status reads its counts from a shared copy.

mod counters;
mod counts;
mod real_time;
mod recent;
mod run;
mod state;

pub use counters::{Counter, FaultCounters};
pub use counts::{AcquisitionCounts, BusState, FrameTime};
pub use real_time::{Grant, RealTimeGrants};
pub use recent::{RecentCounts, RecentWatch, SampleFlow};
pub use run::{AcquireEnd, AcquireError, AcquireOptions, Acquisition};
pub use state::{
    AcquisitionStatus, FrameLatency, InterfaceProblem, ReceiveBuffer, SharedAcquisition,
};
