//! Limits of the drift.

/// Limits that decide about drift in addition to the options of a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct DriftLimits {
    /// Share of the band within which an alarm is cleared \[1\]. Convention: a parameter at the
    /// edge does not raise and clear it repeatedly.
    pub clearing_share: f64,
    /// Difference up to which two noted payloads are the same \[kg\]. Derived: the resolution of a
    /// bench balance.
    pub same_payload_kg: f64,
    /// Largest extrapolation of a trend, as a multiple of its past time span \[1\]. Convention.
    pub forecast_spans: f64,
    /// Number of its standard deviations below which a slope counts as zero \[σ\]. Convention.
    pub slope_deviations: f64,
}

impl DriftLimits {
    /// The values that the program uses.
    pub const DEFAULT: Self = Self {
        clearing_share: 0.75,
        same_payload_kg: 0.01,
        forecast_spans: 3.0,
        slope_deviations: 3.0,
    };
}

impl Default for DriftLimits {
    fn default() -> Self {
        Self::DEFAULT
    }
}
