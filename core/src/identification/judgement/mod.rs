//! What a solution is worth: its uncertainty, what alternative models would change, and whether it may
//! be used.

mod bias;
mod bodies;
mod checks;
mod chosen_cutoff;
mod chosen_friction;
mod cut_off;
mod elsewhere;
mod estimate;
mod findings;
mod freedoms;
mod glance;
mod held_out;
mod information;
mod lagging;
mod low_passed;
mod misread;
mod model_uncertainty;
mod outliers;
mod parameter_covariance;
mod pieces;
mod quantiles;
mod reached;
mod reasons;
mod refitted;
mod rows;
mod stale;
mod uncertainty;
mod uses;
mod verdict;
mod workspace;

pub use bias::PositionBias;
pub use bodies::Bodies;
pub(crate) use checks::PositionError;
pub use chosen_cutoff::{ChosenCutoff, CutoffTrial};
pub use chosen_friction::{ChosenFriction, FrictionChange, FrictionGain, FrictionScore};
pub use cut_off::CutOff;
pub use elsewhere::Elsewhere;
pub use estimate::{
    ConvergenceStep, Estimate, Fit, FitMotion, Identification, KeptParameter, ParameterEstimate,
    ReferenceSource, SCHEMA, SingularValues, TorqueDelay,
};
pub(crate) use findings::{Findings, Iteration, TorqueRows};
pub use freedoms::{Freedom, FreedomEstimate, Quantity};
pub use held_out::HeldOut;
pub(crate) use held_out::REACH_ROWS;
pub use information::Information;
pub use model_uncertainty::{Foretold, ModelUncertainty};
pub(crate) use outliers::DownweightedRows;
pub use parameter_covariance::ParameterCovariance;
pub use quantiles::ResidualQuantiles;
pub use reached::Reached;
pub use reasons::{ControllerUnchecked, Note, Output, Reason, Slow};
pub use stale::Stale;
pub use uses::{UseVerdict, Uses, Verdict};
