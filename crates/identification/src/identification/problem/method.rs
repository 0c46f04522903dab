//! Identification methods and their properties.

use core::fmt;
use core::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// An identification method, by its name on the command line and in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Inverse dynamic identification model, least squares (paper, section 3.1).
    IdimLs,
    /// Inverse dynamic identification model, instrumental variables.
    IdimIv,
    /// Closed-loop input error (paper, section 3.2.3).
    Clie,
    /// Closed-loop output error (paper, section 3.2.2).
    Cloe,
    /// Direct and inverse dynamic identification models (paper, section 3.3).
    Didim,
}

impl Method {
    /// All methods, in the order of the paper's tables.
    pub const ALL: [Self; 5] = [Self::IdimLs, Self::IdimIv, Self::Clie, Self::Cloe, Self::Didim];

    /// Returns the name, for example `idim-ls`.
    pub fn name(self) -> &'static str {
        self.name_list().0
    }

    /// Returns the long form of the name.
    pub fn long_name(self) -> &'static str {
        self.name_list().1
    }

    fn name_list(self) -> (&'static str, &'static str) {
        match self {
            Self::IdimLs => ("idim-ls", "inverse dynamic identification model, least squares"),
            Self::IdimIv => {
                ("idim-iv", "inverse dynamic identification model, instrumental variables")
            }
            Self::Clie => ("clie", "closed-loop input error"),
            Self::Cloe => ("cloe", "closed-loop output error"),
            Self::Didim => ("didim", "direct and inverse dynamic identification models"),
        }
    }

    /// Returns true if the method simulates the closed loop, and so needs a controller.
    pub fn simulates(self) -> bool {
        self != Self::IdimLs
    }

    /// Returns true if the method fits positions; the others fit torques.
    pub fn fits_positions(self) -> bool {
        self == Self::Cloe
    }

    /// Returns true if the method uses the sensitivities of the simulated loop. A few DIDIM steps
    /// may then bring the start closer to the minimum.
    pub fn uses_sensitivities(self) -> bool {
        matches!(self, Self::Clie | Self::Cloe)
    }

    /// Returns true if the method supports robust weights, which reduce the effect of rows with
    /// large residuals.
    pub fn has_robust_weights(self) -> bool {
        matches!(self, Self::IdimLs | Self::Didim)
    }

    /// Returns true if the paper also applies the method without the decimation filter (its table
    /// 1).
    pub fn has_strict_framework(self) -> bool {
        self.uses_sensitivities() || self == Self::Didim
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// No method has this name. Remedy: use a name from [`Method::ALL`].
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("unknown method {name:?}; known: {}", Method::ALL.map(Method::name).join(", "))]
pub struct UnknownMethod {
    /// Given name.
    pub name: String,
}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, UnknownMethod> {
        let matching_method = Self::ALL.into_iter().find(|method| method.name() == name);
        matching_method.ok_or_else(|| UnknownMethod { name: name.to_owned() })
    }
}
