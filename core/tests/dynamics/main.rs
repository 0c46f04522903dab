//! The dynamics of random arms and of the TX40, through the public interface.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
#![allow(clippy::float_cmp, reason = "small whole numbers, which arithmetic must keep exactly")]

mod arms;
mod base_parameters;
mod identities;
mod tx40;
