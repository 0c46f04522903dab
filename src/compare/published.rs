//! Published figures, to stand beside those that come out.

use std::collections::BTreeMap;

use didim_core::identification::{Method, SingularValues};
use serde::Deserialize;

use super::{Framework, Trial};

/// The figures of a publication.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// What was published.
    pub source: String,
    /// The figures of every method.
    pub methods: Vec<PublishedFigures>,
}

/// What was published of one method.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedFigures {
    /// The method.
    pub method: Method,
    /// Its framework.
    pub framework: Framework,
    /// Value (SI) and relative standard deviation \[%\] of each parameter, by our names.
    #[serde(default)]
    pub estimates: BTreeMap<String, (f64, f64)>,
    /// Extreme singular values of the observation matrix.
    pub singular_values: Option<PublishedSingularValues>,
    /// Condition number, as printed.
    pub condition_number: Option<f64>,
    /// Computing time \[min\].
    pub time_min: Option<f64>,
    /// Mean relative errors of the simulation over the axes.
    pub errors: Option<PublishedErrors>,
}

/// Extreme singular values.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedSingularValues {
    /// Largest.
    pub max: f64,
    /// Smallest.
    pub min: f64,
}

impl From<PublishedSingularValues> for SingularValues {
    fn from(PublishedSingularValues { max, min }: PublishedSingularValues) -> Self {
        Self { max, min }
    }
}

/// Mean relative errors over the axes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedErrors {
    /// ‖q − q_s‖ / ‖q‖ \[%\].
    pub position_percent: f64,
    /// ‖τ − τ_s‖ / ‖τ‖ \[%\].
    pub torque_percent: f64,
}

impl Published {
    /// What was published of a method in a framework.
    pub fn of(&self, trial: Trial) -> Option<&PublishedFigures> {
        self.methods.iter().find(|of| of.method == trial.method && of.framework == trial.framework)
    }
}
