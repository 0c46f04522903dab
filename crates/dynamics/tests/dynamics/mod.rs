//! Robots and their dynamics through the public interface: random arms, and the TX40.
#![allow(clippy::panic, reason = "the same")]
#![allow(clippy::float_cmp, reason = "small whole numbers, which arithmetic must keep exactly")]

pub(crate) mod arms;
mod base_parameters;
mod dual;
mod energy;
mod generic;
mod golden;
mod identities;
mod kernels;
mod metamorphic;
mod plain;
mod robot_file;
mod tx40;
