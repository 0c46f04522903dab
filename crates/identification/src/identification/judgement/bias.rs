//! Effect of the position filter and of the position noise on a result.

use serde::Serialize;

/// Effect of the position filter and of the position noise on the parameter that they move
/// furthest, in its standard deviations. It is part of the combined uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PositionBias {
    /// Its name.
    pub parameter: String,
    /// By how many standard deviations it is off.
    pub deviations: f64,
    /// True if the filter's smoothing causes it, false if the noise that passes the filter does.
    pub by_filter: bool,
}
