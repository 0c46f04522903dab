//! The mathematics, from outside.

mod common;

mod closed_loop;
mod corrected_deviation;
mod decimation;
mod didim;
mod dynamics;
mod fence;
mod flexible;
mod identification;
mod output_error;
mod regression;
mod robust;
mod signal;
