//! Limits of the comparison of arms.

/// Limits that decide whether arms of one type can be compared.
#[derive(Clone, Debug, PartialEq)]
pub struct FleetLimits {
    /// Least number of arms \[1\]. Derived: with five, the scatter is so uncertain that nothing is
    /// improbable.
    pub min_arms: usize,
}

impl FleetLimits {
    /// The values that the program uses.
    pub const DEFAULT: Self = Self { min_arms: 6 };
}
