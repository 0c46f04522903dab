//! From frames to samples, from outside.

mod common;
mod conformance;

mod assemble;
mod assemble_period;
mod assemble_random;
mod eds;
mod layout;
mod mcap;
mod samples;
mod socketcan;
mod sources;
mod units;
