//! Identification, from an experiment to an estimate: [`identify`], by one of the methods of
//! [`Method`].
//!
//! ```text
//! friction, cutoff, cross_validation → identify → closed_loop → equation_error → torque_along
//!     → gains → payload → prediction → judgement → observation → problem
//! ```
//!
//! | module | content |
//! |---|---|
//! | `problem` | experiment, options, selected parameters; checked against each other |
//! | `observation` | filtered motion, observation matrix, aligned torque (paper, 3.1.1) |
//! | `judgement` | uncertainty, nuisance parameters, [`Verdict`] for each use |
//! | `gains` | torque gains of drives, from records without and with a known load |
//! | `payload` | load on the last link, with the arm fixed at a result with its covariance |
//! | `prediction` | prediction of a record from parameters, without a fit |
//! | `torque_along` | torque of a model along a motion, with its uncertainty |
//! | `equation_error` | IDIM-LS (paper, 3.1.2), essential parameters |
//! | `closed_loop` | simulated loop: IDIM-IV, CLIE, CLOE, DIDIM (paper, 3.2, 3.3) |

mod closed_loop;
mod cross_validation;
mod cutoff;
mod equation_error;
mod friction;
mod gains;
mod identify;
mod judgement;
mod observation;
mod payload;
mod prediction;
mod problem;
mod torque_along;

pub use closed_loop::mean_joint_inertia;
pub use cross_validation::{CrossValidation, cross_validate};
pub use cutoff::choose_cutoff;
pub use equation_error::{
    Reduction, ReductionStep, UncheckedEstimate, UncheckedParameter, essential_parameters,
    idim_ls_unchecked,
};
pub use friction::choose_friction;
pub use gains::{ArmParameter, DriveGain, Gains, GainsError, KnownLoad, Scale, find_gains};
pub use identify::{identify, identify_unchecked};
pub use judgement::{
    Alternative, BaseAxis, CATALOGUE, CatalogueRow, Change, Chosen, ChosenCutoff, ChosenFriction,
    ClippedSignal, ControllerUnchecked, ConvergenceStep, CutoffTrial, Estimate, Evidence,
    Extrapolation, Finding, FindingCode, Fit, FitMotion, FrictionChange, FrictionGain,
    FrictionScore, FrozenSignal, HeldOut, Identification, Information, KeptParameter, Lag, Lean,
    ModelUncertainty, ModelUncertaintySchema1, Note, NuisanceEstimate, NuisanceParameter, Output,
    ParameterCovariance, ParameterEstimate, PhysicalConsistency, PositionBias, PredictedError,
    Quantity, ReachedRange, Reason, ReferenceSource, ResidualQuantiles, SCHEMA, Setting,
    SettingValue, Severity, Signal, SignalAxis, Significance, SingularValues, Subject, TorqueDelay,
    UseVerdict, Uses, Verdict,
};
pub use observation::{Motion, filtered_motion, observation_matrix};
pub use payload::{
    CentreOfMass, Comparison, DeclaredLoad, KnownArm, Load, LoadBody, LoadInFrame, LoadParameter,
    LoadSums, MahalanobisDistance, Payload, PayloadError, Presence, UncertainValue, find_payload,
};
pub use prediction::{KnownModel, Prediction, PredictionError, predict};
pub use problem::{
    BodiesFrom, ClosedLoopLimits, ConvergenceLimits, CutoffSearch, DecimationFilter, Experiment,
    ExperimentError, Failure, FrictionSearch, IdentificationError, IterationError, KeptParameters,
    LimitError, Method, Optimiser, Options, PayloadLimits, PositionFilter, Selection,
    SensitivityMethod, SignalDelays, SimulationOptions, Start, ToleranceError, Tolerances,
    UnknownMethod, Use, VerdictLimits,
};
pub use torque_along::{TorqueAlong, torque_along};
