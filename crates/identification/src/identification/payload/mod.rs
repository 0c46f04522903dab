//! Load on the last link, from a record of the loaded arm.

mod equation;
mod error;
mod find;
mod in_frame;
mod load;
mod presence;

pub use equation::LoadSums;
pub use error::PayloadError;
pub use find::{KnownArm, Payload, find_payload};
pub use in_frame::{CentreOfMass, LoadInFrame};
pub use load::{Load, LoadBody, LoadParameter, UncertainValue};
pub use presence::{Comparison, DeclaredLoad, MahalanobisDistance, Presence};
