//! Limits of the design of motions.

/// Limits for the design of motions and for advised motions.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignLimits {
    /// Highest frequency of a motion \[Hz\]. Convention: position loops of arms can follow it, and
    /// gears can withstand it.
    pub highest_hz: f64,
    /// Largest used share of a limit in the first motion of a search \[1\]. Convention: the barrier
    /// method needs a start inside the limits.
    pub start_limit_share: f64,
    /// Central share of the position ranges in which rest postures are searched \[1\]. Convention.
    pub rest_range_share: f64,
    /// Number of speeds of a joint in a sweep, with a constant ratio \[1\]. Convention: twice the
    /// number of parameters of a friction law with a Stribeck term.
    pub sweep_speeds: usize,
    /// Smallest number of speeds of a joint that distinguishes friction laws \[1\]. Derived:
    /// viscous and Coulomb friction alone have two parameters.
    pub min_sweep_speeds: usize,
    /// Lowest speed of a sweep relative to the highest \[1\]. Convention: about a fiftieth of the
    /// speed limit if half of the limit is used.
    pub lowest_speed_share: f64,
    /// Used share of the limits of the swept joint \[1\]. Derived: the rest allows for rounding
    /// errors.
    pub joint_limit_share: f64,
    /// Largest used share of a limit at rest at the ends of a sweep \[1\]. Convention: the rest is
    /// needed for moving.
    pub max_rest_share: f64,
    /// Duration of a candidate motion for the advice \[s\]. Convention: a few moves of an arm.
    pub piece_s: f64,
    /// Central share of the position ranges that contains the candidates' postures \[1\].
    /// Convention.
    pub posture_range_share: f64,
    /// Usable share of the limits of a candidate \[1\]. Derived: the rest allows for values between
    /// the checked samples.
    pub max_limit_share: f64,
    /// Largest number of advised motions \[1\]. Convention: if more are needed, a designed motion
    /// takes less time.
    pub max_pieces: usize,
    /// Share of the sufficient standard deviation below which a further decrease has no value
    /// \[1\]. Convention.
    pub min_need: f64,
    /// Smallest factor by which a motion has to reduce the required standard deviations \[1\].
    /// Convention: the motion has to be worth its time.
    pub min_gain: f64,
    /// Largest variance inflation 1/(1 − R²) of a column against all others \[1\]. Derived: above
    /// it, only rounding errors distinguish the columns.
    pub max_variance_inflation: f64,
}

impl DesignLimits {
    /// The values that the program uses.
    pub const DEFAULT: Self = Self {
        highest_hz: 2.0,
        start_limit_share: 0.7,
        rest_range_share: 0.8,
        sweep_speeds: 6,
        min_sweep_speeds: 3,
        lowest_speed_share: 0.04,
        joint_limit_share: 0.999,
        max_rest_share: 0.95,
        piece_s: 5.0,
        posture_range_share: 0.6,
        max_limit_share: 0.985,
        max_pieces: 4,
        min_need: 1.0 / 3.0,
        min_gain: 1.1,
        max_variance_inflation: 1e12,
    };
}
