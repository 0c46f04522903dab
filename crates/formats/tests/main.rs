//! Files of other tools, held against programs that are not ours.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says what it found"
)]

mod bag;
mod bag_writer;
mod code;
mod collisions;
mod export;
mod meshes;
mod motion;
#[cfg(feature = "parquet")]
mod parquet;
mod urdf;
