//! What is wrong with a robot's base parameters, or with a name for one.

use thiserror::Error;

/// Why a robot's base parameters could not be found.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BaseParametersError {
    /// A parameter's effect is nearly, but not quite, that of others.
    #[error(
        "a parameter differs from a combination of others by {length:.1e} of its effect only, so \
         that rounding decides whether they can be distinguished; give the nominal geometry, with \
         angles and lengths that are meant to be equal exactly equal"
    )]
    AmbiguousRank {
        /// The part of the effect that is the parameter's own.
        length: f64,
    },
    /// Two ways to count the base parameters disagree.
    #[error(
        "{chosen} base parameters were chosen where the regressor's rank is {rank}; give the \
         nominal geometry, with angles and lengths that are meant to be equal exactly equal"
    )]
    RankMismatch {
        /// Columns chosen one by one.
        chosen: usize,
        /// Rank by pivoted QR.
        rank: usize,
    },
}

/// A name that is none of the robot's base parameters.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{name}` is not a base parameter of the robot; these are: {known}")]
pub struct UnknownBaseParameter {
    /// The name.
    pub name: String,
    /// The names there are.
    pub known: String,
}
