//! Changes that a level makes to the simulated arm, or to the controller that the identification
//! assumes.

use didim_dynamics::control::ControlError;
use didim_dynamics::simulation::{NoiseConfig, Unmodelled};
use didim_dynamics::trajectory::RandomMoves;
use didim_sim::{FramedPayload, Scenario, ScenarioError};
use serde::Deserialize;

use didim::cell::Cell;

/// Level of an axis. A key that the level leaves out keeps its value from the scenario or the cell.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Name in tables.
    pub name: String,
    /// Another scenario, with its own motion: a shipped scenario's name, or a file relative to the
    /// plan.
    #[serde(default)]
    pub scenario: Option<String>,
    /// Another motion of the same length, drawn at random.
    #[serde(default)]
    pub random_moves: Option<RandomMoves>,
    /// All random disturbances. The seed comes from the run.
    #[serde(default)]
    pub noise: Option<Noise>,
    /// Effects of the arm that its model does not contain.
    #[serde(default)]
    pub unmodelled: Option<Unmodelled>,
    /// Payload of the simulated arm that the cell does not declare.
    #[serde(default)]
    pub payload: Option<FramedPayload>,
    /// Factor on the bandwidth of the simulated arm's controller and of the cell's controller,
    /// relative to the bandwidth in their files.
    #[serde(default)]
    pub bandwidth: Option<f64>,
    /// Bandwidth of the cell's controller divided by the bandwidth of the simulated arm's
    /// controller. With a value other than 1, the identification assumes a wrong controller.
    #[serde(default)]
    pub described_bandwidth: Option<f64>,
    /// Torque gain of the cell's controller divided by the torque gain of the simulated arm's
    /// controller. With a value other than 1, the identification assumes a wrong controller.
    #[serde(default)]
    pub described_gain: Option<f64>,
}

/// [`NoiseConfig`] without its seed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Standard deviation of the noise of each motor's measured angle, before quantization by the
    /// encoder \[rad\].
    #[serde(default)]
    pub motor_position_rad: Option<Vec<f64>>,
    /// Standard deviation of the disturbance torque on each joint, which the command does not
    /// contain \[N·m\].
    #[serde(default)]
    pub disturbance_torque_nm: Option<Vec<f64>>,
    /// Time in which the autocorrelation of the disturbance falls to 1/e \[s\]. By default the
    /// disturbance is white.
    #[serde(default)]
    pub disturbance_correlation_s: Option<f64>,
    /// Standard deviation of the noise of each joint's logged torque \[N·m\].
    #[serde(default)]
    pub torque_measurement_nm: Option<Vec<f64>>,
}

impl Level {
    /// Returns the names of the keys that are set, without `name`.
    pub(super) fn keys_set(&self) -> impl Iterator<Item = &'static str> {
        [
            ("scenario", self.scenario.is_some()),
            ("random_moves", self.random_moves.is_some()),
            ("noise", self.noise.is_some()),
            ("unmodelled", self.unmodelled.is_some()),
            ("payload", self.payload.is_some()),
            ("bandwidth", self.bandwidth.is_some()),
            ("described_bandwidth", self.described_bandwidth.is_some()),
            ("described_gain", self.described_gain.is_some()),
        ]
        .into_iter()
        .filter_map(|(key, present)| present.then_some(key))
    }

    /// Combines this level with a level of another axis. The two levels set different keys.
    pub(super) fn combine(self, other: &Self) -> Self {
        Self {
            name: self.name,
            scenario: self.scenario.or_else(|| other.scenario.clone()),
            random_moves: self.random_moves.or_else(|| other.random_moves.clone()),
            noise: self.noise.or_else(|| other.noise.clone()),
            unmodelled: self.unmodelled.or_else(|| other.unmodelled.clone()),
            payload: self.payload.or_else(|| other.payload.clone()),
            bandwidth: self.bandwidth.or(other.bandwidth),
            described_bandwidth: self.described_bandwidth.or(other.described_bandwidth),
            described_gain: self.described_gain.or(other.described_gain),
        }
    }

    /// Returns the key and the value of a controller factor that is not positive, if there is one.
    pub(super) fn wrong_factor(&self) -> Option<(&'static str, f64)> {
        let factors = [
            ("bandwidth", self.bandwidth),
            ("described_bandwidth", self.described_bandwidth),
            ("described_gain", self.described_gain),
        ];
        let factors = factors.into_iter().filter_map(|(key, factor)| Some((key, factor?)));
        factors.into_iter().find(|(_, factor)| !(factor.is_finite() && *factor > 0.0))
    }

    /// Returns the scenario with the motion of this level.
    ///
    /// # Errors
    /// [`ScenarioError::Trajectory`] if the arm cannot make the motion.
    pub(super) fn along_motion(&self, scenario: Scenario) -> Result<Scenario, ScenarioError> {
        match &self.random_moves {
            Some(random) => {
                let moves = random.draw_sequence(scenario.limits())?;
                scenario.with_moves(&moves)
            }
            None => Ok(scenario),
        }
    }

    /// Returns the scenario with the simulated arm of this level. The motion does not change.
    ///
    /// # Errors
    /// [`ScenarioError`] if a value of the level does not fit the arm.
    pub(super) fn simulated_arm(&self, mut scenario: Scenario) -> Result<Scenario, ScenarioError> {
        if let Some(noise) = &self.noise {
            scenario = scenario.with_noise(NoiseConfig {
                motor_position_rad: noise.motor_position_rad.clone(),
                disturbance_torque_nm: noise.disturbance_torque_nm.clone(),
                disturbance_correlation_s: noise.disturbance_correlation_s,
                torque_measurement_nm: noise.torque_measurement_nm.clone(),
                ..NoiseConfig::with_seed(1)
            })?;
        }
        if let Some(unmodelled) = &self.unmodelled {
            scenario = scenario.with_unmodelled(unmodelled.clone())?;
        }
        if let Some(payload) = &self.payload {
            scenario = scenario.with_framed_payload(payload)?;
        }
        match self.bandwidth {
            Some(factor) => scenario.with_bandwidth(factor),
            None => Ok(scenario),
        }
    }

    /// Returns the cell for the identification, with the controller that it assumes for the arm.
    ///
    /// # Errors
    /// [`ControlError`] if a factor is not positive.
    pub(super) fn described_cell(&self, mut cell: Cell) -> Result<Cell, ControlError> {
        let bandwidth = self.bandwidth.unwrap_or(1.0) * self.described_bandwidth.unwrap_or(1.0);
        let gain = self.described_gain.unwrap_or(1.0);
        if let Some(controller) = &mut cell.options.controller {
            *controller = controller.clone().with_bandwidth(bandwidth)?.with_gain(gain);
        }
        Ok(cell)
    }
}
