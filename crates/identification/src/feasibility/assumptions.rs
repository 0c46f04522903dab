//! Assumptions of the prior bodies.

/// Assumptions about an arm's bodies and drives, which apply if the data do not decide.
#[derive(Clone, Debug, PartialEq)]
pub struct PriorAssumptions {
    /// Mass of each link relative to the one before \[1\]. Convention: geometric prior without CAD.
    pub link_mass_ratio: f64,
    /// Density of a link \[kg/m³\]. Derived: hollow light-metal housing with motors.
    pub density_kg_m3: f64,
    /// Length of the last link along z \[m\]. Convention: a flange.
    pub last_length_m: f64,
    /// λ = 2/s² of the geometric prior, with relative standard deviation s = 1 in every direction
    /// of a body \[1\]. Derived.
    pub geometric_weight: f64,
    /// λ = 2/s² of the nominal prior, s = 0.3 \[1\]. Derived.
    pub nominal_weight: f64,
    /// Assumed part of a drive inertia in a sum with a link's inertia, if only the sum is known
    /// \[1\]. Convention.
    pub sum_share: f64,
    /// Least eigenvalue of a prior's friction matrix with its diagonal scaled to 1 \[1\].
    /// Convention.
    pub min_eigenvalue: f64,
    /// Standard deviation of a nominal value relative to the value \[1\]. Convention: the same as
    /// in the prior of nominal bodies.
    pub nominal_deviation: f64,
    /// Standard deviation of a nominal value of 0, in its unit. Convention: negligible for any arm.
    pub zero_deviation: f64,
    /// Distance from the prior beyond which no bodies are searched \[nats\]. Convention: a tenth of
    /// it is already a contradiction.
    pub max_divergence: f64,
}

impl PriorAssumptions {
    /// The values that the program uses.
    pub const DEFAULT: Self = Self {
        link_mass_ratio: 0.7,
        density_kg_m3: 2000.0,
        last_length_m: 0.1,
        geometric_weight: 2.0,
        nominal_weight: 22.0,
        sum_share: 0.3,
        min_eigenvalue: 0.1,
        nominal_deviation: 0.3,
        zero_deviation: 1e-6,
        max_divergence: 300.0,
    };
}
