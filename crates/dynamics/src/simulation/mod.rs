//! The closed loop, integrated: an arm, its controller and its reference, with the encoder's
//! quantisation and noise inside the loop.
//!
//! One sample of a sampled loop, at t_k:
//!
//! 1. the motors are at q_motor = R q; the encoders report it with noise, quantised;
//! 2. the controller takes R⁻¹ of that and the reference at t_k and computes the torque command;
//! 3. the command acts from t_k plus the controller's delay and is held for one period, with a
//!    disturbance torque that is constant over the period;
//! 4. q̈ = M(q)⁻¹ (τ − h(q, q̇)), friction included, is integrated to t_{k+1} in fixed steps.
//!
//! [`ClosedLoop::step`] returns what is known at t_k after 1 to 3 and allocates nothing;
//! [`ClosedLoop::run`] records many steps.

mod checked;
mod closed_loop;
mod config;
mod disturbance;
mod error;
mod flexible;
mod hold;
mod hysteresis;
mod integrator;
mod lockstep;
mod measurement;
mod noise;
mod output;
mod plant;
mod reference_point;
mod sensitivity;
mod step;
mod unmodelled;
mod variation;
mod white_noise;

pub use closed_loop::ClosedLoop;
pub use config::{DivergenceLimits, InitialState, SimulationConfig};
pub use error::{SetupError, SimulationError, StateQuantity};
pub use flexible::FlexibleMode;
pub use hysteresis::MaxwellSlip;
pub use integrator::Integrator;
pub use lockstep::Lockstep;
pub use noise::NoiseConfig;
pub use output::set_row;
pub use output::{Record, StepOutput};
pub use unmodelled::{Cogging, Stribeck, Unmodelled};
pub use variation::Sensitivities;
