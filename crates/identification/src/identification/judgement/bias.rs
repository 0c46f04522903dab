//! Effect of the position filter and of the position noise on a result.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::stored_value::number;

/// Effect of the position filter and of the position noise on the most affected parameter. The
/// effect is part of the combined uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PositionBias {
    /// Name of this parameter.
    pub parameter: String,
    /// Shift of the parameter in its standard deviations.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub deviations: f64,
    /// True if the smoothing of the filter causes the shift, false if the noise that passes the
    /// filter does.
    pub by_filter: bool,
}
