//! Torque gains of drives, from a record of the arm empty and one with a load that is known.

mod equation;
mod error;
mod estimate;
mod find;
mod load;

pub use error::GainsError;
pub use find::{ArmParameter, DriveGain, Gains, Scale, find_gains};
pub use load::KnownLoad;
