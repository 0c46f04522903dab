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
    /// Reason why there is no result; `None` if there is one.
    pub failure: Option<String>,
    /// Kind of failure, if it is known.
    pub failure_kind: Option<Failure>,
    /// Duration of the identification \[ms\]. It differs from run to run and is not part of a
    /// result file.
    pub elapsed_ms: f64,
    /// Fit of the model to the measurement, for the drawings.
    #[serde(skip)]
    pub fit: Option<Fit>,
}
