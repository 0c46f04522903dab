//! The simulated arm, and what identification makes of it.

mod common;

mod device;
mod didim;
mod model_errors;
mod one_error;
mod output_error;
mod reduction;
mod scenarios;
mod starts;
mod truth;
mod vcan_device;
