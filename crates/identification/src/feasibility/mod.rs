//! Physically consistent standard parameters from an estimate of the base parameters.
//!
//! A body exists if and only if its [pseudo-inertia](Body::pseudo_inertia) is positive definite
//! (Wensing, Kim and Slotine, *Linear matrix inequalities for physically consistent inertial
//! parameter identification*, 2018). If no set of bodies explains the base parameters, the model or
//! the data are wrong. If bodies explain them, the base parameters still leave many parameters of
//! the bodies undetermined. A [`Prior`] determines these (Lee, Wensing and Park, *Geometric robot
//! dynamic identification*, 2020). [`fit_consistent`] minimises the sum of both costs and reports
//! the source of every value. [`nearest_body`] does the same for a single body.

mod assumptions;
mod block;
mod body;
mod constraint;
mod drives;
mod error;
mod estimate;
mod finding;
mod judgement;
mod nearest;
mod newton;
mod outcome;
mod posterior;
mod prior;
mod problem;
mod solve;
#[cfg(test)]
mod tests;

pub use assumptions::PriorAssumptions;
pub use body::Body;
pub use constraint::{ConsistentPoint, Constraint};
pub use error::FeasibilityError;
pub use estimate::{Estimate, FixedParameter};
pub use finding::{FarBody, PhysicallyImpossible};
pub use judgement::{FeasibilityLimits, Judgement, Shift};
pub use nearest::{NearestBody, nearest_body};
pub use outcome::{Outcome, StandardParameter, ValueSource};
pub use prior::{Prior, PriorSource};
pub use solve::fit_consistent;
