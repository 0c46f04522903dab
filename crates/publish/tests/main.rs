//! The program with Debian's broker and three cabinets.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by panicking, and says what it found"
)]

mod by_hand;
mod plant;
mod publishing;
#[cfg(feature = "tls")]
mod tls;
