//! Limits for detecting a load and for comparing it with the declared one.

/// Limits for judging a load.
#[derive(Clone, Debug, PartialEq)]
pub struct PayloadLimits {
    /// Travel along a record below which a joint is at rest \[rad or m\]. Derived: in a held
    /// posture, elastic gears and the filters cause less motion.
    pub rest_travel: f64,
    /// Distance from zero above which a value counts as non-zero, and a mass as large enough to
    /// determine its centre \[σ\]. Convention: 3 standard deviations.
    pub deviations: f64,
    /// Probability of reporting a correct load as wrong, or an absent load as present \[1\].
    /// Derived: from `deviations`.
    pub chance_probability: f64,
    /// Probability that an undetected mass is below the reported limit, given the estimate \[1\].
    /// Convention: 95 %.
    pub mass_limit_probability: f64,
    /// Share of all records in which the cost of the true body stays below the χ² limit \[1\].
    /// Convention: 99 %.
    pub body_probability: f64,
}

impl Default for PayloadLimits {
    fn default() -> Self {
        Self {
            rest_travel: 5e-3,
            deviations: 3.0,
            chance_probability: 0.0027,
            mass_limit_probability: 0.95,
            body_probability: 0.99,
        }
    }
}
