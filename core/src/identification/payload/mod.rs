//! A load on the last link, from a record of the arm that carries it.

mod equation;
mod error;
mod find;
mod load;

pub use error::PayloadError;
pub use find::payload;
pub use load::{Declared, Load, LoadBody, LoadParameter, Payload, Presence, Uncertain};
