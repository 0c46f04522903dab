//! What a level of an axis changes: the arm that is simulated, or what is known of its controller.

use didim_core::control::ControlError;
use didim_core::simulation::{NoiseConfig, Unmodelled};
use didim_core::trajectory::RandomMoves;
use didim_sim::{Payload, Scenario, ScenarioError};
use serde::Deserialize;

use didim::cell::Cell;

/// One level of an axis. What it leaves out is as the scenario and the cell have it.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// As tables call it.
    pub name: String,
    /// Another scenario, with its own motion: a shipped scenario's name, or a file relative to the
    /// plan.
    #[serde(default)]
    pub scenario: Option<String>,
    /// Another motion of the same length, drawn at random.
    #[serde(default)]
    pub random_moves: Option<RandomMoves>,
    /// All random disturbances; the seed is that of the run.
    #[serde(default)]
    pub noise: Option<Noise>,
    /// What the arm does and its model does not know.
    #[serde(default)]
    pub unmodelled: Option<Unmodelled>,
    /// What the arm carries, and nobody says.
    #[serde(default)]
    pub payload: Option<Payload>,
    /// Bandwidth of the arm's controller, and of the one that the cell describes, over that of the
    /// files.
    #[serde(default)]
    pub bandwidth: Option<f64>,
    /// Bandwidth of the described controller over that of the arm's: other than 1, the description
    /// is wrong.
    #[serde(default)]
    pub described_bandwidth: Option<f64>,
    /// Torque gain of the described controller over that of the arm's, likewise.
    #[serde(default)]
    pub described_gain: Option<f64>,
}

/// [`NoiseConfig`] but for its seed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Of each motor's measured angle, before the encoder's grid \[rad\].
    #[serde(default)]
    pub motor_position_rad: Option<Vec<f64>>,
    /// Of the torque on each joint that the command does not contain \[N·m\].
    #[serde(default)]
    pub disturbance_torque_nm: Option<Vec<f64>>,
    /// Time in which the autocorrelation of the disturbance falls to 1/e \[s\]; white when left out.
    #[serde(default)]
    pub disturbance_correlation_s: Option<f64>,
    /// Of each joint's logged torque \[N·m\].
    #[serde(default)]
    pub torque_measurement_nm: Option<Vec<f64>>,
}

impl Level {
    /// The keys that it has, its name left out.
    pub(super) fn keys(&self) -> impl Iterator<Item = &'static str> {
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

    /// This level and one of another axis, which has other keys.
    pub(super) fn and(self, other: &Self) -> Self {
        Self {
            name: self.name,
            scenario: self.scenario.or_else(|| other.scenario.clone()),
            random_moves: self.random_moves.or_else(|| other.random_moves.clone()),
            noise: self.noise.or_else(|| other.noise.clone()),
            unmodelled: self.unmodelled.or_else(|| other.unmodelled.clone()),
            payload: self.payload.or(other.payload),
            bandwidth: self.bandwidth.or(other.bandwidth),
            described_bandwidth: self.described_bandwidth.or(other.described_bandwidth),
            described_gain: self.described_gain.or(other.described_gain),
        }
    }

    /// The factors of controllers that make no sense: each has to be positive.
    pub(super) fn wrong_factor(&self) -> Option<(&'static str, f64)> {
        let factors = [
            ("bandwidth", self.bandwidth),
            ("described_bandwidth", self.described_bandwidth),
            ("described_gain", self.described_gain),
        ];
        let factors = factors.into_iter().filter_map(|(key, factor)| Some((key, factor?)));
        factors.into_iter().find(|(_, factor)| !(factor.is_finite() && *factor > 0.0))
    }

    /// The scenario along the motion of this level.
    ///
    /// # Errors
    /// [`ScenarioError::Trajectory`] where it is no motion for the arm.
    pub(super) fn moved(&self, scenario: Scenario) -> Result<Scenario, ScenarioError> {
        match &self.random_moves {
            Some(random) => {
                let moves = random.draw(scenario.limits())?;
                scenario.with_moves(&moves)
            }
            None => Ok(scenario),
        }
    }

    /// The arm of this level, whose motion is that of the scenario.
    ///
    /// # Errors
    /// [`ScenarioError`] where something does not fit the arm.
    pub(super) fn simulated(&self, mut scenario: Scenario) -> Result<Scenario, ScenarioError> {
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
        if let Some(payload) = self.payload {
            scenario = scenario.with_payload(payload)?;
        }
        match self.bandwidth {
            Some(factor) => scenario.with_bandwidth(factor),
            None => Ok(scenario),
        }
    }

    /// The cell that identifies it, with the controller that it takes for the arm's.
    ///
    /// # Errors
    /// [`ControlError`] where a factor is not positive.
    pub(super) fn described(&self, mut cell: Cell) -> Result<Cell, ControlError> {
        let bandwidth = self.bandwidth.unwrap_or(1.0) * self.described_bandwidth.unwrap_or(1.0);
        let gain = self.described_gain.unwrap_or(1.0);
        if let Some(controller) = &mut cell.options.controller {
            *controller = controller.clone().with_bandwidth(bandwidth)?.with_gain(gain);
        }
        Ok(cell)
    }
}
