//! Assessment of a solution: its uncertainty, its changes under alternative models, and whether it
//! may be used.

mod alternatives;
mod bias;
mod catalogue;
mod change;
mod checks;
mod chosen_cutoff;
mod chosen_friction;
mod clipped_signal;
mod estimate;
mod extrapolation;
mod finding;
mod finding_code;
mod finding_facts;
mod findings;
mod folds;
mod frozen_signal;
mod held_out;
mod information;
mod lagging;
mod model_uncertainty;
mod nuisance_parameters;
mod outliers;
mod parameter_covariance;
mod physical_consistency;
mod positive_parameter;
mod quantiles;
mod reached;
mod reasons;
mod rows;
mod scaled_rows;
mod setting;
mod signal_findings;
mod significance;
mod uncertainty;
mod unsigned_torque;
mod uses;
mod verdict;
mod workspace;

pub use alternatives::{Alternative, Chosen, Evidence, Lag, Lean, Signal};
pub use bias::PositionBias;
pub use catalogue::{CATALOGUE, CatalogueRow};
pub use change::{Change, SignalAxis};
pub(crate) use checks::PositionError;
pub use chosen_cutoff::{ChosenCutoff, CutoffTrial};
pub use chosen_friction::{ChosenFriction, FrictionChange, FrictionGain, FrictionScore};
pub use clipped_signal::ClippedSignal;
pub use estimate::{
    ConvergenceStep, Estimate, Fit, FitMotion, Identification, KeptParameter, ParameterEstimate,
    ReferenceSource, SCHEMA, SingularValues, TorqueDelay,
};
pub use extrapolation::Extrapolation;
pub use finding::{Finding, Subject};
pub use finding_code::{FindingCode, Severity};
pub(crate) use findings::{Findings, Iteration, TorqueRows};
pub use frozen_signal::FrozenSignal;
pub use held_out::HeldOut;
pub(crate) use held_out::margin_samples;
pub use information::Information;
pub use model_uncertainty::{ModelUncertainty, ModelUncertaintySchema1, PredictedError};
pub use nuisance_parameters::{BaseAxis, NuisanceEstimate, NuisanceParameter, Quantity};
pub(crate) use outliers::DownweightedRows;
pub use parameter_covariance::ParameterCovariance;
pub use physical_consistency::PhysicalConsistency;
pub use quantiles::ResidualQuantiles;
pub use reached::ReachedRange;
pub use reasons::{ControllerUnchecked, Note, Output, Reason};
pub use setting::{Setting, SettingValue};
pub use significance::Significance;
pub use uses::{UseVerdict, Uses, Verdict};
