//! Numbers of alternative readings.

/// Number that the data choose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Chosen {
    /// The number.
    pub value: f64,
    /// Its standard deviation, in the same unit. 0 before the alternative is named.
    pub standard_deviation: f64,
}
