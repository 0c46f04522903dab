//! Conversion of the frames of a drive bus to joint samples.
//!
//! Contract: this crate can only listen. [`source::Source`] has no way to send; the state machines
//! ([`assemble`], [`clock`]) take time as an argument; every frame and every cycle that is not used
//! is counted under a named cause. Only [`socket`] contains unsafe code.

pub mod assemble;
pub mod clock;
pub mod ethercat;
pub mod frame;
pub mod layout;
pub mod samples;
pub mod socket;
pub mod source;
pub mod units;
