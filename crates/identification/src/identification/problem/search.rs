//! Options of the searches for friction laws and for a cut-off frequency.

/// Options of the search for friction laws.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionSearch {
    /// Tried widths of the sign function, as shares of a joint's highest speed \[1\]. Convention:
    /// steps by a factor of 2 to 2.5 over two decades.
    pub sign_widths: Vec<f64>,
    /// Tried Stribeck speeds, as shares of a joint's highest speed \[1\]. Convention: steps by a
    /// factor of 3 over one decade.
    pub stribeck_speeds: Vec<f64>,
    /// Factors by which a chosen width or speed is refined. They are applied in turn, each as long
    /// as the held-out error decreases \[1\]. Derived: up and down, by half and by a quarter of the
    /// step between candidates.
    pub refinements: Vec<f64>,
    /// Largest number of refinements by one factor. Derived: further refinement would pass the
    /// neighbouring candidate.
    pub max_refinements: usize,
    /// Share of a joint's held-out error that a change has to remove \[1\]. Convention: an
    /// unnecessary law may predict another motion worse.
    pub min_gain: f64,
    /// Increase of the torque uncertainty outside the recorded motion that counts as a tie,
    /// relative to all of the torque \[1\]. Convention.
    pub extrapolation_tie: f64,
    /// Largest ratio of friction to load \[1\]. Derived: a gear that loses more than half of the
    /// load is self-locking and cannot be back-driven.
    pub max_load_share: f64,
    /// Number of rounds in which every joint may get one change. Convention: no joint needs more
    /// laws.
    pub max_rounds: usize,
}

impl Default for FrictionSearch {
    fn default() -> Self {
        Self {
            sign_widths: vec![0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2],
            stribeck_speeds: vec![0.02, 0.06, 0.2],
            refinements: vec![1.4, 1.0 / 1.4, 1.18, 1.0 / 1.18],
            max_refinements: 5,
            min_gain: 0.05,
            extrapolation_tie: 0.001,
            max_load_share: 0.5,
            max_rounds: 4,
        }
    }
}

/// Options of the search for the position filter's cut-off frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct CutoffSearch {
    /// Candidates within one decade \[1\]. Convention: round numbers, each 1.4 to 1.5 times the
    /// previous one.
    pub candidates_of_decade: Vec<f64>,
    /// Lowest and highest candidate, as multiples of the parallel filter's cut-off \[1\].
    /// Convention: the motion lies within this range.
    pub range: [f64; 2],
    /// Highest candidate, as a share of the sample rate \[1\]. Derived: above it, noise dominates
    /// the accelerations from differences.
    pub highest_share: f64,
    /// Largest increase over the smallest held-out error that still counts as equal, relative to
    /// that error \[1\]. Convention.
    pub tie_tolerance: f64,
}

impl Default for CutoffSearch {
    fn default() -> Self {
        Self {
            candidates_of_decade: vec![1.0, 1.5, 2.0, 3.0, 5.0, 7.0],
            range: [0.1, 20.0],
            highest_share: 0.35,
            tie_tolerance: 0.01,
        }
    }
}
