//! What the positions' filter and noise do to a result.

use serde::Serialize;

/// What the position filter and the noise of the positions do to the parameter that they move
/// furthest in its standard deviations. It is part of the combined uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PositionBias {
    /// Its name.
    pub parameter: String,
    /// By how many standard deviations it is off.
    pub deviations: f64,
    /// Whether by what the filter smooths, and not by the noise that it lets through.
    pub by_filter: bool,
}
