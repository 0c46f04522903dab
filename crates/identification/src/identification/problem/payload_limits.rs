//! When a load counts as present, and as the declared one.

/// Limits of the judgement of a load.
#[derive(Clone, Debug, PartialEq)]
pub struct PayloadLimits {
    /// Travel along a record below which a joint is at rest \[rad or m\]. Derived: in a held
    /// posture, gears and filters cause no larger motion.
    pub rest_travel: f64,
    /// Distance from zero above which a value is not zero, and a mass has a centre \[σ\].
    /// Convention: 3 standard deviations.
    pub deviations: f64,
    /// Probability of reporting a correct load as wrong or an absent load as present \[1\].
    /// Derived: that of `deviations`.
    pub chance_probability: f64,
    /// Share of the masses compatible with the estimate that is below the limit of an unseen mass
    /// \[1\]. Convention: 95 %.
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
