//! Options of the screening checks before a fit.

/// Options of the checks of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScreeningOptions {
    /// Check of the signals against the robot's limits.
    pub limits: LimitCheck,
    /// Check of the sample rate against the stamps.
    pub rate: RateCheck,
    /// Check of the commanded law.
    pub commands: CommandCheck,
    /// Detection of joints at rest.
    pub rest: RestCheck,
}

/// Options of the check against the robot's limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitCheck {
    /// Multiple of a limit beyond which the recording is refused \[1\]. Convention: no motion of
    /// this robot reaches it.
    pub refusal_multiple: f64,
    /// Multiple of a limit beyond which a note is given \[1\]. Convention: limits are round
    /// numbers, and a controller overshoots.
    pub note_multiple: f64,
    /// Half step of the position difference that gives a speed \[s\]. Convention: it keeps noise
    /// out of the speed.
    pub half_step_s: f64,
    /// Maximum number of samples beyond a limit that counts as a glitch and not as a motion.
    /// Convention.
    pub glitch_samples: usize,
    /// Multiple of a limit that indicates a wrong unit \[1\]. Derived: a wrong unit is off by a
    /// factor of 57, of 1000 or of a gear ratio.
    pub other_unit: f64,
}

impl Default for LimitCheck {
    fn default() -> Self {
        Self {
            refusal_multiple: 2.0,
            note_multiple: 1.02,
            half_step_s: 0.01,
            glitch_samples: 5,
            other_unit: 10.0,
        }
    }
}

/// Options of the check of the sample rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateCheck {
    /// Number of standard uncertainties beyond the tolerance at which a rate counts as wrong.
    /// Convention.
    pub coverage_deviations: f64,
    /// Largest relative standard uncertainty of a checked rate \[1\]. Derived: a rate error of 1e-3
    /// then differs from a correct rate by four standard uncertainties.
    pub most_uncertainty: f64,
    /// Number of blocks of samples. Convention: fewer samples than this identify nothing.
    pub block_count: usize,
    /// Share of the blocks that the scatter includes \[1\]. Convention: it tolerates nearly as many
    /// outlier blocks as the median of the slopes does.
    pub share_within: f64,
    /// Number of standard deviations of normal noise that include this share. Derived: Φ⁻¹((1 +
    /// 0.75) / 2).
    pub deviations_within: f64,
}

impl Default for RateCheck {
    fn default() -> Self {
        Self {
            coverage_deviations: 3.0,
            most_uncertainty: 1e-4,
            block_count: 16,
            share_within: 0.75,
            deviations_within: 1.15,
        }
    }
}

/// Options of the check of the commanded law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandCheck {
    /// Magnitude up to which a target counts as zero \[rad/s, N·m\]. Derived: a 12-bit signal over
    /// ±45 rad/s or ±54 N·m has no count for exactly zero, and its step is about half of this
    /// value.
    pub zero_tolerance: f64,
    /// Relative tolerance between a speed target and the reference speed \[1\]. Convention: their
    /// extremes have to agree within `zero_tolerance` plus this share of the largest reference
    /// speed.
    pub speed_share: f64,
    /// Half of the time over which the reference is differentiated \[s\]. Convention: over a
    /// shorter time, the steps of single counts dominate.
    pub reach_s: f64,
    /// Minimum computation rate of the loop \[Hz\]. Convention: motors compute it at tens of
    /// kilohertz.
    pub loop_hz: f64,
}

impl Default for CommandCheck {
    fn default() -> Self {
        Self { zero_tolerance: 0.05, speed_share: 0.05, reach_s: 0.01, loop_hz: 5000.0 }
    }
}

/// Options of the detection of joints at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestCheck {
    /// Largest range of a joint at rest, in standard deviations of its noise. Derived: ten million
    /// samples of white noise stay within it.
    pub noise_deviations: f64,
    /// Largest range of a joint at rest \[rad or m\]. Convention: motion that is sampled a few
    /// times per turn exceeds it.
    pub most_range: f64,
    /// Largest number of values of an encoder that flickers at rest. Convention.
    pub flickering_values: usize,
}

impl Default for RestCheck {
    fn default() -> Self {
        Self { noise_deviations: 12.0, most_range: 0.05, flickering_values: 4 }
    }
}
