//! Kinds of failed identifications.

use serde::Serialize;

/// The kinds of failure of an identification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Failure {
    /// The simulated loop is unstable, or its parameters belong to no arm.
    Diverged,
    /// Converged where the error is far above the noise.
    LocalMinimum,
    /// The criterion does not depend on the parameters, or hardly.
    Insensitive,
    /// The estimates still change, or no step lowers the error.
    NotConverged,
    /// The experiment does not allow for it: too short, or not exciting.
    Refused,
}

impl Failure {
    /// The name: `local-minimum`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Diverged => "diverged",
            Self::LocalMinimum => "local-minimum",
            Self::Insensitive => "insensitive",
            Self::NotConverged => "not-converged",
            Self::Refused => "refused",
        }
    }
}
