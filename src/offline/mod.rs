//! A whole measurement at once: read from a log, identified, every method side by side; and a stored result, which predicts
//! another measurement, tells the load in one, leaves as a model, or says which motion it lacks.

mod advice;
mod commanded;
pub mod compare;
mod consistent;
mod difference;
mod excitation;
mod foretold;
mod gains;
pub mod identify;
mod limits;
mod log;
mod payload;
mod predict;
mod rate;
mod still;
mod stored;

pub use advice::Advised;
pub use commanded::{LawError, commanded_controller};
pub use consistent::{Consistent, ConsistentError, Exported, Format, WriteError};
pub use difference::{JointDifference, TorqueDifferenceError, torque_difference};
pub use excitation::{Assignment, AssignmentError, Lacking, Wanted, WantedLoad};
pub use foretold::{DesignedMotion, Foretold, ForetoldError, foretold_line};
pub use gains::{FindGainsError, FoundGain, FoundGains, find_gains};
pub use limits::{
    Beyond, BeyondLimits, Cause, LIST_LAWS, Limited, STATE_LIMITS, check_limits, open_limits,
    unlisted_laws,
};
pub use log::{LogError, read_log};
pub use payload::{LoadError, find_load};
pub use rate::RateError;
pub use still::still_joints;
pub use stored::{JudgedUse, OTHER_CONFIGURATION, ResultError, StoredModel};
