//! The service: from frames on a drive bus to identified parameters.

pub mod acquire;
pub mod cell;
pub mod check;
pub mod cli;
pub mod compare;
pub mod drift;
pub mod experiment;
pub mod files;
pub mod identify;
pub mod latency;
pub mod metrics;
pub mod pipeline;
pub mod recording;
pub mod reload;
pub mod report;
pub mod service;
pub mod signals;
pub mod status;
pub mod store;
pub mod stream;
pub mod study;
mod top;
pub mod worker;
