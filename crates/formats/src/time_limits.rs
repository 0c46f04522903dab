//! Limits for times of recorded rows.

/// Limits that decide about times of rows. Distances are relative to the sample period.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeLimits {
    /// Largest relative deviation of a rate \[1\]. Derived: with time scaled by 1 + r, velocities
    /// are wrong by the factor 1 + r and accelerations by its square: viscous friction by r,
    /// inertias by 2 r, with no trace in the residuals. The crystals of a controller and of a
    /// computer have ±1e-4 each, and a clock that is being disciplined some 1e-4 more. Inertias are
    /// then wrong by at most 0.06 %; a drive's torque gain is hardly known to ten times that.
    pub same_rate: f64,
    /// Distance of two rows from which rows are missing between them and a new piece begins
    /// \[periods\]. Derived: one missing row and half a period of jitter.
    pub gap_periods: f64,
    /// Distance of two rows from which one row is missing \[periods\]. Derived: the middle between
    /// one period and two.
    pub missing_row_periods: f64,
    /// Distance below which two rows are one \[periods\]. A cubic through both would follow their
    /// noise. Convention.
    pub duplicate_periods: f64,
    /// Rows arrive in bursts if more than one in this number of distances is longer than that of a
    /// missing row \[1\]. Convention.
    pub burst_distances: usize,
    /// Share of a recording by which time falls where another recording begins \[1\]. A clock that
    /// was set falls by less. Convention.
    pub restart_share: f64,
    /// Fewest rows of a recording within a file, and of a record in which states that stand in
    /// several rows are looked for \[1\]. Convention.
    pub recording_rows: usize,
    /// Pause between two recordings of a file \[periods\]. Convention: beyond `gap_periods`.
    pub restart_periods: f64,
    /// Largest relative deviation of the configured rate from the times, if the rows are resampled
    /// \[1\]. Convention: the times decide, and the rate has to be recognisable.
    pub resampled_rate: f64,
    /// Largest distance of a time from the uniform grid of a table \[periods\]. Convention: half of
    /// the distance at which the row would be unknown.
    pub grid_periods: f64,
    /// Distance from the grid below which times are taken as on it when positions are
    /// differentiated \[periods\]. Convention.
    pub grid_jitter_periods: f64,
    /// Step from which a position jumps, as a share of the span of the recorded positions \[1\].
    /// Convention: no joint crosses a twentieth of its motion within a sample.
    pub jump_share: f64,
    /// Share of a jump by which the next position but one may differ from the position before the
    /// jump \[1\]. Convention.
    pub alternating_return_share: f64,
    /// Share of the messages with such jumps from which a second publisher is assumed \[1\].
    /// Convention.
    pub alternating_share: f64,
    /// A second publisher is assumed if one in this number of messages, and at least this number,
    /// differs from the one before in having no effort \[1\]. Convention.
    pub alternating_messages: usize,
    /// Span of the recorded positions from which jumps count \[rad or m\]. Derived: an encoder of
    /// 10 bits flickers by 6e-3 rad at rest.
    pub alternating_motion: f64,
}

impl TimeLimits {
    /// The values that the program uses.
    pub const DEFAULT: Self = Self {
        same_rate: 3e-4,
        gap_periods: 2.5,
        missing_row_periods: 1.5,
        duplicate_periods: 0.3,
        burst_distances: 20,
        restart_share: 0.5,
        recording_rows: 100,
        restart_periods: 10.0,
        resampled_rate: 0.05,
        grid_periods: 0.25,
        grid_jitter_periods: 0.01,
        jump_share: 0.05,
        alternating_return_share: 0.1,
        alternating_share: 0.1,
        alternating_messages: 10,
        alternating_motion: 1e-2,
    };
}
