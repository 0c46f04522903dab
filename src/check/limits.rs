//! Limits of the checks of a cell.

/// Limits from which `didim check` warns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CheckLimits {
    /// Smallest position range of a joint that moves \[rad or m\]. Convention.
    pub min_range: f64,
    /// Largest cut-off of the position filter, as a share of the sample rate \[1\]. Derived: above
    /// it, the filter passes the noise that central differences amplify most.
    pub max_cutoff_share: f64,
    /// Smallest ratio of the position filter's cut-off to the identified band \[1\]. Derived: the
    /// filter has to be flat in this band, and four poles, applied forward and backward, attenuate
    /// by 1 % at 0.56 of their cut-off frequency.
    pub min_cutoff_ratio: f64,
    /// Largest share of the bit rate that the layout's frames may use \[1\]. Convention: the rest
    /// is for repetitions and SDOs.
    pub max_bus_load: f64,
    /// Delay that the receive buffer has to cover \[s\]. It is that of a bus thread of ordinary
    /// priority on a busy machine. Convention.
    pub thread_delay_s: f64,
    /// Delay that the ring has to cover \[s\]. It is the longest one between a window and the
    /// writing of its recording. Convention: the time of an identification.
    pub extraction_delay_s: f64,
}

impl CheckLimits {
    /// The values that the program uses.
    pub(crate) const DEFAULT: Self = Self {
        min_range: 1e-3,
        max_cutoff_share: 0.35,
        min_cutoff_ratio: 1.8,
        max_bus_load: 0.7,
        thread_delay_s: 0.1,
        extraction_delay_s: 30.0,
    };
}
