//! Faults of a robot's base parameters, or of a name for one.

use thiserror::Error;

/// Reason why a robot's base parameters could not be found.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BaseParametersError {
    /// A parameter's effect is nearly, but not quite, a combination of the effects of others.
    #[error(
        "a parameter differs from a combination of others by only {length:.1e} of its effect. \
        Rounding would decide whether they are distinguishable. Give the nominal geometry, and \
        make angles and lengths exactly equal where they are meant to be"
    )]
    AmbiguousRank {
        /// Share of the parameter's effect that no combination of others has.
        length: f64,
    },
    /// Two methods to count the base parameters disagree.
    #[error(
        "{chosen} base parameters were chosen where the regressor's rank is {rank}; give the \
         nominal geometry, with angles and lengths that are meant to be equal exactly equal"
    )]
    RankMismatch {
        /// Number of columns chosen one by one.
        chosen: usize,
        /// Rank by pivoted QR.
        rank: usize,
    },
}

/// Name that is not a base parameter of the robot.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{name}` is not a base parameter of the robot; these are: {available_names}")]
pub struct UnknownBaseParameter {
    /// The name.
    pub name: String,
    /// Available names.
    pub available_names: String,
}
