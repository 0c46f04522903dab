//! The cell file: which robot, which bus, which drives, and what to identify when.

mod address;

pub use address::{BusAddress, BusAddressError};
