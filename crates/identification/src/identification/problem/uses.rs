//! Use of a result.

use core::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Use of a result. Each has a verdict of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Use {
    /// Watching the parameters of this arm over the years.
    Monitoring,
    /// The torque of any motion, in a controller or a simulation.
    Prediction,
    /// Thresholds on the residual torque. The required thresholds are not part of the result, so
    /// the answer is never yes or no.
    ContactDetection,
    /// The parameters themselves, for comparison with a data sheet.
    PhysicalValues,
    /// A model with a mass matrix that can be inverted anywhere.
    RigidBody,
}

impl Use {
    /// All uses, in the order in which they are displayed.
    pub const ALL: [Self; 5] = [
        Self::Monitoring,
        Self::Prediction,
        Self::ContactDetection,
        Self::PhysicalValues,
        Self::RigidBody,
    ];

    /// Returns the required uses of a cell that configures none.
    pub fn default_uses() -> Vec<Self> {
        vec![Self::Monitoring, Self::Prediction]
    }

    /// Returns the name that is used in cell files and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Monitoring => "monitoring",
            Self::Prediction => "prediction",
            Self::ContactDetection => "contact-detection",
            Self::PhysicalValues => "physical-values",
            Self::RigidBody => "rigid-body",
        }
    }
}

impl fmt::Display for Use {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
