//! What is given: an experiment, and what a person decides about its identification.

pub(crate) mod error;
pub(crate) mod experiment;
mod held_out;
pub(crate) mod method;
pub(crate) mod options;
pub(crate) mod selection;
pub(crate) mod simulation;
