//! What a solution is worth: its uncertainty, what the model lacks, and whether it may be used.

pub(crate) mod assemble;
pub(crate) mod checks;
pub(crate) mod cross_validation;
pub(crate) mod estimate;
pub(crate) mod information;
pub(crate) mod outliers;
pub(crate) mod simulation_error;
pub(crate) mod verdict;
