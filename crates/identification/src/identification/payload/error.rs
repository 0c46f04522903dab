//! Errors of the payload estimate.

use thiserror::Error;

use crate::feasibility::FeasibilityError;
use crate::identification::problem::IdentificationError;
use crate::regression::RegressionError;
use didim_dynamics::dynamics::BaseParametersError;

/// Reason why no load is identified. Each message says what to do.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PayloadError {
    /// The result contains no uncertainty.
    #[error(
        "the result has no covariance of its parameters: it is from an earlier version, or was \
            changed; identify again, and give the new result"
    )]
    NoCovariance,
    /// The covariance has directions without variance.
    #[error(
        "the covariance of the result is not positive definite; give the result as it was stored, \
        to all its digits"
    )]
    Covariance,
    /// A load changes base parameters that the result has not identified.
    #[error(
        "a load changes {}, which the result has not identified; without them the arm would \
            count as load. Identify all base parameters, with the arm empty", .names.join(" ")
    )]
    NotIdentified {
        /// Names of these base parameters.
        names: Vec<String>,
    },
    /// No motion of this arm makes a load identifiable.
    #[error("no motion of this arm shows a load on its last link; nothing can be found")]
    Unseen,
    /// The record does not distinguish some parameters of the load.
    #[error(
        "the record does not identify {} of a load; record with all joints moving, the last \
            ones in several orientations to gravity", .names.join(" ")
    )]
    NotIdentifiable {
        /// Their names.
        names: Vec<String>,
    },
    /// The geometry does not determine which of the ten load parameters are identifiable.
    #[error(transparent)]
    Ambiguous(#[from] BaseParametersError),
    /// The equation has no solution.
    #[error("the load: {0}")]
    Regression(RegressionError),
    /// Robot, record and options do not form an identification.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// No physically consistent body was found.
    #[error(transparent)]
    Feasibility(#[from] FeasibilityError),
}
