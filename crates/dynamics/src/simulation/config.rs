//! Simulation of a loop, as configured in a file.

use serde::{Deserialize, Serialize};

use super::checked::check_length;
use super::error::SetupError;
use super::{Integrator, NoiseConfig, Unmodelled};
use crate::control::ControllerConfig;

/// Integration and measurement of a closed loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulationConfig {
    /// The method.
    #[serde(default)]
    pub integrator: Integrator,
    /// Integration steps per sample; 1 is the paper's.
    #[serde(default = "one_substep")]
    pub substeps: u32,
    /// Encoder counts per turn of each motor; ideal encoders when absent. The grid includes 0 and
    /// has a line every 2π / counts rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub encoder_counts_per_turn: Option<Vec<u32>>,
    /// Random disturbances; none when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseConfig>,
    /// Errors of the arm that its model does not know; none when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unmodelled: Option<Unmodelled>,
    /// Limits of divergence.
    #[serde(default)]
    pub divergence: DivergenceLimits,
}

/// Bounds that only an unstable loop exceeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DivergenceLimits {
    /// Largest |q_r − q| \[rad\].
    pub position_error_rad: f64,
    /// Largest |q̇| \[rad/s\].
    pub velocity_rad_s: f64,
}

impl Default for DivergenceLimits {
    /// An error of one turn, and several times the speed of any arm's joint.
    fn default() -> Self {
        Self { position_error_rad: core::f64::consts::TAU, velocity_rad_s: 100.0 }
    }
}

/// State of the arm at time 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum InitialState {
    /// On the reference, with its velocity.
    #[default]
    OnReference,
    /// At a given position and velocity.
    At {
        /// Joint positions \[rad\].
        position_rad: Vec<f64>,
        /// Joint velocities \[rad/s\].
        velocity_rad_s: Vec<f64>,
    },
}

impl Default for SimulationConfig {
    /// ode3, one step per sample, ideal encoders, no noise, nothing unmodelled.
    fn default() -> Self {
        Self {
            integrator: Integrator::Ode3,
            substeps: one_substep(),
            encoder_counts_per_turn: None,
            noise: None,
            unmodelled: None,
            divergence: DivergenceLimits::default(),
        }
    }
}

impl SimulationConfig {
    /// Checks that a loop with this controller has derivatives with respect to its parameters.
    ///
    /// # Errors
    /// [`SetupError::NoSensitivity`].
    pub(super) fn check_differentiable(
        &self,
        controller: &ControllerConfig,
    ) -> Result<(), SetupError> {
        let limited = controller.joints.iter().any(|joint| joint.torque_limit_nm.is_some());
        for (present, what) in [
            (limited, "torque limits"),
            (self.encoder_counts_per_turn.is_some(), "an encoder's grid"),
            (self.unmodelled.is_some(), "errors of the model"),
        ] {
            if present {
                return Err(SetupError::NoSensitivity { what });
            }
        }
        Ok(())
    }

    /// Checks everything that the types cannot, for an arm with `joints` joints.
    pub fn validate(&self, joints: usize) -> Result<(), SetupError> {
        // A thousand steps per sample is a mistake, and takes minutes per simulated second.
        if !(1..=1000).contains(&self.substeps) {
            return Err(SetupError::BadValue {
                what: "substeps",
                value: f64::from(self.substeps),
                expected: "1 to 1000",
            });
        }
        if let Some(counts) = &self.encoder_counts_per_turn {
            check_length("encoder_counts_per_turn", joints, counts.len())?;
            if counts.contains(&0) {
                let key = "encoder_counts_per_turn";
                return Err(SetupError::BadValue { what: key, value: 0.0, expected: "positive" });
            }
        }
        for (what, value) in [
            ("divergence.position_error_rad", self.divergence.position_error_rad),
            ("divergence.velocity_rad_s", self.divergence.velocity_rad_s),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(SetupError::BadValue { what, value, expected: "finite and positive" });
            }
        }
        self.noise.as_ref().map_or(Ok(()), |noise| noise.validate(joints))?;
        self.unmodelled.as_ref().map_or(Ok(()), |unmodelled| unmodelled.validate(joints))
    }
}

fn one_substep() -> u32 {
    1
}
