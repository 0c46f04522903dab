//! The simulated arm as a virtual device on a CAN bus.
//!
//! Contract: a [`Scenario`] is data and knows its truth; a [`VirtualDevice`] turns it into frames,
//! cycle by cycle, without a clock; [`play`] sends them to a [`Sink`], in real time or as fast as
//! possible. This crate alone can send: the service listens and has no sink.

pub mod damage;
mod device;
mod encoder;
mod fault;
mod motion;
mod payload;
mod play;
mod playback;
mod scenario;
mod shipped;
mod sink;
mod streamed;
mod warmth;

pub use device::{CYCLE_FRAMES, DeviceError, VirtualDevice};
pub use encoder::{BusCycle, CycleEncoder, CycleError};
pub use fault::{Fault, FaultAction};
pub use motion::Motion;
pub use payload::Payload;
pub use play::{Pace, PlayError, Played, play};
pub use playback::{Playback, PlaybackConfig};
pub use scenario::{Scenario, ScenarioError};
pub use shipped::{SHIPPED, shipped, tx40_paper, tx40_paper_errors, tx40_physical};
pub use sink::{CandumpSink, InProcessSink, Sink, SinkError, SocketCanSink};
pub use warmth::CycleReadings;
