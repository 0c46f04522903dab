//! Requirements of an applicable result: thresholds as data.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Requirements of an applicable result.
///
/// The verdict finds faults that the data show: a motion that does not excite, a model of another
/// arm, a torque with the wrong sign, a friction law that is not the arm's. It cannot find faults
/// that no data show, above all a factor common to all torques.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VerdictLimits {
    /// Fewest independent rows for each parameter: the rows times `decimation_filter.cutoff_ratio`.
    pub rows_per_parameter: f64,
    /// Largest condition number of the weighted, decimated observation matrix.
    pub condition_number: f64,
    /// Largest torque uncertainty of a joint along the window's own motion, from the parameters,
    /// relative to that torque \[share\].
    pub prediction_deviation: f64,
    /// Largest relative error ‖y − Xθ‖/‖y‖ over all joints \[share\].
    pub relative_error: f64,
    /// Largest relative error of a single joint \[share\].
    pub relative_error_per_joint: f64,
    /// Smallest torque by which a joint's error is divided: this share of its torque limit. Without
    /// a limit above the recorded torques, it is this share of the largest root mean square torque
    /// of any joint \[share\].
    pub torque_floor: f64,
    /// Standard deviations below zero from which a friction coefficient or a drive inertia is
    /// impossible \[σ\].
    pub negative_deviations: f64,
    /// Largest torque uncertainty outside the recorded motion, relative to the torque \[share\].
    #[serde(rename = "error_elsewhere")]
    pub error_of_extrapolation: f64,
    /// Largest cross-validation error \[share\]: on held-out parts of the motion, relative to their
    /// torque.
    pub held_out_error: f64,
    /// Largest combined uncertainty of a parameter whose value is required, relative to it
    /// \[share\].
    pub parameter_uncertainty: f64,
    /// With CLOE \[σ\]: largest distance between the parameters from positions and those from
    /// torques.
    pub model_shift_deviations: f64,
    /// Largest probability of a false finding about the model or its controller \[share\]: noise
    /// alone causes such an effect, among all effects that are tested, at most this often.
    pub model_probability: f64,
    /// Largest difference between the command of the described controller and the recorded torque,
    /// relative to it and without noise \[share\]. The limit is at least the tolerance of the
    /// torque gain.
    pub controller_error: f64,
    /// A note is given if position filter and position noise shift a parameter by more than this
    /// \[σ\].
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
            torque_floor: 0.05,
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
    /// Key of the limit.
    pub name: &'static str,
    /// Configured value.
    pub value: f64,
}

impl VerdictLimits {
    /// Checks that every limit is finite and greater than 0, because a comparison with NaN would
    /// never fail.
    ///
    /// # Errors
    /// [`LimitError`] with the first invalid limit.
    pub fn validate(&self) -> Result<(), LimitError> {
        for (name, value) in [
            ("rows_per_parameter", self.rows_per_parameter),
            ("condition_number", self.condition_number),
            ("prediction_deviation", self.prediction_deviation),
            ("relative_error", self.relative_error),
            ("relative_error_per_joint", self.relative_error_per_joint),
            ("torque_floor", self.torque_floor),
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
            ("torque_floor", self.torque_floor),
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
