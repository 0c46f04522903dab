//! Whether a result may be used: one place, thresholds as data, reasons in words.

use serde::{Deserialize, Serialize};

use super::estimate::{Estimate, Verdict};
use crate::robot::ParameterKind;

/// What a result must satisfy to be called applicable.
///
/// The verdict is a first filter against what is plainly wrong: a motion that does not excite, a
/// model of another arm, a torque with the wrong sign. Passing it proves nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VerdictLimits {
    /// Largest condition number of the weighted, decimated observation matrix. 5000: the paper's
    /// useful results have up to 1178 (its tables 2 and 5), its poor one 7622.
    pub condition_number: f64,
    /// Largest relative error ‖y − Xθ‖/‖y‖ over all joints. 0.10: a good model of an industrial arm
    /// reaches 0.04 to 0.07.
    pub relative_error: f64,
    /// Largest relative error of a single joint. 0.25: wrists with little load reach 0.12, a joint
    /// with a wrong coupling 0.15 to 0.33.
    pub relative_error_per_joint: f64,
    /// A friction coefficient or drive inertia below zero by more than this many standard
    /// deviations is impossible. 3.
    pub negative_deviations: f64,
}

impl Default for VerdictLimits {
    fn default() -> Self {
        Self {
            condition_number: 5000.0,
            relative_error: 0.10,
            relative_error_per_joint: 0.25,
            negative_deviations: 3.0,
        }
    }
}

/// A limit that no result can be held against.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("limit {name} = {value} must be finite and greater than 0")]
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
            ("condition_number", self.condition_number),
            ("relative_error", self.relative_error),
            ("relative_error_per_joint", self.relative_error_per_joint),
            ("negative_deviations", self.negative_deviations),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(LimitError { name, value });
            }
        }
        Ok(())
    }

    /// Judges an estimate; `kinds` are those of its parameters, in their order. A figure that is
    /// not a number fails.
    pub(super) fn judge(&self, estimate: &Estimate, kinds: &[ParameterKind]) -> Verdict {
        let mut reasons = Vec::new();
        let exceeds = |value: f64, limit: f64| value.is_nan() || value > limit;

        if exceeds(estimate.condition_number, self.condition_number) {
            reasons.push(format!(
                "condition number {:.0} is above {}: the motion does not tell these parameters \
                 apart; move along a richer trajectory or identify fewer",
                estimate.condition_number, self.condition_number
            ));
        }
        if exceeds(estimate.relative_error, self.relative_error) {
            reasons.push(format!(
                "relative error {:.1} % is above {:.1} %: the model does not describe the \
                 measured torques; check drive gains, signs and timing",
                100.0 * estimate.relative_error,
                100.0 * self.relative_error
            ));
        }
        for (joint, &error) in (1..).zip(&estimate.relative_error_per_joint) {
            if exceeds(error, self.relative_error_per_joint) {
                reasons.push(format!(
                    "relative error {:.1} % of joint {joint} is above {:.1} %: check its gear \
                     ratio, coupling and drive gain",
                    100.0 * error,
                    100.0 * self.relative_error_per_joint
                ));
            }
        }
        for (parameter, &kind) in estimate.parameters.iter().zip(kinds) {
            // A regrouped parameter may be negative: others are subtracted in it.
            let Some(what) = positive_quantity(kind).filter(|_| !parameter.name.ends_with('r'))
            else {
                continue;
            };
            let allowed = self.negative_deviations * parameter.standard_deviation;
            if exceeds(-parameter.value, allowed) {
                reasons.push(format!(
                    "{what} {} is negative, {:.4} with a standard deviation of {:.2e}: check the \
                     signs of torque and transmission",
                    parameter.name, parameter.value, parameter.standard_deviation
                ));
            }
        }
        Verdict { applicable: reasons.is_empty(), reasons, notes: Vec::new() }
    }
}

/// What the quantity is called when it cannot be negative.
fn positive_quantity(kind: ParameterKind) -> Option<&'static str> {
    match kind {
        ParameterKind::Ia => Some("drive inertia"),
        ParameterKind::Fv | ParameterKind::FvMotor => Some("viscous friction"),
        ParameterKind::Fc | ParameterKind::FcMotor => Some("Coulomb friction"),
        _ => None,
    }
}
