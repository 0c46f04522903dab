//! The result of one method.

use didim_core::identification::{Estimate, Failure, Fit};
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
    /// Why there is none.
    pub failure: Option<String>,
    /// What kind of failure it is, where that can be told.
    pub failure_kind: Option<Failure>,
    /// How long it took \[ms\]; differs from run to run and is no part of a result file.
    pub elapsed_ms: f64,
    /// Measurement against model.
    #[serde(skip)]
    pub fit: Option<Fit>,
}
