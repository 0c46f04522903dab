//! Assumptions for a design without a result.

/// Assumptions about noise for a design without a result.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DesignAssumptions {
    /// Noise of a row as a share of the joint's torque limit \[1\]. Convention for designs without
    /// a result.
    pub noise_share: f64,
    /// Independent rows per second \[Hz\]. Convention for designs without a cell.
    pub rows_per_s: f64,
    /// Share of a use's required uncertainty that noise may cause \[1\]. Derived: a third of the
    /// standard uncertainty is about a tenth of the variance.
    pub noise_part: f64,
}

impl DesignAssumptions {
    /// The values that the program uses.
    pub(crate) const DEFAULT: Self =
        Self { noise_share: 0.01, rows_per_s: 40.0, noise_part: 1.0 / 3.0 };
}
