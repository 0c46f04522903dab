//! The list of methods.

use core::fmt;
use core::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// An identification method, by its name on the command line and in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Inverse dynamic identification model, least squares (paper, section 3.1).
    IdimLs,
    /// Direct and inverse dynamic identification models (paper, section 3.3).
    Didim,
    /// Closed-loop input error (paper, section 3.2.3).
    Clie,
    /// Closed-loop output error (paper, section 3.2.2).
    Cloe,
    /// Inverse dynamic identification model, instrumental variables.
    IdimIv,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 5] = [Self::IdimLs, Self::Didim, Self::Clie, Self::Cloe, Self::IdimIv];

    /// The name: `idim-ls`.
    pub fn name(self) -> &'static str {
        match self {
            Self::IdimLs => "idim-ls",
            Self::Didim => "didim",
            Self::Clie => "clie",
            Self::Cloe => "cloe",
            Self::IdimIv => "idim-iv",
        }
    }

    /// What the name stands for.
    pub fn long_name(self) -> &'static str {
        match self {
            Self::IdimLs => "inverse dynamic identification model, least squares",
            Self::Didim => "direct and inverse dynamic identification models",
            Self::Clie => "closed-loop input error",
            Self::Cloe => "closed-loop output error",
            Self::IdimIv => "inverse dynamic identification model, instrumental variables",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// No method has this name. Remedy: one of [`Method::ALL`].
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("unknown method {name:?}; known: {}", Method::ALL.map(Method::name).join(", "))]
pub struct UnknownMethod {
    /// The name given.
    pub name: String,
}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, UnknownMethod> {
        let known = Self::ALL.into_iter().find(|method| method.name() == name);
        known.ok_or_else(|| UnknownMethod { name: name.to_owned() })
    }
}
