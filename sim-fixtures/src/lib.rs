//! Simulated arm as a virtual device on a CAN bus.
//!
//! Contract: a [`Scenario`] is data and includes its true parameters. A [`VirtualDevice`] converts
//! a scenario to frames, cycle by cycle, without a clock. [`play`] sends the frames to a [`Sink`],
//! in real time or as fast as possible. Only this crate can send: the service only receives and has
//! no sink.

mod device;
mod encoder;
mod excluded_torque;
mod fault;
pub mod fault_injection;
mod motion;
#[cfg(not(target_os = "linux"))]
mod no_socket_can;
mod payload;
mod play;
mod playback;
mod scenario;
mod shipped;
mod sink;
#[cfg(target_os = "linux")]
mod socket_can_sink;
mod streamed;
mod thermal_model;

pub use device::{CYCLE_FRAMES, DeviceError, VirtualDevice};
pub use encoder::{BusCycle, CycleEncoder, CycleError};
pub use excluded_torque::ExcludedTorque;
pub use fault::{Fault, FaultAction};
pub use motion::Motion;
#[cfg(not(target_os = "linux"))]
pub use no_socket_can::SocketCanSink;
pub use payload::{FramedPayload, Payload};
pub use play::{Pace, PlayError, PlaybackResult, play};
pub use playback::{Playback, PlaybackConfig};
pub use scenario::{MAX_MOTION_S, Scenario, ScenarioError};
pub use shipped::{SHIPPED_SCENARIOS, shipped, tx40_paper, tx40_paper_errors, tx40_physical};
pub use sink::{CandumpSink, InProcessSink, Sink, SinkError};
#[cfg(target_os = "linux")]
pub use socket_can_sink::SocketCanSink;
pub use thermal_model::CycleReadings;
