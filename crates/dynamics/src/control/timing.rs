//! Times at which a controller computes and its commands act.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ControlError;

/// Time at which a controller computes, and duration of its command.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ControlTiming {
    /// Once per period, from the position measured at t_k. The torque is held for one period. The
    /// derivative is the backward difference of the error, ė_k = (e_k − e_{k−1}) / T.
    Sampled {
        /// The period \[s\].
        sample_period_s: f64,
        /// From the measurement to the instant at which its command begins to act \[s\]; 0 to 16
        /// periods.
        #[serde(default)]
        computation_delay_s: f64,
    },
    /// At every instant, from the true position and velocity; no quantisation, no hold.
    Continuous {
        /// The period at which the loop is recorded \[s\].
        sample_period_s: f64,
    },
}

impl ControlTiming {
    /// Returns the period of the samples \[s\].
    pub fn sample_period_s(self) -> f64 {
        match self {
            Self::Sampled { sample_period_s, .. } | Self::Continuous { sample_period_s } => {
                sample_period_s
            }
        }
    }

    /// Returns the mean time of the torque segment that acts just after a sample, relative to the
    /// sample \[s\]. A command acts for one period T. Just after a sample it still acts for the
    /// fraction of a period in its delay, or for a full period if that fraction is zero. The mean
    /// time is this end less T/2. A continuous controller's torque just after a sample is that of
    /// the sample itself.
    pub fn mean_time_after_sample_s(self) -> f64 {
        match self {
            Self::Continuous { .. } => 0.0,
            Self::Sampled { sample_period_s, computation_delay_s } => {
                let (_, rest_s) = split_delay(computation_delay_s, sample_period_s);
                let end_s = if rest_s > 0.0 { rest_s } else { sample_period_s };
                end_s - 0.5 * sample_period_s
            }
        }
    }

    pub(super) fn validate(self) -> Result<(), ControlError> {
        let sample_period_s = self.sample_period_s();
        let computation_delay_s = match self {
            Self::Sampled { computation_delay_s, .. } => computation_delay_s,
            Self::Continuous { .. } => 0.0,
        };
        if !(sample_period_s.is_finite() && sample_period_s > 0.0) {
            return Err(ControlError::BadTiming {
                key: "sample_period_s",
                value: sample_period_s,
                expected: "finite and positive",
            });
        }
        // A delay of many periods is a mistake of units, and pending commands take memory.
        if !(0.0..=16.0 * sample_period_s).contains(&computation_delay_s) {
            return Err(ControlError::BadTiming {
                key: "computation_delay_s",
                value: computation_delay_s,
                expected: "between 0 and 16 sample periods",
            });
        }
        Ok(())
    }
}

/// Splits a delay into full periods and the rest of one \[s\]. A rest within rounding of a full
/// period is zero.
pub(crate) fn split_delay(delay_s: f64, period_s: f64) -> (usize, f64) {
    let periods = delay_s / period_s;
    let whole_periods = (periods + 1e-9).floor();
    let rest = periods - whole_periods;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the controller's validation keeps the delay within 16 periods"
    )]
    let whole_periods = whole_periods as usize;
    (whole_periods, if rest < 1e-9 { 0.0 } else { rest * period_s })
}
