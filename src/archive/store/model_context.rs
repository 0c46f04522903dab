//! Data about the arm that are in the result file but not in its history line.

use std::path::Path;

use didim_identification::identification::{
    Estimate, KeptParameter, ModelUncertainty, ParameterCovariance,
};
use serde::{Deserialize, Serialize};

use super::folder::result_file;
use super::record::ResultRecord;
use crate::files::read_bytes;

/// Input of load identification and forecasts. It is stored, because the file of the result may no
/// longer exist.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelContext {
    /// Model errors of the result. `None` if its file did not exist, or was written by a version
    /// without them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_uncertainty: Option<ModelUncertainty>,
    /// Covariance of the parameters, in their order. `None` in the same cases.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<ParameterCovariance>,
    /// Parameters that were fixed at their nominal values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(rename = "kept")]
    pub fixed: Vec<KeptValue>,
}

/// A parameter that was fixed at the value of the robot file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptValue {
    /// Its name.
    pub name: String,
    /// SI unit. Empty in results of versions without this key.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Value in SI units.
    pub value: f64,
}

impl ModelContext {
    /// Takes the data of an estimate.
    fn from_estimate(estimate: Estimate) -> Self {
        let fixed = estimate.nominal.into_iter();
        let fixed = fixed.map(|KeptParameter { name, unit, value }| KeptValue {
            name,
            unit: unit.to_owned(),
            value,
        });
        Self {
            model_uncertainty: estimate.model_uncertainty,
            covariance: estimate.covariance,
            fixed: fixed.collect(),
        }
    }
}

/// Reads the data of a stored result. All fields are empty if the result file does not exist.
pub fn read_known(folder: &Path, number: u64) -> ModelContext {
    let content = read_bytes(&result_file(folder, number)).ok();
    let record = content.and_then(|json| serde_json::from_slice::<ResultRecord>(&json).ok());
    record.map(|record| ModelContext::from_estimate(record.estimate)).unwrap_or_default()
}
