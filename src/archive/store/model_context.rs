//! Data on the arm in a result file that its history line does not contain.

use std::path::Path;

use didim_identification::identification::{ModelUncertainty, ParameterCovariance};
use serde::{Deserialize, Serialize};

use super::folder::result_file;
use crate::files::read_bytes;

/// Input of load identification and forecasts, from a result whose file may no longer exist.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelContext {
    /// Model errors of the result. `None` if its file was gone, or is of a version without them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_uncertainty: Option<ModelUncertainty>,
    /// Covariance of its parameters, in their order. `None` in the same cases.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<ParameterCovariance>,
    /// Additional parameters that kept their nominal values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(rename = "kept")]
    pub fixed: Vec<KeptValue>,
}

/// A parameter that was not identified and kept the value from the robot file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptValue {
    /// Its name.
    pub name: String,
    /// SI unit. Empty in results of versions without it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// SI value.
    pub value: f64,
}

/// Reads the data of a stored result. Empty if the result is gone.
pub fn read_known(folder: &Path, number: u64) -> ModelContext {
    #[derive(Deserialize)]
    struct Record {
        estimate: ModelContext,
    }
    let content = read_bytes(&result_file(folder, number)).ok();
    let record = content.and_then(|json| serde_json::from_slice::<Record>(&json).ok());
    record.map(|record| record.estimate).unwrap_or_default()
}
