//! A cut-off of the position filter that the data chose.

use serde::Serialize;

/// One cut-off that was tried.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CutoffTrial {
    /// Cut-off frequency of one pass \[Hz\].
    pub cutoff_hz: f64,
    /// Relative error over all joints on held-out pieces.
    pub held_out: f64,
    /// Relative uncertainty of the torque where the arm has not been.
    #[serde(rename = "elsewhere")]
    pub extrapolation: f64,
}

/// The cut-off that was chosen, and what was tried, in rising order.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChosenCutoff {
    /// Cut-off frequency of one pass \[Hz\].
    pub cutoff_hz: f64,
    /// Every cut-off with which the record could be identified.
    pub trials: Vec<CutoffTrial>,
}
