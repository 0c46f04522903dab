//! When a result of the closed loop counts.

/// Limits beyond which a result of CLOE, CLIE or IDIM-IV is not that of the arm.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedLoopLimits {
    /// Largest ratio of the torque error to the noise of the equation error \[1\]. Derived: both
    /// are about the same if the models are right, and a simulated motion adds the controller's
    /// response to the noise.
    pub noise_ratio: f64,
    /// Least distance from zero of an IDIM-LS parameter that counts as known \[σ\]. Convention: 3
    /// standard deviations.
    pub significant_deviations: f64,
    /// Largest median of the relative standard deviations of known parameters, if the criterion
    /// identifies them \[1\]. Convention: 10 %, as for a required value.
    pub relative_deviation: f64,
    /// Largest median of the factors by which IDIM-LS knows them better \[1\]. Convention: a motion
    /// that tells IDIM-LS no more either is no fault of the criterion.
    pub deviation_ratio: f64,
    /// Least correlation of an instrument of IDIM-IV with its column \[1\]. Convention: half of the
    /// column's variation is then the instrument's.
    pub instrument_correlation: f64,
}

impl Default for ClosedLoopLimits {
    fn default() -> Self {
        Self {
            noise_ratio: 3.0,
            significant_deviations: 3.0,
            relative_deviation: 0.1,
            deviation_ratio: 3.0,
            instrument_correlation: 0.5,
        }
    }
}
