//! Assumptions for a design without a result.

/// Assumptions about noise where no result gives it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DesignAssumptions {
    /// Noise of a row as a share of the joint's torque limit \[1\]. Convention: without a result.
    pub noise_share: f64,
    /// Independent rows per second \[Hz\]. Convention: if no cell gives their number.
    pub rows_per_s: f64,
    /// Part of a use's required uncertainty that noise may take \[1\]. Derived: a third of it is a
    /// tenth of the variance.
    pub noise_part: f64,
}

impl DesignAssumptions {
    /// The values that the program uses.
    pub(crate) const DEFAULT: Self =
        Self { noise_share: 0.01, rows_per_s: 40.0, noise_part: 1.0 / 3.0 };
}

impl Default for DesignAssumptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}
