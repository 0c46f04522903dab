//! What a solution is worth: its uncertainty, what alternative models would change, and whether it may
//! be used.

mod alternative;
mod checks;
mod estimate;
mod findings;
mod information;
mod outliers;
mod reasons;
mod verdict;
mod workspace;

pub use alternative::{Alternative, ModelCheck, TorqueDelay};
pub(crate) use checks::PositionError;
pub use estimate::{
    ConvergenceStep, Estimate, Fit, Identification, ParameterEstimate, ReferenceSource, SCHEMA,
    SingularValues, Verdict,
};
pub(crate) use findings::{Findings, Iteration, TorqueRows};
pub use information::Information;
pub(crate) use outliers::DownweightedRows;
pub use reasons::{Note, Output, Reason};
