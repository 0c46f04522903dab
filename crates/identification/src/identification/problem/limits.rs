//! Requirements of an applicable result: thresholds as data.

use serde::{Deserialize, Serialize};

/// Requirements of an applicable result.
///
/// The verdict finds faults that the data show: a motion that does not excite, a model of another
/// arm, a torque with the wrong sign, a friction law that is not the arm's. It cannot find faults
/// that no data show, above all a factor common to all torques.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VerdictLimits {
    /// Fewest independent rows (rows times the passband of the decimation filter) for each
    /// parameter. 8: with fewer, the residuals tell too little of their own spectrum.
    pub rows_per_parameter: f64,
    /// Largest condition number of the weighted, decimated observation matrix. 10 000: two
    /// recordings of a real arm with all its 58 parameters have up to 5927 and predict a third one
    /// well, single ones have 8569 to 18 652 and do not.
    pub condition_number: f64,
    /// Largest uncertainty of a joint's torque along the window's own motion, relative to that
    /// torque. 0.10: a short or quiet window then has too little information.
    pub prediction_deviation: f64,
    /// Largest relative error ‖y − Xθ‖/‖y‖ over all joints. 0.10: a good model of an industrial arm
    /// reaches 0.04 to 0.07.
    pub relative_error: f64,
    /// Largest relative error of a single joint. 0.25: wrists with little load reach 0.12, a joint
    /// with a wrong coupling 0.15 to 0.33.
    pub relative_error_per_joint: f64,
    /// A friction coefficient or drive inertia below zero by more than this many standard
    /// deviations is impossible. 3.
    pub negative_deviations: f64,
    /// Largest uncertainty of the torque outside the recorded motion, relative to it. 0.15: records
    /// within it predicted others of the same arm with at most 0.06.
    #[serde(rename = "error_elsewhere")]
    pub error_of_extrapolation: f64,
    /// Largest error on held-out folds, relative to their torque. 0.15.
    pub held_out_error: f64,
    /// Largest combined uncertainty of a parameter whose value is asked for, relative to it. 0.10.
    pub parameter_uncertainty: f64,
    /// Furthest that a parameter may be with CLOE from that of the torques, in standard deviations.
    /// 4.
    pub model_shift_deviations: f64,
    /// Residuals are not white when white ones are as correlated by chance with less than this
    /// probability. 1e-4.
    pub model_probability: f64,
    /// How far the command that the described controller makes of the recorded reference and
    /// position may be from the recorded torque, relative to it and without what is noise. 0.001:
    /// counts of reference and torque leave a few 1e-5, a gain that is wrong by 2 % twice this
    /// limit.
    pub controller_error: f64,
    /// A note is made where position filter and position noise move a parameter further than this,
    /// in its standard deviations. 0.5: half of what the noise of the torques does.
    pub position_filter_deviations: f64,
}

impl Default for VerdictLimits {
    fn default() -> Self {
        Self {
            rows_per_parameter: 8.0,
            condition_number: 10_000.0,
            prediction_deviation: 0.10,
            relative_error: 0.10,
            relative_error_per_joint: 0.25,
            negative_deviations: 3.0,
            error_of_extrapolation: 0.15,
            held_out_error: 0.15,
            parameter_uncertainty: 0.10,
            model_shift_deviations: 4.0,
            model_probability: 1e-4,
            controller_error: 0.001,
            position_filter_deviations: 0.5,
        }
    }
}

/// An invalid limit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("limit {name} = {value} must be finite and greater than 0, and a share at most 1")]
pub struct LimitError {
    /// Its key.
    pub name: &'static str,
    /// The value given.
    pub value: f64,
}

impl VerdictLimits {
    /// Whether every limit is finite and greater than 0: against NaN everything passes.
    ///
    /// # Errors
    /// [`LimitError`] names the first that is not.
    pub fn validate(&self) -> Result<(), LimitError> {
        for (name, value) in [
            ("rows_per_parameter", self.rows_per_parameter),
            ("condition_number", self.condition_number),
            ("prediction_deviation", self.prediction_deviation),
            ("relative_error", self.relative_error),
            ("relative_error_per_joint", self.relative_error_per_joint),
            ("negative_deviations", self.negative_deviations),
            ("error_elsewhere", self.error_of_extrapolation),
            ("held_out_error", self.held_out_error),
            ("parameter_uncertainty", self.parameter_uncertainty),
            ("model_shift_deviations", self.model_shift_deviations),
            ("model_probability", self.model_probability),
            ("controller_error", self.controller_error),
            ("position_filter_deviations", self.position_filter_deviations),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(LimitError { name, value });
            }
        }
        // Shares of the whole; 5 % is 0.05.
        for (name, value) in [
            ("model_probability", self.model_probability),
            ("relative_error", self.relative_error),
            ("relative_error_per_joint", self.relative_error_per_joint),
            ("prediction_deviation", self.prediction_deviation),
            ("error_elsewhere", self.error_of_extrapolation),
            ("held_out_error", self.held_out_error),
            ("parameter_uncertainty", self.parameter_uncertainty),
            ("controller_error", self.controller_error),
        ] {
            if value > 1.0 {
                return Err(LimitError { name, value });
            }
        }
        Ok(())
    }
}
