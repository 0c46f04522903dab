//! Why no load is found.

use thiserror::Error;

use crate::dynamics::BaseParametersError;
use crate::feasibility::FeasibilityError;
use crate::identification::given::IdentificationError;
use crate::regression::RegressionError;

/// Why no load is found; each message says what to do.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PayloadError {
    /// The result does not say how uncertain it is.
    #[error(
        "the result has no covariance of its parameters: it is of an earlier version, or was changed; identify again, and give \
         what comes of it"
    )]
    NoCovariance,
    /// The covariance has directions without variance.
    #[error(
        "the covariance of the result is not positive definite; give the result as it was stored, to all its digits"
    )]
    Covariance,
    /// A load changes base parameters that were not identified.
    #[error(
        "a load changes {}, which the result has not identified: what the arm has of it by itself is unknown and would count as load; \
         identify all base parameters, with the arm empty", .names.join(" ")
    )]
    NotIdentified {
        /// Their names.
        names: Vec<String>,
    },
    /// No motion of this arm shows a load.
    #[error("no motion of this arm shows a load on its last link; nothing can be found")]
    Unseen,
    /// The record does not tell parameters of a load.
    #[error(
        "the record does not tell {} of a load from the others; record with all joints moving, the last ones in several \
         orientations to gravity", .names.join(" ")
    )]
    NotTold {
        /// Their names.
        names: Vec<String>,
    },
    /// Which of the ten an arm can show is not to be told from its geometry.
    #[error(transparent)]
    Ambiguous(#[from] BaseParametersError),
    /// The equation has no solution.
    #[error("the load: {0}")]
    Regression(RegressionError),
    /// Robot, record and options are no identification.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// No body was found.
    #[error(transparent)]
    Feasibility(#[from] FeasibilityError),
}
