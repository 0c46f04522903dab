//! Kinds of failed identifications.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Kind of failure of an identification.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Failure {
    /// The simulated loop is unstable, or the parameters are not those of a possible arm.
    Diverged,
    /// The iteration converged to a minimum whose error is far above the noise.
    LocalMinimum,
    /// The criterion does not depend on the parameters, or hardly depends on them.
    Insensitive,
    /// The estimates still change after the last permitted simulation, or no step lowers the error.
    NotConverged,
    /// The experiment does not permit an identification: it is too short, or it does not excite the
    /// parameters.
    Refused,
}

impl Failure {
    /// Returns the name, for example `local-minimum`.
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
