//! Random disturbances of the loop.

use serde::{Deserialize, Serialize};

use super::checked::{check_length, check_not_negative, check_positive};
use super::disturbance::DisturbanceTorque;
use super::error::SetupError;
use super::white_noise::WhiteNoise;

/// Normal noise, one standard deviation per motor or joint; an absent list means no noise. Every
/// sample has its own value; a disturbance with a correlation time depends on the previous one.
///
/// Torque noise exists in two kinds. A *disturbance* is a torque that the arm feels and the log
/// does not show: friction that no model has, ripple of the current loop. *Measurement* noise is
/// added to the logged command and the arm does not feel it. A drive's logged command is exact, so
/// the truth scenarios use the disturbance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseConfig {
    /// Seed of the random sequence.
    pub seed: u64,
    /// Noise of each motor's measured angle, before the encoder's grid \[rad\]; inside the loop.
    #[serde(default)]
    pub motor_position_rad: Option<Vec<f64>>,
    /// Disturbance torque of each joint that the command does not contain \[N·m\]; constant for a
    /// period.
    #[serde(default)]
    pub disturbance_torque_nm: Option<Vec<f64>>,
    /// Time in which the autocorrelation of the disturbance falls to 1/e \[s\], the same for every
    /// joint: noise of first order with the standard deviations above. White when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disturbance_correlation_s: Option<f64>,
    /// Noise of each joint's logged torque \[N·m\]; outside the loop.
    #[serde(default)]
    pub torque_measurement_nm: Option<Vec<f64>>,
}

impl NoiseConfig {
    /// Creates a configuration without noise.
    pub fn with_seed(seed: u64) -> Self {
        Self {
            seed,
            motor_position_rad: None,
            disturbance_torque_nm: None,
            disturbance_correlation_s: None,
            torque_measurement_nm: None,
        }
    }

    fn deviation_lists(&self) -> [(&'static str, Option<&Vec<f64>>); 3] {
        [
            ("noise.motor_position_rad", self.motor_position_rad.as_ref()),
            ("noise.disturbance_torque_nm", self.disturbance_torque_nm.as_ref()),
            ("noise.torque_measurement_nm", self.torque_measurement_nm.as_ref()),
        ]
    }

    pub(super) fn validate(&self, joints: usize) -> Result<(), SetupError> {
        for (what, list) in self.deviation_lists() {
            let Some(list) = list else { continue };
            check_length(what, joints, list.len())?;
            list.iter().try_for_each(|sd| check_not_negative(what, *sd))?;
        }
        self.disturbance_correlation_s
            .map_or(Ok(()), |value| check_positive("noise.disturbance_correlation_s", value))
    }
}

/// The three noises of a loop. Each has its own stream, so that switching one on does not change
/// the others.
#[derive(Clone, Debug)]
pub(super) struct Noises {
    pub(super) motor_position: WhiteNoise,
    pub(super) disturbance_torque: DisturbanceTorque,
    pub(super) torque_measurement: WhiteNoise,
}

impl Noises {
    /// Creates the noises of a loop with this period \[s\].
    pub(super) fn new(config: Option<&NoiseConfig>, period_s: f64) -> Self {
        let [motor_position, white, torque_measurement] = [0, 1, 2].map(|stream| {
            let list = config.and_then(|config| config.deviation_lists()[stream].1.cloned());
            WhiteNoise::new(config.map_or(0, |config| config.seed), stream as u64, list)
        });
        let correlation_s = config.and_then(|config| config.disturbance_correlation_s);
        let disturbance_torque = DisturbanceTorque::new(white, correlation_s, period_s);
        Self { motor_position, disturbance_torque, torque_measurement }
    }
}
