//! From an experiment to an estimate: [`identify`], by one of the methods of [`Method`].
//!
//! ```text
//! friction, cutoff, cross_validation → identify → closed_loop → equation_error → torque_along → gains → payload → prediction → judgement → observation → given
//! ```
//!
//! | room | what |
//! |---|---|
//! | `given` | experiment, options, which parameters; found to fit each other |
//! | `observation` | filtered motion, observation matrix, aligned torque (paper, 3.1.1) |
//! | `judgement` | uncertainty, what is taken for known, [`Verdict`] for each use |
//! | `gains` | torque gains of drives, from records without and with a known load |
//! | `payload` | a load on the last link, the arm held at a result with its covariance |
//! | `prediction` | a record predicted with parameters, nothing fitted |
//! | `torque_along` | the torque that a model has along a motion, and how uncertain it is |
//! | `equation_error` | IDIM-LS (paper, 3.1.2), essential parameters |
//! | `closed_loop` | the loop simulated with an estimate: IDIM-IV, CLIE, CLOE, DIDIM (paper, 3.2, 3.3) |

mod closed_loop;
mod cross_validation;
mod cutoff;
mod equation_error;
mod friction;
mod gains;
mod given;
mod identify;
mod judgement;
mod observation;
mod payload;
mod prediction;
mod torque_along;

pub use closed_loop::mean_joint_inertia;
pub use cross_validation::{CrossValidation, cross_validate};
pub use cutoff::choose_cutoff;
pub use equation_error::{
    Reduction, ReductionStep, UncheckedEstimate, UncheckedParameter, essential_parameters,
    idim_ls_unchecked,
};
pub use friction::choose_friction;
pub use gains::{ArmParameter, DriveGain, Gains, GainsError, KnownLoad, Scale, gains};
pub use given::{
    BodiesFrom, ConvergenceLimits, DecimationFilter, Experiment, ExperimentError, Failure,
    IdentificationError, IterationError, KeptParameters, LimitError, Method, Optimiser, Options,
    PositionFilter, Selection, SensitivityMethod, SignalTiming, Signals, SimulationOptions, Start,
    ToleranceError, Tolerances, UnknownMethod, Use, VerdictLimits,
};
pub use identify::identify;
pub use judgement::{
    Bodies, ChosenCutoff, ChosenFriction, ControllerUnchecked, ConvergenceStep, CutOff,
    CutoffTrial, Elsewhere, Estimate, Fit, FitMotion, Foretold, Freedom, FreedomEstimate,
    FrictionChange, FrictionGain, FrictionScore, HeldOut, Identification, Information,
    KeptParameter, ModelUncertainty, Note, Output, ParameterCovariance, ParameterEstimate,
    PositionBias, Quantity, Reached, Reason, ReferenceSource, ResidualQuantiles, SCHEMA,
    SingularValues, Slow, Stale, TorqueDelay, UseVerdict, Uses, Verdict,
};
pub use observation::{Motion, filtered_motion, observation_matrix};
pub use payload::{
    Comparison, Declared, Distance, KnownArm, Load, LoadBody, LoadParameter, LoadSums, Payload,
    PayloadError, Presence, Uncertain, payload,
};
pub use prediction::{KnownModel, Prediction, PredictionError, predict};
pub use torque_along::{TorqueAlong, torque_along};
