//! Comparison of arms of one type. It finds the parameters of an arm that are outside the scatter
//! of all arms.
//!
//! The decisions of this module are pure functions, like those of drift. Their input is one result
//! per arm.

mod limits;
mod member;
mod population;

pub use limits::FleetLimits;
pub use member::{FleetError, Member, MemberParameter, read_members};
pub use population::{ArmDeviation, Fleet, FleetParameter};
