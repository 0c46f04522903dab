//! From an experiment to an estimate: the identification methods.
//!
//! Each method takes an [`Experiment`] and returns an [`Identification`], an [`Estimate`] with what
//! is needed to look at it; adding one touches one file and the list of methods in [`Method`].
//!
//! | step | where |
//! |---|---|
//! | signals and when they are valid | [`Experiment`] |
//! | filtered motion, observation matrix, aligned torque (paper, 3.1.1) | `observation` |
//! | the closed loop simulated with an estimate (paper, 3.2 and 3.3) | `closed_loop` |
//! | least squares (paper, 3.1.2) | [`regression`](crate::regression) |
//! | what the model takes for known and may be otherwise | [`ModelCheck`] |
//! | whether the result may be used | [`VerdictLimits`] |

mod closed_loop;
mod equation_error;
mod given;
mod judgement;
mod observation;

pub use closed_loop::didim::didim;
pub use closed_loop::idim_iv::idim_iv;
pub use closed_loop::inertia::mean_joint_inertia;
pub use closed_loop::output_error::{Optimiser, OutputErrorOptions, SensitivityMethod, clie, cloe};
pub use equation_error::idim_ls::idim_ls;
pub use equation_error::reduction::{Reduction, ReductionStep, essential_parameters};
pub use equation_error::unchecked::{UncheckedEstimate, idim_ls_unchecked};
pub use given::error::{Failure, IdentificationError};
pub use given::experiment::{Experiment, ExperimentError, SignalTiming, Signals};
pub use given::method::{Method, UnknownMethod};
pub use given::options::{DecimationFilter, IdimLsOptions, PositionFilter};
pub use given::selection::Selection;
pub use given::simulation::{ConvergenceLimits, DidimOptions, Start};
pub use judgement::checks::{Freedom, ModelCheck, TorqueDelay};
pub use judgement::cross_validation::{CrossValidation, PredictionError, cross_validate};
pub use judgement::estimate::{
    ConvergenceStep, Estimate, Fit, Identification, ParameterEstimate, ReferenceSource, SCHEMA,
    SingularValues, Verdict,
};
pub use judgement::information::Information;
pub use judgement::verdict::{LimitError, VerdictLimits};
pub use observation::matrix::observation_matrix;
pub use observation::prefilter::{Motion, filtered_motion, filtered_torque};
