//! Arms of one type beside each other: which parameter of which arm leaves its population.
//!
//! What is decided here is pure, as drift is: it takes one result of each arm.

mod member;
mod population;

pub use member::{FEWEST_ARMS, FleetError, Member, MemberParameter, members};
pub use population::{Fleet, FleetParameter, Standing};
