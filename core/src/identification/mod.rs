//! From an experiment to an estimate: the identification methods.
//!
//! Each method takes an [`Experiment`] and returns an [`Identification`], an [`Estimate`] with what
//! is needed to look at it; adding one touches one file and the list of methods in [`Method`].
//!
//! | step | where |
//! |---|---|
//! | signals and when they are valid | [`Experiment`] |
//! | filtered motion, observation matrix, aligned torque (paper, 3.1.1) | `prefilter`, `observation` |
//! | the closed loop simulated with an estimate (paper, 3.2 and 3.3) | `simulator` |
//! | least squares (paper, 3.1.2) | [`regression`](crate::regression) |
//! | what the model takes for known and may be otherwise | [`ModelCheck`] |
//! | whether the result may be used | [`VerdictLimits`] |

mod assemble;
mod checks;
mod cross_validation;
mod didim;
mod error;
mod estimate;
mod experiment;
mod filtered_positions;
mod held_out;
mod idim_iv;
mod idim_ls;
mod information;
mod instruments;
mod method;
mod observation;
mod options;
mod outliers;
mod output_error;
mod prefilter;
mod reduction;
mod selection;
mod simulation_error;
mod simulator;
mod unchecked;
mod verdict;
mod weighting;

pub use checks::{Freedom, ModelCheck, TorqueDelay};
pub use cross_validation::{CrossValidation, PredictionError, cross_validate};
pub use didim::{ConvergenceLimits, DidimOptions, Start, didim, mean_joint_inertia};
pub use error::{Failure, IdentificationError};
pub use estimate::{
    ConvergenceStep, Estimate, Fit, Identification, ParameterEstimate, ReferenceSource, SCHEMA,
    SingularValues, Verdict,
};
pub use experiment::{Experiment, ExperimentError, SignalTiming, Signals};
pub use idim_iv::idim_iv;
pub use idim_ls::idim_ls;
pub use information::Information;
pub use method::{Method, UnknownMethod};
pub use observation::observation_matrix;
pub use options::{DecimationFilter, IdimLsOptions, PositionFilter};
pub use output_error::{Optimiser, OutputErrorOptions, SensitivityMethod, clie, cloe};
pub use prefilter::{Motion, filtered_motion, filtered_torque};
pub use reduction::{Reduction, ReductionStep, essential_parameters};
pub use selection::Selection;
pub use unchecked::{UncheckedEstimate, idim_ls_unchecked};
pub use verdict::{LimitError, VerdictLimits};
