//! Joint controllers of the real loop as data, and their execution.
//!
//! Every joint has its own controller (decentralised control, as in an industrial cabinet). It
//! turns the error e = q_r − q and its derivative into a joint torque. The real one is *sampled*:
//! it computes once per period and the torque is held until the next command
//! ([`SampledController`]). The *continuous* one ([`ContinuousController`]) serves for comparison
//! with simulation tools that support no other.

mod config;
mod continuous;
mod error;
mod law;
mod sampled;
mod simulated;
mod timing;
mod variation;

pub use config::{ControlLaw, ControllerConfig, FeedForward, JointController};
pub use continuous::ContinuousController;
pub use error::ControlError;
pub use sampled::SampledController;
pub use simulated::SimulatedController;
pub use timing::ControlTiming;
pub(crate) use timing::split_delay;
pub(crate) use variation::CommandVariation;

/// Commanded motion of the joints at one instant: one entry per joint.
#[derive(Clone, Copy, Debug)]
pub struct Setpoint<'a> {
    /// \[rad\]
    pub position: &'a [f64],
    /// \[rad/s\]
    pub velocity: &'a [f64],
    /// \[rad/s²\]
    pub acceleration: &'a [f64],
}
