//! The equation error: the inverse dynamic model along the measured motion, by least squares.

mod fit;
mod idim_ls;
mod loads;
mod reduction;
mod unchecked;
mod weighting;

pub(crate) use fit::EquationErrorFit;
pub(crate) use idim_ls::idim_ls;
pub(crate) use loads::settle_loads;
pub use reduction::{Reduction, ReductionStep, essential_parameters};
pub use unchecked::{UncheckedEstimate, UncheckedParameter, idim_ls_unchecked};
pub(crate) use weighting::Weighting;
