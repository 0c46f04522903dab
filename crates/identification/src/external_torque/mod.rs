//! External torque of each joint, sample by sample: the torque that neither the drives nor the
//! model of the arm explain.
//!
//! The momentum observer (De Luca and Mattone, *Sensorless robot collision detection and hybrid
//! force/motion control*, 2005) needs no acceleration. With the momentum p = M(q) q̇, the drive
//! torque τ and h = C q̇ + g + friction − Ṁ q̇, the torque from outside is τ_ext = ṗ + h − τ. Its
//! estimate is a first-order low-pass of this with the bandwidth K \[1/s\]:
//!
//! ```text
//! r = K (p − LP[p]) + LP[h − τ]
//! ```
//!
//! The speed is the difference of two positions half a time constant apart, and the torque is the
//! mean over the same time: one count of the encoder would otherwise be a large momentum.
//!
//! All of it is linear in the parameters φ. The observer filters the regressor and multiplies by φ
//! afterwards: r = Y_r φ − LP[τ]. Y_r also gives the standard deviation by parameters, and a new
//! result takes effect without a transient.
//!
//! Positive is a torque of the environment in the positive direction of the joint.

mod columns;
mod delay;
mod error;
mod low_pass;
mod mean;
mod observer;
mod parameters;
mod position_noise;
mod uncertainty;

pub use error::ObserverError;
pub use observer::{
    ExternalTorque, ExternalTorqueObserver, ObserverOptions, ObserverSignals, ObserverState,
};
