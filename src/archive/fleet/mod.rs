//! Comparison of arms of one type: which parameter of which arm leaves its population.
//!
//! The decisions here are pure, like those of drift: the input is one result of each arm.

mod limits;
mod member;
mod population;

pub use limits::FleetLimits;
pub use member::{FleetError, Member, MemberParameter, read_members};
pub use population::{ArmDeviation, Fleet, FleetParameter};
