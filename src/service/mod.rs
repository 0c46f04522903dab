//! The running service: its parts, built from a cell, and its supervision, status and metrics.

mod contact_model;
pub mod limits;
pub mod metrics;
pub mod paths;
pub mod pipeline;
pub mod reload;
pub mod status;
pub mod supervision;

#[cfg(test)]
mod machine_faults;
