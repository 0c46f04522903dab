//! Limits of the drift.

/// Limits for drift that no option of the cell changes.
#[derive(Clone, Debug, PartialEq)]
pub struct DriftLimits {
    /// Share of the band within which an alarm is cleared \[1\]. Convention: it prevents a
    /// parameter at the edge of its band from raising and clearing its alarm repeatedly.
    pub clearing_share: f64,
    /// Difference below which two noted payloads count as equal \[kg\]. Derived: the resolution of
    /// a bench balance.
    pub same_payload_kg: f64,
    /// Largest extrapolation of a trend, as a multiple of its past time span \[1\]. Convention.
    pub forecast_spans: f64,
    /// Number of standard deviations below which a slope counts as zero \[σ\]. Convention.
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
