//! What the file of a result knows of the arm beyond its line of the history.

use std::path::Path;

use didim_core::identification::{ModelUncertainty, ParameterCovariance};
use serde::{Deserialize, Serialize};

use super::folder::result_file;
use crate::files::read_bytes;

/// What tells a load and forecasts by a result that need not be there any more.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// What the result knows of the model's errors; nothing where its file was gone, or is of a version that did not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_uncertainty: Option<ModelUncertainty>,
    /// Covariance of its parameters, in their order; likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<ParameterCovariance>,
    /// Parameters beside them that kept their nominal values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kept: Vec<KeptValue>,
}

/// A parameter that was not identified and kept the value of the robot's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptValue {
    /// Its name.
    pub name: String,
    /// Its SI unit; empty in results of versions that did not say.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// SI value.
    pub value: f64,
}

/// Of a stored result; nothing of one that is gone.
pub fn read_known(folder: &Path, number: u64) -> Known {
    #[derive(Deserialize)]
    struct Record {
        estimate: Known,
    }
    let content = read_bytes(&result_file(folder, number)).ok();
    let record = content.and_then(|json| serde_json::from_slice::<Record>(&json).ok());
    record.map(|record| record.estimate).unwrap_or_default()
}
