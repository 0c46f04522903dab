//! Limits for accepting a closed-loop result.

/// Limits beyond which a result of CLOE, CLIE or IDIM-IV is not accepted as that of the arm.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedLoopLimits {
    /// Largest ratio of the torque error to the noise of the equation error \[1\]. Derived: the
    /// ratio is about 1 if both models are correct, but a simulated motion also contains the
    /// controller's response to the noise.
    pub noise_ratio: f64,
    /// Smallest distance from zero of an IDIM-LS parameter that counts as significant \[σ\].
    /// Convention: 3 standard deviations.
    pub significant_deviations: f64,
    /// Largest median of the relative standard deviations of the significant parameters \[1\].
    /// Convention: 10 %, the same as for a required value.
    pub relative_deviation: f64,
    /// Largest median ratio of the standard deviations to those of IDIM-LS \[1\]. Convention: if
    /// IDIM-LS is equally uncertain, the motion is the cause and not the criterion.
    pub deviation_ratio: f64,
    /// Smallest correlation of an instrument of IDIM-IV with its column \[1\]. Convention: the
    /// instrument then explains half of the column's variation.
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
