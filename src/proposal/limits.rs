//! Limits of the proposal of a cell.

/// Limits for detecting the content of columns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ProposalLimits {
    /// Factor by which a position may exceed its limits \[1\]. Derived: limits are round numbers.
    pub limit_factor: f64,
    /// Range of limits that are degrees, if they are given in radians \[rad\]. Derived: only a
    /// continuous joint turns further than two turns either way, and it has a hundred.
    pub degree_limits_rad: [f64; 2],
    /// Largest difference of a step to a turn, of angles that wrap \[1\]. Convention: no joint
    /// moves by a tenth of a turn within a sample.
    pub turn_share: f64,
    /// Smallest motion of a joint that indicates its unit \[rad or m\]. Derived: in the smaller
    /// unit, the joint would hardly move.
    pub min_motion: f64,
    /// Smallest share of a torque's square that gravity has to explain \[1\]. Convention: half.
    pub min_explained_share: f64,
    /// Factors between the nominal masses and the true ones with payload: for the complete arm, and
    /// for each joint \[1\]. Convention.
    pub mass_factors: [f64; 2],
    /// Smallest share of the power that a drive loses in an arm with friction \[1\]. Convention.
    pub min_lost_share: f64,
    /// Tolerance for a joint's return to its position, as a share of its span in the log \[1\].
    /// Convention.
    pub return_tolerance: f64,
    /// Range of plausible row rates of a robot's log \[Hz\]. Derived: it spans three powers of ten,
    /// so that one unit of time fits.
    pub rates_hz: core::ops::Range<f64>,
    /// Largest number of rows per second after the decimation filter \[Hz\]. Derived: these rows
    /// cover motion of an arm below about 10 Hz.
    pub rows_hz: f64,
    /// Smallest number of samples per row \[1\]. Convention: the paper decimates by 50.
    pub samples_per_row: f64,
}

impl ProposalLimits {
    /// The values that the program uses.
    pub(crate) const DEFAULT: Self = Self {
        limit_factor: 1.02,
        degree_limits_rad: [2.0 * core::f64::consts::TAU, 99.0 * core::f64::consts::TAU],
        turn_share: 0.1,
        min_motion: 0.3,
        min_explained_share: 0.5,
        mass_factors: [2.0, 3.0],
        min_lost_share: 0.1,
        return_tolerance: 0.1,
        rates_hz: 20.0..20_000.0,
        rows_hz: 25.0,
        samples_per_row: 10.0,
    };
}
