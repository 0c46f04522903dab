//! Excitation: insufficient parameters of a stored result, the task of the next motion, and its
//! expected uncertainties.

mod advice;
mod assignment;
mod assumptions;
mod expectation;
mod hulls;
mod played;
mod separation;

pub use advice::AdviceForResult;
pub use assignment::{Assignment, AssignmentError, RequestedDesign, TaskParameter, WantedLoad};
pub use expectation::{DesignedMotion, ExpectationError, ExpectedParameter, expectation_line};
pub use hulls::{ShapeProblem, UnreadShape};
pub use played::{PlayError, PlayedMotion};
pub use separation::{CheckedLinks, Floor, RequestedChecks};
