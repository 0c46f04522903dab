//! The result of one method.

use didim_identification::identification::{Estimate, Failure, Fit};
use serde::Serialize;

use super::trial::Trial;

/// The result of one method.
#[derive(Clone, Debug, Serialize)]
pub struct MethodResult {
    /// The method and its framework.
    #[serde(flatten)]
    pub trial: Trial,
    /// The result, if there is one.
    pub estimate: Option<Estimate>,
    /// Reason if there is no result.
    pub failure: Option<String>,
    /// Kind of failure, if it is known.
    pub failure_kind: Option<Failure>,
    /// Duration \[ms\]; it differs from run to run and is not part of a result file.
    pub elapsed_ms: f64,
    /// Measurement against model.
    #[serde(skip)]
    pub fit: Option<Fit>,
}
